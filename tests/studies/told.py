"""What find_gap would have returned, put together by hand."""

import numpy as np

from residual.gap.result import (
    ChannelGap,
    Gap,
    GapResult,
    Number,
    Span,
    Step,
    Verdict,
    Where,
)  # fmt: skip
from sims.effects import CoulombFriction, ParameterChange
from sims.pendulum_equation import PendulumEquation

MASS = Verdict(
    "confirmed", "mass", "mass", {"change": Number(0.035, 0.034, 0.036, "kg")},
    ("length", "gravity"), "", "never parsed", Span(0.95, 0.9, 0.97),
    same_motion=("length", "gravity"),
)  # fmt: skip
FRICTION = Verdict(
    "confirmed", "coulomb_friction", "pivot", {"level": Number(2e-3, 1e-3, 3e-3, "N m")},
    ("viscous_friction@pivot",), "dissipation", "never parsed", Span(0.03, 0.02, 0.04),
    form=("viscous_friction@pivot",),
)  # fmt: skip
DELAY = Verdict(
    "ambiguous", "delay", "voltage", {"time": Number(0.75, 0.75, 0.75, "s", True)},
    ("actuator_lag@voltage",), "", "never parsed", Span(0.01, 0.0, 0.02), True,
    doubts=("at_bound", "rivals"),
)  # fmt: skip


def rest(share):
    return Verdict("unexplained", "", "", {}, (), "", "never parsed", Span(share, share, share))


NO_GAP = Verdict("no_gap", "", "", {}, (), "", "never parsed", Span(0.0, 0.0, 0.0))
MINOR = Verdict("minor", "cogging", "pivot", {}, (), "", "never parsed", Span(0.004, 0.001, 0.007))


def result(*verdicts, share=0.98, effects=None, blocks=20):
    """What find_gap would have returned with these verdicts."""
    errors = [Span(x, 0.9 * x, 1.1 * x) for x in (1.0, 0.1, 0.09)]
    table = Gap(
        "angle", "rad", 1.0, *errors, (Step("", errors[0]), Step("mass", errors[1])),
        {"angle": ChannelGap("rad", *errors)}, 80.0, 1.05, Span(share, share, share), blocks, 5,
    )  # fmt: skip
    there = [ParameterChange("mass", 0.035), CoulombFriction("pivot", 2e-3)]
    effects = there if effects is None else effects
    where = Where({"angle": 80.0}, (), np.zeros(0), {}, {})
    return GapResult(
        verdicts, table, None, where, (), (), tuple(effects),
        PendulumEquation().with_effects(effects), (("angle", "rad"),), {"angle": (0.01, 0.001)},
        (), (), True, {},
    )  # fmt: skip
