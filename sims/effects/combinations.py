"""Effects whose motion others make together, all but a share of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sims.effects.aliases import linear_columns, probes

if TYPE_CHECKING:
    from sims.host import HostSimulator
    from sims.simulator import Array


def near_combinations(
    simulator: HostSimulator,
    names: Sequence[str],
    share: float = 0.03,
    rng: np.random.Generator | None = None,
) -> tuple[str, ...]:
    """Single effects that some effects imitate together, all but a small share of the motion.

    A pendulum's mass, for example, is its inertia and its motor's resistance but for the
    damping of the bearing, which is little beside the motor's.

    Args:
        simulator: A host, with or without effects.
        names: The effects that act together, ``name@where``.
        share: Part of the motion that may differ.
        rng: As for ``exact_aliases``, like the effects that are compared.
    """
    plain = simulator.with_effects(())
    columns, _ = linear_columns(plain, *probes(plain, rng or np.random.default_rng(0)))
    if not names or not all(name in columns for name in names):
        return ()
    return _imitated(columns, names, share)


def made_by(simulator: HostSimulator, names: Sequence[str], share: float = 1e-3) -> tuple[str, ...]:
    """Single effects whose motion some others make together; those that do nothing are no matter.

    Args:
        simulator: A host, with or without effects.
        names: The effects that may act together, ``name@where``.
        share: Part of the motion that may differ.
    """
    plain = simulator.with_effects(())
    columns, _ = linear_columns(plain, *probes(plain, np.random.default_rng(0)))
    known = [name for name in names if name in columns]
    return _imitated(columns, known, share) if known else ()


def _imitated(columns: dict[str, Array], names: Sequence[str], share: float) -> tuple[str, ...]:
    size = min(len(column) for column in columns.values())
    matrix = np.stack([columns[name][:size] for name in names], axis=1)
    found = []
    for name, column in columns.items():
        rest = column - matrix @ np.linalg.lstsq(matrix, column, rcond=None)[0]
        if name not in names and np.linalg.norm(rest) < share:
            found.append(name)
    return tuple(found)
