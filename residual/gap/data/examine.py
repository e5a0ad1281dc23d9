"""What the data say about themselves, before any physics: faults found, and logs refused.

Nothing is changed silently. Samples that no motion could have made are taken out (NaN) and listed;
everything else is said, and left as it is.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace

import numpy as np

from residual.gap.data.bound import bound
from residual.gap.data.bursts import without_bursts
from residual.gap.data.copies import once
from residual.gap.data.cut_inputs import cut_inputs
from residual.gap.data.inspection import (
    bounds,
    clipped,
    faults,
    faulty,
    measured,
    refusal,
    rounded,
    sampling,
    speeds,
    still,
    sums,
)
from residual.gap.data.kinematics import kinematics
from residual.gap.data.lost_rows import timed_halfway
from residual.gap.data.nominal import nominal
from residual.gap.data.onset import begun_late
from residual.gap.data.other_clock import any_other_clock
from residual.gap.data.repeats import without_repeats
from residual.gap.data.resets import cut_at_resets
from residual.gap.data.same_columns import same_columns
from residual.gap.data.sizes import other_zero, sizes
from residual.gap.data.sweeps import sweeps
from residual.gap.data.turns import wrapped, wrapped_inputs
from residual.gap.data.unanswered import unanswered
from residual.gap.data.wild_inputs import without_wild_inputs
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

# No log says much of a system of which it has one sample in so many control periods.
_SLOWEST = 100.0


@dataclass(frozen=True)
class Examined:
    """Measured runs after a look at them.

    Attributes:
        trajectories: The runs, faulty samples taken out.
        findings: What there is to know, the gravest first.
    """

    trajectories: tuple[Trajectory, ...]
    findings: tuple[Finding, ...]


def examine(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> Examined:
    """Look for faults in measured runs before they are compared with a simulator.

    Args:
        simulator: Gives the control period, the channels and their bounds.
        trajectories: Measured runs; what they hold of the memory of the simulator's own effects,
            which nothing measures, is left out.

    Returns:
        The runs without the samples that cannot be true, and all findings.

    Raises:
        ValueError: No answer could mean anything; the message says why and what to do.
    """
    refuse_columns(simulator, trajectories)
    physical = slice(len(simulator.physical_channels))
    trajectories = [replace(run, states=run.states[:, physical]) for run in trajectories]
    trajectories, copied = once(trajectories)
    trajectories, bursts = without_bursts(trajectories)
    trajectories, wild = without_wild_inputs(simulator, trajectories)
    trajectories, resets = cut_at_resets(simulator, trajectories)
    trajectories, repeats = without_repeats(simulator, trajectories)
    found = [*copied, *bursts, *wild, *resets, *repeats, *findings(simulator, trajectories)]
    for finding in found:
        if finding.severity == "refuse":
            raise ValueError(f"{finding.where}: {finding.says}" if finding.where else finding.says)
    useless = {finding.where for finding in found if finding.kind in ("still", "derived")}
    runs = _without_faults(simulator, trajectories, useless)
    runs, scaled = kinematics(simulator, runs)
    runs, late = begun_late(simulator, runs)
    runs, untimed = timed_halfway(simulator, runs)
    return Examined(tuple(runs), (*found, *scaled, *late, *untimed))


def refuse_columns(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> None:
    """Refuse runs whose columns are not the simulator's channels.

    Raises:
        ValueError: The message names the run, and the channels that are expected.
    """
    expected = (
        ("states", simulator.state_channels, len(simulator.physical_channels)),
        ("actions", simulator.action_channels, len(simulator.action_channels)),
    )
    for run in trajectories:
        for what, channels, least in expected:
            columns = getattr(run, what).shape[1]
            if not least <= columns <= len(channels):
                names = ", ".join(channel.name for channel in channels) or "none"
                raise ValueError(
                    f"{run.name}: {what} has {columns} columns, expected {least}: {names} (NaN in "
                    "the column of what was not measured)"
                )


def findings(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Everything that is wrong or remarkable about measured runs, the gravest first."""
    if not trajectories:
        return [refusal("empty", "", "there are no trajectories: give at least one measured run")]
    found = _refusals(simulator, trajectories)
    if not found:
        checks = (same_columns, sampling, bounds, bound, speeds, sizes, other_zero, wrapped,
                  wrapped_inputs, still, faults, clipped, cut_inputs, rounded, sums, sweeps,
                  nominal, unanswered)  # fmt: skip
        found = [one for check in checks for one in check(simulator, trajectories)]
    ranks = {"refuse": 0, "warning": 1, "note": 2}
    return sorted(found, key=lambda one: ranks[one.severity])


def _refusals(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Logs from which nothing can be found."""
    for run in trajectories:
        if not len(run.actions):
            return [refusal("empty", run.name, "has no steps: give runs of several samples")]
    logged = [channel.name for channel, _ in measured(simulator, trajectories)]
    if not logged:
        says = "no state channel was measured: every value in the trajectories is NaN"
        return [refusal("unmeasured", "", says)]
    for run in trajectories:
        if run.durations.min() > _SLOWEST * simulator.dt:
            period = float(np.median(run.durations))
            otherwise = any_other_clock(period / simulator.dt)
            says = (
                f"a sample every {period:.4g} s, {period / simulator.dt:.0f} control periods of "
                f"{simulator.name}: {otherwise}"
            )
            return [refusal("sampling", run.name, says)]
    if simulator.has_contacts:
        for channel in simulator.physical_channels:
            if channel.kind != "rate" and channel.name not in logged:
                says = (
                    f"the channel {channel.name!r} was not logged; of a system that strikes the "
                    f"ground, as {simulator.name} does, every position is needed"
                )
                return [refusal("unmeasured", trajectories[0].name, says)]
    return []


def _without_faults(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], useless: Container[str]
) -> list[Trajectory]:
    """The runs with faulty samples, and channels that tell nothing, as NaN."""
    states = [np.array(run.states, float) for run in trajectories]
    names = [channel.name for channel in simulator.physical_channels]
    changed = False
    for channel, masks in faulty(simulator, trajectories):
        column = names.index(channel.name)
        for own, *marks in zip(states, *masks.values(), strict=True):
            gone = np.any(marks, axis=0) | (channel.name in useless)
            own[gone, column] = np.nan
            changed = changed or bool(gone.any())
    if not changed:
        return list(trajectories)
    return [replace(run, states=own) for run, own in zip(trajectories, states, strict=True)]
