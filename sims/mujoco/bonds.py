"""What a model's ``<equality>`` elements tell of positions that were not measured."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from sims.simulator import Array

#: Newton steps of a row at most; they end where none moves anything more than that (m or rad).
STEPS, STILL = 20, 1e-9
#: Singular values below this part of the largest one are none.
SINGULAR = 1e-6
#: Rows of a path at which it is asked what the bonds tell: at a dead centre that is less.
ROWS = 9

Mask = NDArray[np.bool_]


class MujocoBonds:
    """See ``sims.bonds.Bonds``; by steps of Gauss and Newton.

    Args:
        model: The compiled model.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        q, v = model.jnt_qposadr, model.jnt_dofadr
        ends_q, ends_v = np.append(q[1:], model.nq), np.append(v[1:], model.nv)
        joints = zip(q, ends_q, v, ends_v, strict=True)
        self._joints = [(slice(a, b), slice(c, d)) for a, b, c, d in joints]

    def told(self, states: Array, unknown: Mask) -> Mask:
        """See ``Bonds.told``."""
        model, free = self.model, self._motions(unknown)
        told, data = np.zeros(model.nv), mujoco.MjData(model)
        rows = np.unique(np.linspace(0, len(states) - 1, ROWS).round().astype(int))
        for row in rows if free.any() else ():
            data.qpos[:] = states[row, : model.nq]
            _, sizes, ways = np.linalg.svd(self._open(data)[1][:, free])
            seen = ways[: int((sizes > SINGULAR * sizes.max(initial=1e-300)).sum())]
            told[free] += (seen**2).sum(axis=0) > 1 - SINGULAR
        found, by_most = np.zeros_like(unknown), told > len(rows) / 2
        for positions, motions in self._joints:
            found[positions] = by_most[motions].all()
            found[model.nq :][motions] = by_most[motions].all()
        return found & unknown

    def filled(self, states: Array, told: Mask) -> Array:
        """See ``Bonds.filled``."""
        model, found, moving = self.model, np.array(states, float), self._motions(told)
        data, move = mujoco.MjData(model), np.zeros(model.nv)
        for row, given in enumerate(states[:, : model.nq] if moving.any() else ()):
            data.qpos[:] = given
            mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            if self._close(data, moving):
                found[row, : model.nq] = data.qpos
                mujoco.mj_differentiatePos(model, move, 1.0, given, data.qpos)
        return found

    def _motions(self, channels: Mask) -> Mask:
        """Degrees of freedom of joints with such positions, (n_p,) -> (nv,)."""
        found = np.zeros(self.model.nv, bool)
        for positions, motions in self._joints:
            found[motions] = channels[positions].any()
        return found

    def _close(self, data: Any, moving: Mask) -> bool:
        """Move some degrees of freedom to where the bonds are open least; whether they rest."""
        step = np.zeros(self.model.nv)
        for _ in range(STEPS):
            gap, slope = self._open(data)
            step[moving] = np.linalg.lstsq(slope[:, moving], -gap, rcond=SINGULAR)[0]
            mujoco.mj_integratePos(self.model, data.qpos, step, 1.0)
            if np.abs(step).max() < STILL:
                return True
        return False

    def _open(self, data: Any) -> tuple[Array, Array]:
        """How far the bonds are open in a pose, (k,), and its derivative by motion, (k, nv)."""
        mujoco.mj_fwdPosition(self.model, data)
        slope = np.zeros((data.nefc, self.model.nv))
        if data.nefc and mujoco.mj_isSparse(self.model):
            rows = data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
            mujoco.mju_sparse2dense(slope, data.efc_J, *rows)
        elif data.nefc:
            slope[:] = np.reshape(data.efc_J, slope.shape)
        return np.array(data.efc_pos[: data.ne]), slope[: data.ne]
