"""MuJoCo's own system identification on the same logs, beside find_gap."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import io
import logging
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from scipy.signal import savgol_filter

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.mujoco import MujocoSimulator
from sims.mujoco.attributes import Attribute
from sims.simulator import Array
from studies.robots.cases import NAMES, nominal
from studies.robots.drives import measure

#: Length of the sequences that ``sysid`` compares, in s; their start states are not fitted.
SEQUENCE = 1.0


@dataclasses.dataclass(frozen=True)
class Fitted:
    """What ``mujoco.sysid`` found.

    Attributes:
        values: By attribute: value, half of its 95 % interval, nominal value.
        seconds: Processor time.
    """

    values: dict[str, tuple[float, float, float]]
    seconds: float

    @property
    def significant(self) -> list[str]:
        """Attributes whose interval excludes the nominal value, clearest first."""
        found = {
            name: abs(value - nominal) / half
            for name, (value, half, nominal) in self.values.items()
            if 0 < half < abs(value - nominal)
        }
        return sorted(found, key=lambda name: -found[name])


def identify(simulator: MujocoSimulator, logs: Sequence[Trajectory]) -> Fitted:
    """Fit all attributes of a model at once, as ``mujoco.sysid`` does when all are listed.

    Args:
        simulator: The nominal, of hinge and slide joints.
        logs: Records of evenly spaced samples; start rates come from a Savitzky-Golay filter.

    Raises:
        ImportError: The extra ``mujoco[sysid]`` is not installed.
    """
    sysid = importlib.import_module("mujoco.sysid")
    if not hasattr(sysid, "optimize"):
        raise ImportError("mujoco.sysid lacks what it needs")
    begin = time.process_time()
    known = {
        name: a
        for name, a in simulator.attributes.items()
        if a.offered
        and not any(slot.scaled and len(a.slots) > 6 for slot in a.slots)
        and not name.startswith(("gain of all", "damping of all", "gain of", "gravity"))
    }
    spec = mujoco.MjSpec.from_file(str(simulator.source.path))
    model = spec.compile()
    _explicit(spec, model)
    parameters = sysid.ParameterDict()
    for name, attribute in known.items():
        nominal = float(attribute.parameter.value)
        reach = 3.0 * attribute.parameter.scale
        low = max(attribute.parameter.low, nominal - reach)
        parameters.add(
            sysid.Parameter(
                name, nominal, low, nominal + reach, modifier=_modifier(attribute, model)
            )
        )
    logging.getLogger("absl").setLevel(logging.ERROR)
    sequences = _sequences(sysid, simulator, model, spec, logs)
    residual = sysid.build_residual_fn(models_sequences=[sequences], n_threads=_threads())
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(parameters, residual, optimizer="mujoco", verbose=False)
    left, _, _ = residual(result.x, found)
    _, half = sysid.calculate_intervals(left, result.jac)
    values = {
        name: (float(found[name].value[0]), float(h), float(known[name].parameter.value))
        for name, h in zip(known, half, strict=True)
    }
    return Fitted(values, time.process_time() - begin)


def _threads() -> int:
    return int(os.environ.get("OMP_NUM_THREADS", "1"))


def _explicit(spec: Any, model: Any) -> None:
    """Inertias as numbers, so that they can be changed."""
    for body in spec.bodies[1:]:
        b = body.id
        body.explicitinertial = True
        body.mass, body.inertia = model.body_mass[b], model.body_inertia[b]
        body.ipos, body.iquat = model.body_ipos[b], model.body_iquat[b]
        body.fullinertia[:] = np.nan


def _modifier(attribute: Attribute, model: Any) -> Any:
    """How a value gets into a ``MjSpec``."""
    slot = attribute.slots[0]
    index = slot.index[0]

    def change(spec: Any, parameter: Any) -> None:
        value = float(parameter.value[0])
        if slot.field.startswith("dof_"):
            joint = spec.joints[int(model.dof_jntid[index])]
            if slot.field == "dof_damping":
                joint.damping[0] = value
            elif slot.field == "dof_dampingpoly":
                joint.damping[1] = value
            else:
                setattr(joint, slot.field.removeprefix("dof_"), value)
        elif slot.field == "body_mass":
            body = spec.bodies[index]
            body.inertia = model.body_inertia[index] * value / model.body_mass[index]
            body.mass = value
        elif slot.field == "body_ipos":
            spec.bodies[index].ipos[slot.index[1]] = value
        else:
            raise ValueError(f"{attribute.name} is not given to sysid")

    return change


def _sequences(
    sysid: Any, simulator: MujocoSimulator, model: Any, spec: Any, logs: Sequence[Trajectory]
) -> Any:
    names, starts, controls, measured = [], [], [], []
    joints = [joint.name for joint in simulator.joints]
    nq = simulator.model.nq
    signals = {f"{name}_qpos": (sysid.SignalType.MjStateQPos, [k]) for k, name in enumerate(joints)}
    for log in logs:
        period, q = float(np.median(log.durations)), log.states[:, :nq]
        steps = round(SEQUENCE / period)
        fine = round(period / simulator.timestep)
        smooth, rates = _smoothed(q, period)
        for a in range(0, len(log.actions) - steps, steps):
            starts.append(sysid.create_initial_state(model, smooth[a], rates[a]))
            held = np.repeat(log.actions[a : a + steps], fine, axis=0)
            times = simulator.timestep * np.arange(len(held))
            controls.append(sysid.TimeSeries.from_control_names(times, held, model))
            seen = slice(a, a + steps)
            at = period * np.arange(steps)
            measured.append(sysid.TimeSeries.create(at, q[seen], signals))
            names.append(f"{log.name}-{a}")
    return sysid.ModelSequences(
        "robot", spec, names, starts, controls, measured, allow_missing_sensors=True
    )


def _smoothed(q: Array, period: float) -> tuple[Array, Array]:
    """Positions and rates at every sample, from a cubic through nine; both (n, nq)."""
    return savgol_filter(q, 9, 3, axis=0), savgol_filter(q, 9, 3, deriv=1, delta=period, axis=0)


def forecast_error(
    simulator: HostSimulator,
    logs: Sequence[Trajectory],
    values: Mapping[str, float] | None = None,
) -> float:
    """Root mean square error of positions over forecasts of 0.3 s from smoothed starts."""
    changed = simulator.with_parameters(**values) if values else simulator
    nq = len([c for c in simulator.physical_channels if c.kind == "position"])
    errors: list[Array] = []
    for log in logs:
        period, q = float(np.median(log.durations)), log.states[:, :nq]
        steps = round(0.3 / period)
        smooth, rates = _smoothed(q, period)
        begins = np.arange(4, len(log.actions) - steps, steps)
        start = np.concatenate([smooth[begins], rates[begins]], axis=1)
        held = np.stack([log.actions[a : a + steps] for a in begins])
        path = changed.rollout(changed.augment(start, held[:, 0]), held)[:, 1:, :nq]
        seen = np.stack([q[a + 1 : a + steps + 1] for a in begins])
        errors.append((path - seen).ravel())
    return float(np.sqrt(np.mean(np.square(np.concatenate(errors)))))


#: What is hidden in the arm of two joints; the last record of each is held out.
HIDDEN: tuple[dict[str, float], ...] = (
    {"frictionloss of joint elbow": 0.06},
    {"mass of body fore": 0.1},
    {"frictionloss of joint elbow": 0.06, "mass of body fore": 0.1},
    {},
)


Interval = tuple[float, float, float]


def compare(robot: str, hidden: Mapping[str, float], minutes: float) -> Iterator[dict[str, Any]]:
    """find_gap, and then ``mujoco.sysid``, on the same logs.

    Args:
        robot: A shipped model with hinges and motors.
        hidden: See ``studies.robots.truth.Truth``.
        minutes: Budget of find_gap.

    Yields:
        ``who``; ``named``, hidden names that it named, with value and interval; ``false``, other
        names; ``error``, root mean square of positions over 0.3 s on the held-out record in mrad,
        and ``nominal``, the nominal's; ``seconds`` of processor time.
    """
    *logs, held = measure(robot, dict(hidden))
    simulator = nominal(robot)
    before = 1e3 * forecast_error(simulator, [held])

    def side(who: str, names: Mapping[str, Interval], error: float, spent: float) -> dict[str, Any]:
        right = [f"{name} {_number(names[name])}" for name in hidden if name in names]
        false = [name for name in names if name not in hidden]
        return {
            "who": who,
            "named": "; ".join(right) or "-",
            "false": f"{len(false)}: {', '.join(false)}" if false else "none",
            "error": 1e3 * error,
            "nominal": before,
            "seconds": spent,
        }

    begin = time.process_time()
    result = find_gap(simulator, logs, minutes=minutes)
    seconds = time.process_time() - begin
    named = {}
    for verdict in result.verdicts:
        if verdict.effect and verdict.kind in NAMES:
            number = next(iter(verdict.parameters.values()))
            named[verdict.effect] = (number.value, number.low, number.high)
    yield side("find_gap", named, forecast_error(result.corrected, [held]), seconds)
    fitted = identify(simulator, logs)
    changes = {}
    for name in fitted.significant:
        value, half, usual = fitted.values[name]
        changes[name] = (value - usual, value - usual - half, value - usual + half)
    values = {name: value for name, (value, _, _) in fitted.values.items()}
    error = forecast_error(simulator, [held], values)
    yield side("mujoco.sysid", changes, error, fitted.seconds)


def rivals(minutes: float = 1.0) -> list[dict[str, Any]]:
    """Both on the arm with two joints: what is ``hidden``, and what ``compare`` yields."""
    rows = []
    for hidden in HIDDEN:
        words = " + ".join(f"{name} {size:+g}" for name, size in hidden.items()) or "nothing"
        print(f"arm2: {words}", file=sys.stderr, flush=True)
        rows += [{"hidden": words} | side for side in compare("arm2", hidden, minutes)]
    return rows


def _number(value: Interval) -> str:
    return f"{value[0]:+.4g} ({value[1]:.4g} to {value[2]:.4g})"
