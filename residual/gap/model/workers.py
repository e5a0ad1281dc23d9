"""Spread the rows of a slow simulator over processes."""

from __future__ import annotations

import contextlib
import contextvars
import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from sims.host import HostSimulator

Array = NDArray[np.float64]

_POOL: contextvars.ContextVar[Parallel | None] = contextvars.ContextVar("pool", default=None)

#: Fewer rows than this are not worth sending.
WORTH = 300

#: Where a state is put that ran away.
AWAY = 1e6


@contextlib.contextmanager
def workers(count: int) -> Iterator[None]:
    """Within this context ``integrate`` uses ``count`` processes."""
    if count <= 1:
        yield
        return
    with Parallel(n_jobs=count) as pool:
        token = _POOL.set(pool)
        try:
            yield
        finally:
            _POOL.reset(token)


def integrate(host: HostSimulator, states: Array, inputs: Array, durations: Array) -> Array:
    """``host.integrate``, in parallel over chunks of rows inside ``workers``."""
    pool = _POOL.get()
    if pool is None or len(states) < WORTH:
        return integrate_rows(host, states, inputs, durations)
    # Neighbouring rows may need more work than others, so every process gets several chunks.
    edges = np.linspace(0, len(states), 4 * pool.n_jobs + 1).astype(int)
    parts = pool(
        delayed(integrate_rows)(host.take(np.s_[a:b]), states[a:b], inputs[a:b], durations[a:b])
        for a, b in itertools.pairwise(edges)
    )
    return np.concatenate(parts)


def each(work: Callable[[Any], Any], pieces: Sequence[Any]) -> list[Any]:
    """``work`` done on every piece, shared among processes inside ``workers``."""
    pool = _POOL.get()
    if pool is None or len(pieces) < 2:
        return [work(piece) for piece in pieces]
    return list(pool(delayed(work)(piece) for piece in pieces))


def integrate_rows(host: HostSimulator, states: Array, inputs: Array, durations: Array) -> Array:
    """``host.integrate`` in this process; a row that runs away is put far away."""
    # A trial that runs away is a number like any other here: it loses.
    try:
        with np.errstate(all="ignore"):
            after = host.integrate(states, inputs, durations)
    except (ArithmeticError, np.linalg.LinAlgError):
        after = _survivors(host, states, inputs, durations)
    except ValueError as error:
        # What the math module says of the sine of infinity, before and from Python 3.14.
        if not re.search("math domain|finite", str(error)):
            raise
        after = _survivors(host, states, inputs, durations)
    if np.isfinite(after).all():
        return after
    return np.nan_to_num(after, nan=AWAY, posinf=AWAY, neginf=-AWAY)


def _survivors(host: HostSimulator, states: Array, inputs: Array, durations: Array) -> Array:
    """Rows of a simulator that raises where a row overflows; such a row is put far away."""
    if len(states) == 1:
        return np.full_like(states, AWAY)
    half = len(states) // 2
    return np.concatenate(
        [
            integrate_rows(host.take(part), states[part], inputs[part], durations[part])
            for part in (np.s_[:half], np.s_[half:])
        ]
    )
