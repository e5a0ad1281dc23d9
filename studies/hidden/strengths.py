"""How strong a hidden effect has to be to make a gap of a given size.

The size of a gap is the whitened residual of the nominal simulator over that of the truth, with
the start state of every window free: 1 is no gap. Free start states absorb part of any effect,
so the size is what a perfect method could see, not the error of a forecast.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from residual.gap.data.blocks import blocks
from residual.gap.data.samples import Samples
from residual.gap.data.windows import cut
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import signatures
from residual.gap.fitting.screening import trials as trial_variants
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Trial, candidates
from residual.gap.model.model import Model
from residual.gap.model.slopes import slopes
from residual.trajectories import Trajectory
from sims import effects as known
from sims.effects.base import Effect
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import (
    DT,
    INERTIA,
    LIMIT,
    MASS,
    NOISES,
    REACH,
    Array,
    Excitation,
    Truth,
    measure,
    simulate,
)


@dataclasses.dataclass(frozen=True)
class Hidden:
    """An effect that can be hidden.

    Args:
        effect: The library's effect at a strength, to size the gap and to score the numbers.
        typical: A middling strength, where the search for the right one begins.
        two_signed: Whether the strength may be negative.
        most: Largest strength that makes sense.
    """

    effect: Callable[[float], Effect]
    typical: float
    two_signed: bool = False
    most: float = math.inf


def _cogging(strength: float) -> Effect:
    phase = Truth.cogging_phase
    sine, cosine = strength * math.cos(phase), strength * math.sin(phase)
    return known.Cogging("pivot", sine, cosine, Truth.cogging_order)


def _parameter(name: str, nominal: float) -> Callable[[float], Effect]:
    return lambda strength: known.ParameterChange(name, strength * nominal)


#: By the name that the effect has in ``Truth`` and in the library.
HIDDEN: Mapping[str, Hidden] = {
    "viscous_friction": Hidden(lambda s: known.ViscousFriction("pivot", s), 1e-5),
    "coulomb_friction": Hidden(lambda s: known.CoulombFriction("pivot", s), 2e-4),
    "stribeck_friction": Hidden(
        lambda s: known.StribeckFriction("pivot", 0.0, s, Truth.stribeck_speed), 5e-4
    ),
    "quadratic_drag": Hidden(lambda s: known.QuadraticDrag("pivot", s), 1e-6),
    "linear_spring": Hidden(lambda s: known.LinearSpring("pivot", s), 1e-4),
    "cubic_spring": Hidden(lambda s: known.CubicSpring("pivot", s), 1e-5),
    "constant_load": Hidden(lambda s: known.ConstantLoad("pivot", s), 3e-4, True),
    "cogging": Hidden(_cogging, 3e-4, True),
    "mass": Hidden(_parameter("mass", MASS), 0.03, True, 0.9),
    "inertia": Hidden(_parameter("inertia", INERTIA), 0.03, True, 0.9),
    "actuator_gain": Hidden(lambda s: known.ActuatorGain("voltage", s), 0.03, True, 0.9),
    "actuator_bias": Hidden(lambda s: known.ActuatorBias("voltage", s), 0.05, True),
    "dead_zone": Hidden(lambda s: known.DeadZone("voltage", s), 0.05),
    "saturation": Hidden(lambda s: known.Saturation("voltage", LIMIT * (1 - s)), 0.1, most=0.95),
    "delay": Hidden(lambda s: known.Delay("voltage", s), 6e-3),
    "actuator_lag": Hidden(lambda s: known.ActuatorLag("voltage", s), 7e-3),
    "backlash": Hidden(lambda s: known.Backlash("pivot", s), 0.05, most=0.6),
    "sensor_offset": Hidden(lambda s: known.SensorOffset("angle", s), 0.04, True),
    "sensor_scale": Hidden(lambda s: known.SensorScale("angle", s), 0.01, True, 0.5),
}


def truth(strengths: Mapping[str, float]) -> Truth:
    """The true pendulum with these effects at these strengths, those of ``HIDDEN`` where known."""
    values: dict[str, Any] = dict(strengths)
    if "saturation" in values:
        values["saturation"] = LIMIT * (1 - values["saturation"])
    return Truth(**values)


@functools.cache
def _reference(excitation: Excitation, noise: str) -> tuple[SmoothFitter, Fit, int]:
    """Windows of a pendulum that lacks nothing, around its true path; their fit and freedom."""
    simulator = PendulumEquation()
    rng = np.random.default_rng(0)
    path, volts = simulate(Truth(), rng, excitation, runs=4, steps=250)
    kind = NOISES[noise]
    seen = measure(Truth(), path, kind, rng)
    times = DT * np.arange(path.shape[1], dtype=float)
    runs = [Trajectory(str(i), times, seen[i], volts[i][:, None]) for i in range(len(path))]
    samples = Samples.join(runs, simulator.substeps)
    nodes = path.reshape(-1, 2)
    angle = max(kind.angle, kind.step / math.sqrt(12))
    sigma = np.array([angle] if kind.rate is None else [angle, kind.rate])
    scale = np.array([1.0, 10.0])
    model, none = Model(simulator), np.zeros(0)
    slope = slopes(model, samples, nodes, none, scale)
    windows = cut(samples, slope.by_state, scale, 25 * DT)
    grouped = blocks(samples, windows, np.zeros(len(samples)), len(windows))
    fitter = SmoothFitter(samples, grouped, nodes, slope.by_state, sigma, scale, turns=2)
    freedom = int(windows.inside.sum()) * len(sigma) - 2 * len(windows)
    return fitter, fitter.fit(model, none), freedom


def sizes(name: str, strengths: Array, excitation: Excitation, noise: str) -> Array:
    """Size of the gap that an effect makes at each of some strengths, by its signature.

    Strengths are as ``strength`` gives them.
    """
    fitter, fit, freedom = _reference(excitation, noise)
    hidden = HIDDEN[name]
    simulator = fit.model.simulator
    bound = [hidden.effect(_from_reach(name, float(s), excitation)) for s in strengths]
    pool = candidates(simulator, [bound[0]], fitter.samples)
    order = Truth.cogging_order if name == "cogging" else None
    (candidate,) = [c for c in pool if order in (None, getattr(c.effect, "order", None))]
    names = [knob.field for knob in candidate.knobs]
    trials = tuple(
        Trial(np.array([[getattr(effect, n) for n in names]]), np.array([True])) for effect in bound
    )
    tried = dataclasses.replace(candidate, trials=trials)
    columns = fitter.columns(fit, [tried])
    found = signatures(fit, trial_variants([tried]), columns)
    return np.sqrt(1 + found.strengths / freedom)


def _from_reach(name: str, strength: float, excitation: Excitation) -> float:
    """A saturation cuts a share of the largest input there is, which a weak excitation lowers."""
    if name != "saturation":
        return strength
    return 1 - REACH[excitation] * (1 - strength) / LIMIT


def draw(
    name: str, size: float, excitation: Excitation, noise: str, rng: np.random.Generator
) -> float:
    """A strength near the one that makes a gap of ``size``, with a random sign if it may have one.

    Raises:
        ValueError: No sensible strength makes such a gap.
    """
    hidden = HIDDEN[name]
    usual = strength(name, size, excitation, noise)
    sign = rng.choice([-1.0, 1.0]) if hidden.two_signed else 1.0
    found = float(sign * min(usual * rng.uniform(0.85, 1.2), hidden.most))
    return _from_reach(name, found, excitation)


@functools.cache
def strength(name: str, size: float, excitation: Excitation, noise: str) -> float:
    """Strength (of ``HIDDEN``) at which an effect makes a gap of ``size`` times the noise.

    That of a saturation is the share that it cuts of the largest input under this excitation.

    Raises:
        ValueError: No sensible strength makes such a gap.
    """
    hidden = HIDDEN[name]
    centre = hidden.typical
    for factor in (10.0, 2.0, 1.1):
        grid = np.unique(np.minimum(centre * factor ** np.arange(-4.0, 5.0), hidden.most))
        got = sizes(name, grid, excitation, noise)
        # Between grid points the size above the noise grows as a power of the strength.
        above = np.log(np.maximum(got**2 - 1, 1e-12))
        rising = np.maximum.accumulate(above)
        wanted = math.log(size**2 - 1)
        if rising[-1] < wanted and grid[-1] >= hidden.most:
            raise ValueError(
                f"{name} makes a gap of at most {got.max():.3g} under {excitation} excitation and "
                f"noise {noise}, so {size:g} cannot be had"
            )
        centre = float(np.exp(np.interp(wanted, rising, np.log(grid))))
    return centre
