"""Which geoms of a model can touch."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np


def touching_geoms(model: Any) -> list[int]:
    """Geoms that can be in a contact of bodies that move against each other, in their order.

    MuJoCo's own rule: contype of one and conaffinity of the other share a bit, the bodies are not
    welded together, not parent and child (but for the world, and unless the file lets these
    collide), and not excluded.
    """
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
