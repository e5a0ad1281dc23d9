"""Which sets of logs a study of hidden effects is made of."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from jsonargparse.typing import NonNegativeInt, PositiveInt

from studies.hidden.data import Excitation
from studies.hidden.dirty.measure import Layout
from studies.hidden.dirty.sets import HIDDEN as LABELS
from studies.hidden.dirty.systems import SYSTEMS
from studies.hidden.scores import alike, replaceable
from studies.hidden.strengths import HIDDEN, strength

#: Effects that no library holds, as fields of ``Truth`` at a size that is seen.
OUTSIDE: Mapping[str, Mapping[str, float]] = {
    "resonance": {"resonance": 2e-3},
    "wind": {"wind": 2e-3},
}
MOST_REPEATS = 10_000
METHODS = ("find_gap", "one_step", "pysindy")


@dataclasses.dataclass(frozen=True)
class Block:
    """Sets of logs of one kind: the product of all lists, ``sets`` of them or all.

    Args:
        name: Of the block, for tables.
        hidden: What is hidden, one list of names for each kind of set; ``[any]`` stands for every
            effect alone, ``[any, any]`` for a random pair, an empty list for no gap.
        size: Gaps in units of the noise floor, for each effect alone.
        excitation: ``strong``, ``weak`` or ``policy``.
        noise: ``A``, ``B`` or ``C``.
        runs: Trajectories in a set.
        remove: Take what is hidden, and what can replace it exactly, out of the library.
        repeats: Sets for every combination.
        sets: Draw so many sets at random, every effect about equally often; all by default.
    """

    name: str
    hidden: list[list[str]]
    size: list[float] = dataclasses.field(default_factory=lambda: [3.0])
    excitation: list[Excitation] = dataclasses.field(default_factory=lambda: ["strong"])
    noise: list[Literal["A", "B", "C"]] = dataclasses.field(default_factory=lambda: ["A"])
    runs: list[int] = dataclasses.field(default_factory=lambda: [15])
    remove: bool = False
    repeats: PositiveInt = 1
    sets: PositiveInt | None = None

    def __post_init__(self) -> None:
        _check_block(self, "hidden", "size", "excitation", "noise", "runs")


@dataclasses.dataclass(frozen=True)
class DirtyBlock:
    """Sets of the dirty world (``studies.hidden.dirty``), one effect at a time.

    Args:
        name: ``hidden``; ``dirt only``, with nothing hidden; or ``removed``, with what is hidden
            taken out of the library.
        systems: Of ``studies.hidden.dirty.systems``.
        effects: What is hidden, ``name@where`` or a parameter; by default everything that can be.
        size: Forecast error of the nominal simulator, in errors with the dirt alone.
        layout: ``ramp``: six runs driven harder and harder; ``single``: one long run; ``many``:
            twelve runs alike.
        repeats: Sets for every combination; layouts and sizes take turns.
    """

    name: Literal["hidden", "dirt only", "removed"]
    systems: list[Literal["arm", "two-link arm", "cart", "oven"]] = dataclasses.field(
        default_factory=lambda: list(SYSTEMS)  # type: ignore[arg-type]
    )
    effects: list[str] | None = None
    size: list[float] = dataclasses.field(default_factory=lambda: [3.0, 6.0])
    layout: list[Layout] = dataclasses.field(default_factory=lambda: ["ramp", "single", "many"])
    repeats: PositiveInt = 1

    def __post_init__(self) -> None:
        _check_block(self, "systems", "size", "layout")


@dataclasses.dataclass(frozen=True)
class HiddenStudy:
    """What is run.

    Args:
        blocks: The kinds of sets of the pendulum.
        dirty: The kinds of sets of the dirty world.
        methods: Who is asked.
        steps: Control steps of every trajectory.
        seed: Of everything random.
    """

    blocks: list[Block] = dataclasses.field(default_factory=list)
    dirty: list[DirtyBlock] = dataclasses.field(default_factory=list)
    methods: list[Literal["find_gap", "one_step", "pysindy"]] = dataclasses.field(
        default_factory=lambda: list(METHODS)  # type: ignore[arg-type]
    )
    steps: PositiveInt = 250
    seed: NonNegativeInt = 0


def trials_of(study: HiddenStudy) -> list[dict[str, Any]]:
    """Plain settings of every set of logs, shuffled so that any part of them is balanced.

    Raises:
        ValueError: A name of an effect, an excitation or a noise is not known.
    """
    rng = np.random.default_rng(study.seed)
    found = []
    for block in study.blocks:
        cells = []
        for names, size, excitation, noise, runs, repeat in itertools.product(
            block.hidden, block.size, block.excitation, block.noise, block.runs,
            range(block.repeats),
        ):  # fmt: skip
            for hidden in _spelt_out(names, rng):
                if not _possible(hidden, size, excitation, noise):
                    continue
                cells.append(
                    {
                        "block": block.name, "hidden": hidden, "size": size if hidden else 1.0,
                        "excitation": excitation, "noise": noise, "runs": runs,
                        "remove": block.remove, "repeat": repeat, "steps": study.steps,
                        "methods": list(study.methods),
                    }
                )  # fmt: skip
        cells = [cells[i] for i in rng.permutation(len(cells))]
        found += cells if block.sets is None else _balanced(cells)[: block.sets]
    found += [cell for block in study.dirty for cell in _dirty_cells(block)]
    mixed = [found[i] for i in rng.permutation(len(found))]
    return [{**cell, "seed": 100_000 * study.seed + number} for number, cell in enumerate(mixed)]


def _check_block(block: Block | DirtyBlock, *lists: str) -> None:
    """Refuse lists without entries, and more sets than anybody could wait for."""
    for name in lists:
        if not getattr(block, name):
            raise ValueError(f"block {block.name!r}: {name} is empty, expected a list of values")
    if not isinstance(block.repeats, int) or block.repeats > MOST_REPEATS:
        raise ValueError(
            f"block {block.name!r}: repeats is {block.repeats}, expected 1 to {MOST_REPEATS}"
        )


def _dirty_cells(block: DirtyBlock) -> list[dict[str, Any]]:
    """Settings of every set of a block of the dirty world."""
    cells: list[dict[str, Any]] = []
    known = {label for system in block.systems for label in LABELS[system]}
    wanted = known if block.effects is None else set(block.effects)
    if wanted - known:
        raise ValueError(
            f"nothing called {min(wanted - known)!r} can be hidden in {', '.join(block.systems)}; "
            f"there are {', '.join(sorted(known))}"
        )
    for system in block.systems:
        labels = [label for label in LABELS[system] if label in wanted]
        if block.name == "dirt only":
            labels = [""]
        for label, _ in itertools.product(labels, range(block.repeats)):
            turn = len(cells)
            cells.append(
                {
                    "block": block.name, "system": system, "hidden": label,
                    "size": block.size[turn % len(block.size)],
                    "layout": block.layout[turn % len(block.layout)], "repeat": turn,
                }
            )  # fmt: skip
    return cells


def _spelt_out(names: Sequence[str], rng: np.random.Generator) -> list[list[str]]:
    wild = [name for name in names if name == "any"]
    unknown = [n for n in names if n not in HIDDEN and n not in OUTSIDE and n != "any"]
    if unknown:
        raise ValueError(
            f"nothing called {unknown[0]!r} can be hidden; there are {', '.join(HIDDEN)}, "
            f"{', '.join(OUTSIDE)} and 'any'"
        )
    if len(wild) == 1:
        rest = [name for name in names if name != "any"]
        return [[*rest, name] for name in HIDDEN if name not in rest]
    if len(wild) == 2:
        while True:
            pair = [str(name) for name in rng.choice(list(HIDDEN), 2, replace=False)]
            if pair[1] not in alike(pair[0]) | replaceable(pair[0]):
                return [pair]
    return [list(names)]


def _possible(hidden: Sequence[str], size: float, excitation: Excitation, noise: str) -> bool:
    """Whether every effect can make a gap of this size (inertia under feedback, say, cannot)."""
    try:
        for name in hidden:
            if name in HIDDEN:
                strength(name, size, excitation, noise)
    except ValueError:
        return False
    return True


def _balanced(cells: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The cells with every first name once before any comes a second time, and so on."""
    seen: Counter[str] = Counter()
    turns = []
    for cell in cells:
        seen[first := "".join(cell["hidden"][:1])] += 1
        turns.append(seen[first])
    return [cells[i] for i in np.argsort(turns, kind="stable")]
