"""One curve of an input is a rival of several laws that together make such a curve."""

import numpy as np
import pytest

import simgap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Spool(FirstOrderSystem):
    """A geared motor that winds a thread, by its duty; as if it were in proportion."""

    dt = 0.1
    state_channels = (Channel("speed", "rpm", "rate", scale=20.0),)
    action_channels = (Channel("duty", "1", "input", scale=100.0, low=0.0, high=255.0),)
    parameters = {
        "gain": Parameter(0.38, "rpm", "speed by duty", low=0.0),
        "slow": Parameter(0.2, "s", "time constant", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.slow)[:, None]


@pytest.fixture(scope="module")
def wound():
    """A minute of one that starts late and flattens, and slows down more slowly than it speeds up;
    it has no friction. By Euler in 10 ms."""
    rng = np.random.default_rng(5)
    duties = np.repeat(rng.choice([30.0, 60.0, 90.0, 120.0, 150.0], 40), 15)
    settled = np.interp(duties, [0, 25, 30, 60, 90, 120, 150], [0, 0, 0, 18.9, 34, 43, 48.1])
    speeds = [0.0]
    for goal in settled:
        speed = speeds[-1]
        for _ in range(10):
            speed += 0.01 * (goal - speed) / (0.17 if goal > speed else 0.32)
        speeds.append(speed)
    read = np.array(speeds) + rng.normal(0, 0.3, len(speeds))
    return Trajectory("spool", 0.1 * np.arange(len(read)), read[:, None], duties[:, None])


#: Among them all cases of a curve of the input, so that it is offered.
OFFERED = (
    "actuator_gain", "quadratic_actuator", "dead_zone", "saturation", "stribeck_friction",
)  # fmt: skip


@pytest.mark.long
def test_friction_and_a_limit_are_no_certain_answer_where_a_curve_does_as_well(wound):
    found = simgap.find_gap(Spool(), [wound], effects=OFFERED)
    named = {v.effect: v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    sure = {name for name, verdict in named.items() if verdict.kind == "confirmed"}
    curves = {"symmetric_input_curve", "input_curve"}
    others = {label.split("@")[0] for v in named.values() for label in v.alternatives}
    assert curves & {*named, *others}
    assert sure <= curves


def test_a_curve_that_is_asked_for_by_name_is_told_and_drawn(wound, tmp_path):
    effects = ("symmetric_input_curve@duty", "slow")
    found = simgap.find_gap(Spool(), [wound], effects=effects)
    (curve,) = [v for v in found.verdicts if v.effect == "symmetric_input_curve"]
    assert curve.label not in curve.alternatives
    for name, wanted in (("first", -12.0), ("fourth", 48.1 / 0.38 - 150)):
        number = curve.parameters[name]
        assert number.low - 6 <= wanted <= number.high + 6
    found.report(tmp_path / "report.html")
    assert (tmp_path / "report.html").exists()
