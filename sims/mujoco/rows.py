"""Rows of states advanced by MuJoCo's batch, each with its own numbers, in C++ threads."""

from __future__ import annotations

import contextlib
import ctypes
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from sims.mujoco.attributes import nominal_field
from sims.simulator import Array

#: Rows in one batch. More are advanced in several batches, which costs nothing.
BLOCK = 2048

#: Positions and velocities before a sub-step, (n, nq) and (n, nv) -> forces (n, nv) to add, and
#: model fields for this sub-step.
Law = Callable[[Array, Array], tuple[Array, Mapping[str, Array]]]

_DERIVED = frozenset(mujoco.MjModel._setconst_inputs)


def threads() -> int:
    """Cores that this process may use, no more than ``OMP_NUM_THREADS``."""
    if hasattr(os, "sched_getaffinity"):
        cores = len(os.sched_getaffinity(0))
    else:
        cores = os.cpu_count() or 1
    limit = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(cores, int(limit))) if limit.isdigit() else cores


class Rows:
    """Batches of one model, kept between calls; results do not depend on what they held before.

    Args:
        model: The compiled nominal.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self._batches: dict[int, _Lanes] = {}

    def __getstate__(self) -> dict[str, Any]:
        # Batches belong to a process; another makes its own.
        return {"model": self.model, "_batches": {}}

    def advance(
        self,
        states: Array,
        controls: Array,
        fields: Mapping[str, Array],
        applied: Array | None = None,
        law: Law | None = None,
    ) -> Array:
        """Advance every row by as many model steps as there are controls.

        Args:
            states: shape (n, nq + nv + na), at most ``BLOCK`` rows.
            controls: shape (n, steps, nu).
            fields: Model fields with an entry per row, (n, ...); all others are nominal.
            applied: Constant generalized forces, (n, nv).
            law: Forces and fields that follow the state, asked before every step.

        Returns:
            States at the end; NaN in rows that diverged.
        """
        size = 1
        while size < len(states):
            size *= 2
        if size not in self._batches:
            self._batches[size] = _Lanes(self.model, size)
        with _quiet():
            return self._batches[size].advance(states, controls, fields, applied, law)


class _Lanes:
    """One batch of a fixed size, of which the leading rows are used."""

    def __init__(self, model: Any, size: int) -> None:
        self._model = model
        self._batch = Batch(model, nsim=size, nthread=threads() if size >= 16 else 1)
        self._rest = self._batch.state[:1].copy()
        self._q, self._v = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._u, self._act = self._batch.bind("ctrl"), self._batch.bind("act")
        self._force = self._batch.bind("qfrc_applied")
        self._fields: dict[str, Array] = {}

    def advance(
        self,
        states: Array,
        controls: Array,
        fields: Mapping[str, Array],
        applied: Array | None,
        law: Law | None,
    ) -> Array:
        n, steps = controls.shape[:2]
        ids = None if n == self._batch.nsim else np.arange(n)
        if self._write(fields, n):
            self._batch.set_const(ids)
        nq, nv = self._model.nq, self._model.nv
        self._batch.state[:n] = self._rest
        self._q[:n], self._v[:n] = states[:, :nq], states[:, nq : nq + nv]
        self._act[:n] = states[:, nq + nv :]
        if applied is not None:
            self._force[:n] = applied
        self._batch.warning[:n] = 0
        lost = np.zeros(n, dtype=bool)
        try:
            if law is not None:
                for k in range(steps):
                    force, changing = law(self._q[:n], self._v[:n])
                    self._force[:n] = force if applied is None else applied + force
                    self._write({**fields, **changing}, n)
                    self._u[:n] = controls[:, k]
                    self._batch.step(ids)
            elif (controls == controls[:, :1]).all():
                self._u[:n] = controls[:, 0]
                self._batch.step(ids, nstep=steps)
            else:
                self._batch.rollout(steps, control=controls, record=(), ids=ids)
        except SimulationError as error:
            lost[error.ids] = True
        lost |= self._batch.warning[:n].any(axis=(1, 2))
        after = np.concatenate([self._q[:n], self._v[:n], self._act[:n]], axis=1)
        after[lost] = np.nan
        return after

    def _write(self, fields: Mapping[str, Array], n: int) -> bool:
        """Give the fields their values and all others nominal ones; whether constants follow."""
        stale = False
        for field in {**self._fields, **fields}:
            if field not in self._fields:
                self._fields[field] = self._batch.expand(field)
            held = self._fields[field][:n]
            wanted = fields.get(field, nominal_field(self._model, field))
            if not np.array_equal(held, np.broadcast_to(wanted, held.shape)):
                held[...] = wanted
                stale |= field in _DERIVED
        return stale


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """MuJoCo's warnings of a diverged row go nowhere: the row says it.

    Otherwise each is printed and appended to a file in the current folder. The function that
    swallows them is C, since threads without Python call it.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_SWALLOW)
    try:
        with warnings.catch_warnings():
            yield
    finally:
        mujoco.set_mju_user_warning(before)


# ``strlen`` takes a text and does nothing with it.
_SWALLOW = ctypes.cast(ctypes.CDLL(None).strlen, ctypes.CFUNCTYPE(None, ctypes.c_char_p))
