"""Changes of a log that say nothing new about the system, and must not change the answer."""

from __future__ import annotations

import copy
import csv
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from logs import Log

from residual.logs import Column, LogFormat, read_logs
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.host import HostSimulator
from sims.simulator import Channel, Joint

#: What a user may log instead of SI.
OTHERS = MappingProxyType(
    {"rad": "deg", "rad/s": "rpm", "m": "mm", "m/s": "km/h", "V": "mV", "N m": "N mm", "K": "degC"}
)


def another_order(log: Log) -> Log:
    """The files in another order."""
    order = np.random.default_rng(1).permutation(len(log.runs))
    if (order == np.arange(len(order))).all():
        order = order[::-1]
    return dataclasses.replace(log, runs=tuple(log.runs[i] for i in order))


def halves(run: Trajectory) -> list[Trajectory]:
    """A run cut in the middle; the sample at the cut ends one half and begins the other."""
    k = len(run) // 2
    return [
        Trajectory(f"{run.name} a", run.times[: k + 1], run.states[: k + 1], run.actions[:k]),
        Trajectory(f"{run.name} b", run.times[k:], run.states[k:], run.actions[k:]),
    ]


def cut_in_two(log: Log) -> Log:
    """Each record cut in two."""
    return dataclasses.replace(log, runs=tuple(part for run in log.runs for part in halves(run)))


def shifted_in_time(log: Log) -> Log:
    """Clocks that began at other times."""
    shifts = np.random.default_rng(2).uniform(-50, 5000, len(log.runs))
    runs = [
        dataclasses.replace(run, times=run.times + shift)
        for run, shift in zip(log.runs, shifts, strict=True)
    ]
    return dataclasses.replace(log, runs=tuple(runs))


def every_second_row(log: Log) -> Log:
    """Half of the rows dropped."""
    runs = []
    for run in log.runs:
        count = len(run) // 2
        rows = 2 * np.arange(count + 1)
        runs.append(Trajectory(run.name, run.times[rows], run.states[rows], run.actions[rows[:-1]]))
    return dataclasses.replace(log, runs=tuple(runs))


def copied(log: Log) -> Log:
    """A second copy of every file."""
    again = [dataclasses.replace(run, name=f"copy of {run.name}") for run in log.runs]
    return dataclasses.replace(log, runs=(*log.runs, *again))


def other_units(log: Log, folder: Path) -> Log:
    """Written to files in other units, signs turned, beside a column that means nothing."""
    rng = np.random.default_rng(3)
    states, actions = log.simulator.physical_channels, log.simulator.action_channels
    measured = [np.isfinite(run.states).any(axis=0) for run in log.runs]
    layout = LogFormat(
        time=Column("clock", "ms"),
        states={
            channel.name: _column(channel)
            for i, channel in enumerate(states)
            if any(there[i] for there in measured)
        },
        actions={channel.name: _column(channel) for channel in actions},
        gap=1e9,
    )
    files = []
    for number, run in enumerate(log.runs):
        files.append(folder / f"{number}.csv")
        with files[-1].open("w", newline="") as file:
            writer = csv.writer(file)
            used = list(layout.states)
            writer.writerow(["clock", *used, *layout.actions, "humidity"])
            held = np.vstack([run.actions, run.actions[-1:]])
            for time, state, action in zip(run.times, run.states, held, strict=True):
                row = [_written(c, v) for c, v in zip(states, state, strict=True) if c.name in used]
                row += [_written(c, v) for c, v in zip(actions, action, strict=True)]
                writer.writerow([repr(float(1000 * time)), *row, repr(float(rng.normal()))])
    data = read_logs(files, states, actions, layout)
    return dataclasses.replace(log, runs=tuple(data.trajectories))


def _column(channel: Channel) -> Column:
    return Column(channel.name, OTHERS.get(channel.unit, ""), -1.0)


def _written(channel: Channel, value: float) -> str:
    if np.isnan(value):
        return ""
    from residual.logs.units import find_unit

    unit = find_unit(OTHERS.get(channel.unit, ""), channel.unit)
    return repr(float((-value - unit.offset) / unit.factor))


def idle_input(log: Log) -> Log:
    """An input that moves nothing and is logged as noise."""
    own = len(log.simulator.action_channels)

    class Idle(type(log.simulator)):  # type: ignore[misc]
        def acceleration(self, q, v, u, force, p):
            return super().acceleration(q, v, u[:, :own], force, p)

        def drive_force(self, q, v, u, p):
            return super().drive_force(q, v, u[:, :own], p)

        def derivative(self, x, u, p):
            return super().derivative(x, u[:, :own], p)

    simulator = _remade(log.simulator, Idle)
    simulator.action_channels += (Channel("idle", "V", "input"),)
    rng = np.random.default_rng(4)
    runs = [
        dataclasses.replace(run, actions=np.hstack([run.actions, rng.normal(size=(len(run), 1))]))
        for run in log.runs
    ]
    return Log(simulator, tuple(runs))


def idle_joint(log: Log, noise: float) -> Log:
    """A joint (or a state) that nothing moves, logged as a constant or as noise about it."""
    simulator = log.simulator
    mechanical = isinstance(simulator, EquationOfMotion)
    own = len(simulator.joints)

    class Idle(type(simulator)):  # type: ignore[misc]
        def acceleration(self, q, v, u, force, p):
            inner = super().acceleration(q[:, :own], v[:, :own], u, force[:, :own], p)
            return np.hstack([inner, force[:, own:]])

        def drive_force(self, q, v, u, p):
            inner = super().drive_force(q[:, :own], v[:, :own], u, p)
            return np.hstack([inner, 0 * q[:, own:]])

        def derivative(self, x, u, p):
            return np.hstack([super().derivative(x[:, :own], u, p), 0 * x[:, own:]])

    changed = _remade(simulator, Idle)
    if mechanical:
        extra = [
            Channel("idle", "m", "position"),
            Channel("idle rate", "m/s", "rate", rate_of="idle"),
        ]
        changed.joints += (Joint("idle", "idle", "idle rate", "N", 1.0, driven=False),)
    else:
        extra = [Channel("idle", "K", "other")]
        changed.joints += (Joint("idle", "idle", None, "K/s", 1.0),)
    changed.state_channels += tuple(extra)
    if mechanical:
        names = [channel.name for channel in changed.state_channels]
        changed._positions = [names.index(joint.position) for joint in changed.joints]
        changed._rates = [names.index(joint.rate) for joint in changed.joints]
    rng = np.random.default_rng(5)
    runs = []
    for run in log.runs:
        seen = np.full((len(run) + 1, len(extra)), np.nan)
        seen[:, 0] = 0.7 + noise * rng.standard_normal(len(run) + 1)
        runs.append(dataclasses.replace(run, states=np.hstack([run.states, seen])))
    return Log(changed, tuple(runs))


def _remade(simulator: HostSimulator, kind: type) -> HostSimulator:
    changed = copy.copy(simulator)
    changed.__class__ = kind
    return changed


#: By name; those that only touch what ``find_gap`` is given.
CHANGES: dict[str, Callable[[Log], Log]] = {
    "order": another_order,
    "cut": cut_in_two,
    "time": shifted_in_time,
    "half": every_second_row,
    "copy": copied,
    "idle input": idle_input,
    "idle constant": lambda log: idle_joint(log, 0.0),
    "idle noise": lambda log: idle_joint(log, 0.01),
}


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Records that follow each other, as one."""
    first, second = parts
    return Trajectory(
        first.name, np.concatenate([first.times, second.times[1:]]),
        np.vstack([first.states, second.states[1:]]), np.vstack([first.actions, second.actions]),
    )  # fmt: skip
