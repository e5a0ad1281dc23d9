"""One set of the dirty world: logs to explain, logs held out, the nominal simulator, the answer."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from residual.trajectories import Trajectory
from sims.host import HostSimulator
from studies.hidden.dirty.measure import Layout, Sensors, records
from studies.hidden.dirty.systems import nominal
from studies.hidden.dirty.truth import INPUTS, PARAMETERS, Truth
from studies.judging.forecasts import plan, relative_error

#: What can be hidden, with a middling strength: ``effect@where``, or a parameter.
HIDDEN: Mapping[str, Mapping[str, float]] = {
    "arm": {
        "viscous_friction@shoulder": 0.15, "coulomb_friction@shoulder": 0.3,
        "quadratic_drag@shoulder": 0.08, "linear_spring@shoulder": 1.0,
        "constant_load@shoulder": 0.4, "mass": 0.15, "actuator_gain@torque": -0.15,
        "delay@torque": 0.04, "actuator_lag@torque": 0.05, "dead_zone@torque": 0.3,
        "sensor_offset@shoulder": 0.1,
    },
    "two-link arm": {
        "viscous_friction@shoulder": 0.15, "viscous_friction@elbow": 0.06,
        "coulomb_friction@shoulder": 0.3, "coulomb_friction@elbow": 0.12,
        "constant_load@shoulder": 0.4, "lower_mass": 0.1,
        "actuator_gain@shoulder torque": -0.15, "delay@shoulder torque": 0.04,
    },
    "cart": {
        "viscous_friction@cart": 0.4, "viscous_friction@hinge": 0.01,
        "coulomb_friction@cart": 0.5, "constant_load@cart": 0.6, "cart_mass": 0.2,
        "actuator_gain@push": -0.15, "actuator_lag@push": 0.06, "delay@push": 0.05,
    },
    "oven": {
        "delay@power": 1.5, "actuator_lag@power": 2.0, "actuator_gain@power": -0.1,
        "time_constant": 2.0, "constant_load@temperature": 0.2,
    },
}  # fmt: skip
#: Seconds of a forecast that the user cares about, and of all runs to explain.
HORIZON = {"arm": 0.6, "two-link arm": 0.5, "cart": 0.8, "oven": 12.0}
SECONDS = {"arm": 36.0, "two-link arm": 30.0, "cart": 40.0, "oven": 400.0}
#: Lead-in over which the start of a forecast is fitted, as a share of the horizon.
LEAD = 0.3
#: Samples per second that systems are logged with.
RATES = {
    "arm": (25.0, 50.0, 100.0, 500.0),
    "two-link arm": (50.0, 100.0, 200.0),
    "cart": (25.0, 50.0, 100.0),
    "oven": (2.0, 10.0),
}
#: Most samples to explain: a fast log is a short one.
_MOST = 6000


@dataclasses.dataclass(frozen=True)
class Dirty:
    """One set.

    Attributes:
        logs: What find_gap sees.
        held: Runs that nobody has seen.
        simulator: The nominal one.
        label: The hidden effect, ``name@where`` or a parameter; empty for none.
        truth: The true system.
        sensors: How it was measured.
        horizon: In s.
    """

    logs: list[Trajectory]
    held: list[Trajectory]
    simulator: HostSimulator
    label: str
    truth: Truth
    sensors: Sensors
    horizon: float


def make_set(config: Mapping[str, Any]) -> Dirty:
    """The set that a configuration names; the same one every time.

    Args:
        config: ``system``, ``hidden`` (a label, or empty), ``size`` (error of the nominal
            simulator's forecasts over that with the dirt alone, about), ``layout`` and ``seed``.
    """
    system, seed = config["system"], int(config["seed"])
    rng = np.random.default_rng([seed, 1])
    rate = float(rng.choice(RATES[system]))
    period = 1 / rate
    seconds = min(SECONDS[system], _MOST * period)
    plain, sensors = _dirt(system, period, rng)
    name, _, where = str(config["hidden"]).partition("@")
    if where in INPUTS[system]:
        # Measured behind the actuator, the log would hold its consequence already.
        sensors = dataclasses.replace(sensors, input_noise=None)
    simulator = nominal(system, period, sensors.input_noise is not None, sensors.summed)
    layout: Layout = config["layout"]
    truth = plain
    if name:
        sign = rng.choice([-1.0, 1.0]) if name in ("constant_load", "sensor_offset") else 1.0
        usual = sign * HIDDEN[system][config["hidden"]]
        truth = dataclasses.replace(plain, effect=name, where=where, strength=usual)
        truth = _sized(plain, truth, sensors, simulator, config)
    logs = records(truth, sensors, layout, period, seconds, (seed, 2))
    held = records(truth, sensors, layout, period, 0.5 * seconds, (seed, 3))
    return Dirty(logs, held, simulator, str(config["hidden"]), truth, sensors, HORIZON[system])


def _dirt(system: str, period: float, rng: np.random.Generator) -> tuple[Truth, Sensors]:
    """What no library holds, and how it is measured."""
    off = {
        name: float(rng.choice([-1, 1]) * rng.uniform(0.01, 0.03)) for name in PARAMETERS[system]
    }
    if "ambient" in off:
        off["ambient"] = float(rng.uniform(-1, 1)) * 0.001
    thermal = system == "oven"
    maybe = [bool(rng.random() < share) for share in (0.5, 0.5, 0.4, 0.4, 0.4, 0.3, 0.25, 0.3)]
    truth = Truth(
        system, off,
        soft=float(rng.uniform(0.005, 0.05)),
        presliding=float(rng.uniform(1e-3, 5e-3)) if maybe[0] else 0.0,
        flexible=float(rng.uniform(0.01, 0.03)) if maybe[1] else 0.0,
        resonance=float(rng.uniform(5, 10)),
        filtered=float(rng.uniform(0.2, 1.0)) * min(period, 0.02) * (maybe[2] and not thermal),
    )  # fmt: skip
    sensors = Sensors(
        noise=float(rng.uniform(0.004, 0.015)) * (0.3 if thermal else 1.0),
        coloured=float(rng.uniform(0.3, 0.9)),
        rounded=float(rng.uniform(0.001, 0.004)) if maybe[3] else 0.0,
        rates=bool(rng.random() < 0.6),
        jitter=0.05 if maybe[4] else 0.0,
        dropped=0.01 if maybe[5] else 0.0,
        summed=maybe[6] and not thermal,
        input_noise=0.01 if maybe[7] else None,
    )
    if sensors.summed:
        sensors = dataclasses.replace(sensors, rates=True)
    return truth, sensors


def _sized(
    plain: Truth,
    truth: Truth,
    sensors: Sensors,
    simulator: HostSimulator,
    config: Mapping[str, Any],
) -> Truth:
    """So strong that the nominal's forecasts are ``size`` times as bad as with the dirt alone."""
    seconds = min(0.5 * SECONDS[plain.system], 2000 * simulator.dt)

    def error(truth: Truth) -> float:
        seed = (int(config["seed"]), 4)
        runs = records(truth, sensors, "ramp", simulator.dt, seconds, seed)
        horizon = HORIZON[plain.system]
        groups = plan(simulator, runs, horizon, LEAD * horizon, most=40)
        return relative_error(simulator, groups)

    floor, wanted = error(plain), float(config["size"])
    most = _most(plain, truth.effect, truth.strength)
    for _ in range(3):
        excess = max(error(truth) ** 2 - floor**2, (0.05 * floor) ** 2) ** 0.5
        factor = floor * (wanted**2 - 1) ** 0.5 / excess
        strength = truth.strength * float(np.clip(factor, 0.25, 4.0))
        truth = dataclasses.replace(truth, strength=float(np.clip(strength, -most, most)))
    return truth


def _most(plain: Truth, name: str, usual: float) -> float:
    """Largest size that still makes sense."""
    if name == "actuator_gain":
        return 0.6
    if name in PARAMETERS[plain.system]:
        return 0.8 * PARAMETERS[plain.system][name]
    return 6 * abs(usual)
