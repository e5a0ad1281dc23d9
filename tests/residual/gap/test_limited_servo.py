"""A servo that turns at a limited speed; logs by Euler's method in steps of a hundredth sample."""

import numpy as np
import pytest
from servos import DT, SLOW, SlowServo

from residual.gap import find_gap
from residual.trajectories import Trajectory


def log(seed, slow=SLOW, level=np.inf, late=0.0):
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(-80, 80, 30) * rng.choice([0.15, 0.5, 1.0], 30)
    commands = np.repeat(sizes, rng.integers(15, 40, 30))
    arriving = np.concatenate([np.full(round(late / DT), commands[0]), commands])
    angle, angles = commands[0], [commands[0]]
    for command in arriving[: len(commands)]:
        for _ in range(100):
            angle += 0.01 * DT * np.clip((command - angle) / slow, -level, level)
        angles.append(angle)
    seen = np.array(angles) + 0.2 * rng.standard_normal(len(angles))
    return Trajectory("servo", DT * np.arange(len(angles)), seen[:, None], commands[:, None])


@pytest.mark.long
def test_a_limit_and_a_delay_are_named_with_their_numbers():
    found = find_gap(SlowServo(), [log(0, level=200.0, late=0.04)])
    named = {verdict.effect: verdict for verdict in found.verdicts if verdict.parameters}
    assert {name: v.kind for name, v in named.items()} == {
        "rate_limit": "confirmed", "delay": "confirmed",
    }  # fmt: skip
    level = named["rate_limit"].parameters["level"]
    assert level.value == pytest.approx(200.0, rel=0.02) and level.low < 200 < level.high
    assert named["delay"].parameters["time"].value == pytest.approx(0.04, abs=0.005)
    assert found.gap.share.value > 0.99


def test_a_servo_without_a_limit_is_given_none():
    for slow, late in ((SLOW, 0.0), (0.1, 0.04)):
        found = find_gap(SlowServo(), [log(0, slow=slow, late=late)])
        assert not any(v.effect == "rate_limit" for v in found.verdicts if v.parameters)
