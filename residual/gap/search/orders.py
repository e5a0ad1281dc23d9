"""Orders beyond those that are always looked for, of what repeats along a turn.

A motor of 14 poles pulls at its 14th, one behind a gear at the poles' times the ratio. How what a
simulator misses from one reading to the next goes with the angle tells which of them a log shows.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.model import paths
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.joint import Cogging
from sims.host import HostSimulator
from sims.simulator import Joint

Array = NDArray[np.float64]

#: Highest order, readings in a period of it at the usual speed, and orders of a joint at most.
HIGHEST, READINGS, MOST = 200, 4.0, 2
#: Half the squared size of an order in standard errors, from which on it shows.
SHOWS = 20.0
#: Readings that are looked at, at least and at the most.
FEW, MANY = 400, 20_000


def higher_orders(
    simulator: HostSimulator, runs: Sequence[Trajectory], effects: Iterable[Effect]
) -> tuple[Cogging, ...]:
    """Cogging of the orders that show, for every one that may be missing.

    Args:
        simulator: The nominal simulator, of what has no impacts.
        runs: What was recorded.
        effects: That may be missing.
    """
    turning = {one.joint: one for one in effects if isinstance(one, Cogging)}
    if not turning:
        return ()
    missed = functools.cache(lambda: _missed(simulator, Samples.join(runs, simulator.substeps)))
    return tuple(
        turning[joint.name].with_values(order=float(order))
        for joint in simulator.joints
        if joint.name in turning and joint.rate not in (None, joint.position)
        for order in _orders(simulator, joint, *missed())
    )


def of_order(
    simulator: HostSimulator, effects: Sequence[Cogging], samples: Samples
) -> list[Candidate]:
    """Candidates of cogging of the very orders that are given."""
    found = []
    for effect in effects:
        for known in candidates(simulator, [effect], samples)[:1]:
            found.append(dataclasses.replace(known, effect=effect))
    return found


def kept_orders(earlier: Iterable[Candidate], there: Iterable[Candidate]) -> list[Candidate]:
    """Cogging of an earlier search that is not there."""
    orders = {one.effect for one in there}
    return [one for one in earlier if isinstance(one.effect, Cogging) and one.effect not in orders]


def _missed(simulator: HostSimulator, samples: Samples) -> tuple[Array, Array, Array]:
    """Where the simulator was begun, (n, n_s), with what input, (n, n_a), and by how much it missed
    the next row, (n, n_s)."""
    rows = np.concatenate([np.arange(start, stop - 1) for start, stop in samples.runs])[:MANY]
    begun, missed = paths.misses(Model(simulator), samples, np.zeros(0), rows)
    good = np.isfinite(missed).all(axis=1)
    return begun[good], samples.actions[rows[good]], missed[good]


def _orders(
    simulator: HostSimulator, joint: Joint, nodes: Array, inputs: Array, missed: Array
) -> list[int]:
    """The orders of a joint that show, beside what goes with its speed and the inputs."""
    names = [channel.name for channel in simulator.physical_channels]
    place, rate = names.index(joint.position), names.index(str(joint.rate))
    turn = simulator.physical_channels[place].turn
    if turn is None or len(nodes) < FEW:
        return []
    angle, speed = 2 * np.pi * nodes[:, place] / turn, nodes[:, rate]
    step = np.abs(np.diff(angle))
    usual = float(np.median(step[step > 0])) if (step > 0).any() else np.pi
    usually = max(map(int, Cogging(joint.name).quantities(simulator)["order"].starts))
    orders = np.arange(usually + 1, min(HIGHEST, int(2 * np.pi / (READINGS * usual))) + 1)
    slow = [wave(n * angle) for n in range(1, usually + 1) for wave in (np.sin, np.cos)]
    basis = np.stack([np.ones_like(speed), speed, np.sign(speed), *slow, *inputs.T], axis=1)
    left = missed[:, rate] - basis @ np.linalg.lstsq(basis, missed[:, rate], rcond=1e-10)[0]
    size = float(left @ left)
    if not size > 0:
        return []
    power = {int(n): abs(left @ np.exp(1j * n * angle)) ** 2 / size for n in orders}
    showing = [n for n, height in power.items() if height > SHOWS]
    return sorted(showing, key=lambda n: -power[n])[:MOST]
