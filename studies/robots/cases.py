"""What is hidden in a robot, how strongly, and whether the answer is right."""

from __future__ import annotations

import dataclasses
import time
import zlib
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects.aliases import exact_twins
from sims.mujoco import MujocoSimulator
from studies.robots.drives import MODELS, measure

#: Median deviation of positions over 0.3 s that a hidden effect causes, as a multiple of the noise.
SIZE, NOISE, AHEAD = 30.0, 5e-4, 0.3
#: Strength of what is hidden in a robot that strikes the ground, as a share of its usual size: past
#: an impact forecasts part for the least change, so that deviations say nothing of sizes.
SHARE = 0.15
#: Verdicts that name something.
NAMES = ("confirmed", "ambiguous", "minor")

Kind = Literal["none", "single", "pair"]


@dataclasses.dataclass(frozen=True)
class Case:
    """One set of logs.

    Attributes:
        robot: The shipped model.
        hidden: Names of what is hidden.
        seed: Of strengths, motion and noise.
    """

    robot: str
    hidden: tuple[str, ...]
    seed: int


def nominal(robot: str) -> MujocoSimulator:
    """A shipped model as a simulator."""
    return MujocoSimulator(str(MODELS / f"{robot}.xml"))


def cases(robot: str, kind: Kind, seeds: range) -> Iterator[Case]:
    """Cases of a kind: nothing, each effect of the library, or a friction and a payload."""
    names = [str(effect) for effect in nominal(robot).offered_effects()]
    for seed in seeds:
        if kind == "none":
            yield Case(robot, (), seed)
        elif kind == "single":
            yield from (Case(robot, (name,), seed) for name in names)
        else:
            rng = np.random.default_rng([7, seed])
            friction = rng.choice([name for name in names if name.startswith("frictionloss")])
            mass = rng.choice([name for name in names if name.startswith("mass")])
            yield Case(robot, (str(friction), str(mass)), seed)


def strengths(case: Case) -> dict[str, float]:
    """Sizes that make every hidden effect alone deviate by about ``SIZE`` times the noise.

    Where there are impacts, ``SHARE`` of its usual size instead, half of the ground's friction.
    """
    simulator = nominal(case.robot)
    logs = measure(case.robot, {}, seed=case.seed, runs=2, seconds=3.0)
    found = {}
    for name in case.hidden:
        (effect,) = [e for e in simulator.offered_effects() if str(e) == name]
        field = effect.strengths()[0]
        quantity = effect.quantities(simulator)[field]
        if not np.isfinite(quantity.nominal):
            column = [c.name for c in simulator.action_channels].index(effect.where)
            found[name] = 0.6 * max(float(np.abs(log.actions[:, column]).max()) for log in logs)
            continue
        rng = np.random.default_rng([zlib.crc32(name.encode()), case.seed])
        sign = 1.0 if quantity.low >= 0 else float(rng.choice([-1.0, 1.0]))
        if simulator.has_contacts:
            # Soles that hold do not show a little less friction.
            size = sign * SHARE * quantity.scale if quantity.bold is None else quantity.bold
            found[name] = float(max(size, 0.95 * quantity.low))
            continue
        low, high = 1e-4, 30.0
        for _ in range(12):
            middle = np.sqrt(low * high)
            size = max(sign * middle * quantity.scale, 0.95 * quantity.low)
            changed = simulator.with_effects([effect.with_values(**{field: size})])
            # A motion that cannot be computed, as of a link without mass, is not near either.
            if _deviation(simulator, changed, logs) <= SIZE * NOISE:
                low = middle
            else:
                high = middle
        found[name] = float(max(sign * low * quantity.scale, 0.95 * quantity.low))
    return found


def _deviation(
    simulator: MujocoSimulator, changed: MujocoSimulator, logs: list[Trajectory]
) -> float:
    """Median over windows of the largest deviation of a position."""
    steps = round(AHEAD / simulator.dt)
    nq, nv = simulator.model.nq, simulator.model.nv
    starts, actions = [], []
    for log in logs:
        for a in range(2, len(log.actions) - steps, steps):
            q = log.states[a, :nq]
            v = (log.states[a + 2, :nq] - log.states[a - 2, :nq]) / (4 * simulator.dt)
            starts.append(np.concatenate([q, v[:nv]]))
            actions.append(log.actions[a : a + steps])
    start, held = np.array(starts), np.array(actions)
    one = simulator.rollout(simulator.augment(start, held[:, 0]), held)[..., :nq]
    two = changed.rollout(changed.augment(start, held[:, 0]), held)[..., :nq]
    return float(np.median(np.abs(two - one).max(axis=(1, 2))))


def ask(case: Case) -> dict[str, Any]:
    """Measure the robot and let find_gap answer.

    Returns:
        Plain values: ``case``; ``sizes``, what was hidden; ``named``, the labels that it named,
        strongest first, with kind and numbers; ``right``, whether the names are those hidden, or
        cannot be told from them by any motion, or leave the form within its family undecided (of
        several hidden all are among the first as many names); ``by_family``, whether that rests on
        an undecided form; ``confirmed_wrong``, names confirmed that are neither; ``remainder``,
        whether it says that something is left; ``processor``, seconds of processor time.
    """
    sizes = strengths(case)
    runs = 8 if case.robot == "hopper" else 4
    logs = measure(case.robot, sizes, seed=case.seed, runs=runs)
    simulator = nominal(case.robot)
    begin = time.process_time()
    result = find_gap(simulator, logs)
    processor = time.process_time() - begin
    chosen = [v for v in result.verdicts if v.effect and v.kind in NAMES]
    forms = {verdict.label: {verdict.label, *verdict.form} for verdict in chosen}
    twins = exact_twins(simulator)
    alike = [twins.get(name, frozenset({name})) for name in case.hidden]
    first = [verdict.label for verdict in chosen][: len(alike)]
    strictly = all(any(label in group for label in first) for group in alike)
    found = all(any(forms[label] & group for label in first) for group in alike)
    right = found if alike else not chosen
    known = frozenset().union(*alike)
    sure = [verdict.label for verdict in chosen if verdict.kind == "confirmed"]
    return {
        "case": dataclasses.asdict(case),
        "sizes": sizes,
        "named": [
            (v.label, v.kind, {k: (n.value, n.low, n.high) for k, n in v.parameters.items()})
            for v in chosen
        ],
        "right": right,
        "by_family": right and not strictly,
        "confirmed_wrong": [label for label in sure if not forms[label] & known],
        "remainder": any(verdict.kind == "unexplained" for verdict in result.verdicts),
        "processor": processor,
    }
