"""A state that settles follows its input: a law of the one is not taken for one of the other."""

import numpy as np
import pytest
from plate import Plate

from residual.gap import find_gap
from residual.trajectories import Trajectory

STRONGER, LIMIT = 1.5, 50.0


def fanned(seed):
    """A plate under the sun, by Euler in 50 ms: stronger than is thought, and a fan keeps it from
    getting warmer than a limit; the room's warmth wanders."""
    rng = np.random.default_rng(seed)
    power = []
    for peak in rng.uniform(0.4, 1.0, 8):
        clouds = 1 + 0.05 * np.repeat(rng.standard_normal(12), 10)
        power.extend(peak * np.sin(np.linspace(0, np.pi, 120)) * clouds)
    power, warmth = np.clip(power, 0, 1), [0.0]
    room = np.cumsum(rng.normal(0, 0.03, len(power)))
    for u, outside in zip(power, room, strict=True):
        x = warmth[-1]
        for _ in range(20):
            fan = 6.0 * max(x - LIMIT, 0.0)
            x += 0.05 * (60 * STRONGER * u - (x - outside) - fan) / 30
        warmth.append(x)
    seen = np.array(warmth) + 0.05 * rng.standard_normal(len(warmth))
    return Trajectory("days", np.arange(len(seen)) * 1.0, seen[:, None], power[:, None])


#: Among them all cases of curves by state and by input, so that these are offered.
OFFERED = (
    "actuator_gain", "quadratic_actuator", "dead_zone", "saturation", "constant_load",
    "proportional_loss", "time_constant",
)  # fmt: skip


@pytest.mark.long
def test_what_holds_the_state_is_no_saturation_of_its_input():
    found = find_gap(Plate(), [fanned(0)], effects=OFFERED)
    named = {v.effect: v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert "saturation" not in named
    points = named["state_curve"].parameters
    # The last one lies beyond the limit, where the fan cools by 1.1 K/s.
    assert points["sixth"].value < points["fifth"].value - 0.5
