"""Which geoms of a model can touch, and whether any do along a motion."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray


def touching_geoms(model: Any) -> list[int]:
    """Geoms that can be in a contact of bodies that move against each other, in their order.

    MuJoCo's own rule: contype of one and conaffinity of the other share a bit, the bodies are not
    welded together, not parent and child (but for the world, and unless the file lets these
    collide), and not excluded. None if the file turns contacts or all constraints off.
    """
    off = int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    if model.opt.disableflags & off:
        return []
    found: set[int] = set()
    excluded = {int(s) for s in np.ravel(model.exclude_signature)}
    weld, bodies = model.body_weldid, model.geom_bodyid
    filtered = not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    for g in range(model.ngeom):
        for h in range(g + 1, model.ngeom):
            if not (
                model.geom_contype[g] & model.geom_conaffinity[h]
                or model.geom_contype[h] & model.geom_conaffinity[g]
            ):
                continue
            a, b = sorted((int(bodies[g]), int(bodies[h])))
            wa, wb = int(weld[a]), int(weld[b])
            if wa == wb or (a << 16) + b in excluded or (b << 16) + a in excluded:
                continue
            parents = int(weld[model.body_parentid[wa]]), int(weld[model.body_parentid[wb]])
            if filtered and wa and wb and (parents[0] == wb or parents[1] == wa):
                continue
            found |= {g, h}
    for pair in range(model.npair):
        found |= {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}
    return sorted(found)


def touches(model: Any, positions: NDArray[np.float64]) -> bool:
    """Whether anything is in contact at one of these positions, or half a sample beside it.

    An impact is shorter than a sample, so motion is continued as straight as it came, and went.

    Args:
        model: The compiled model.
        positions: (n, nq), without missing values, one sample apart.
    """
    data = mujoco.MjData(model)
    half = 0.5 * np.diff(positions, axis=0)
    for row in np.concatenate([positions, positions[1:] + half, positions[:-1] - half]):
        data.qpos[:] = row
        mujoco.mj_fwdPosition(model, data)
        if data.ncon:
            return True
    return False
