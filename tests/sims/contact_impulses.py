"""Impulses of rigid contacts with Coulomb friction and of stops, one or all of them at once."""

import numpy as np


def finished(delassus, free, both, least, mu, stop):
    """Impulses for what now holds at every wheel and stop, and the rows where that is right."""
    size = free.shape[1]
    matrix, wanted = np.zeros_like(delassus), np.zeros_like(free)
    normal = both[:, 1:8:2]
    touching = normal > 0
    side = np.where(np.abs(both[:, 0:8:2]) >= mu[:, None] * normal * (1 - 1e-9), 1.0, 0.0)
    side *= np.sign(both[:, 0:8:2]) * touching
    for c in range(4):
        t, v = 2 * c, 2 * c + 1
        on, slides = touching[:, c, None], side[:, c, None] != 0
        unit_t, unit_v = np.eye(size)[t], np.eye(size)[v]
        matrix[:, v] = np.where(on, delassus[:, v], unit_v)
        wanted[:, v] = np.where(on[:, 0], least[:, c] - free[:, v], 0.0)
        sliding = unit_t - (side[:, c] * mu)[:, None] * unit_v
        matrix[:, t] = np.where(on & ~slides, delassus[:, t], np.where(slides, sliding, unit_t))
        wanted[:, t] = np.where(touching[:, c] & (side[:, c] == 0), -free[:, t], 0.0)
    for j in range(8, size):
        bound = np.where(both[:, j] > 0, stop[0][:, j - 8], stop[1][:, j - 8])
        on = both[:, j] != 0
        matrix[:, j] = np.where(on[:, None], delassus[:, j], np.eye(size)[j])
        wanted[:, j] = np.where(on, bound - free[:, j], 0.0)
    # Both wheels of a foot that stands cannot share their pull along the ground in one way only.
    impulse = np.linalg.solve(matrix + 1e-9 * np.eye(size), wanted[..., None])[..., 0]
    rate = free + np.einsum("nkl,nl->nk", delassus, impulse)
    along, push = impulse[:, 0:8:2], impulse[:, 1:8:2]
    right = np.where(touching, push >= 0, rate[:, 1:8:2] >= least - 1e-9)
    right &= np.abs(np.where(touching, rate[:, 1:8:2] - least, 0.0)) < 1e-7
    stick = touching & (side == 0)
    right &= ~stick | ((np.abs(along) <= mu[:, None] * push) & (np.abs(rate[:, 0:8:2]) < 1e-7))
    right &= (side == 0) | (side * rate[:, 0:8:2] <= 1e-9)
    found = right.all(axis=1)
    if size > 8:
        own, stopped = rate[:, 8:], both[:, 8:]
        found &= ((own >= stop[0] - 1e-7) & (own <= stop[1] + 1e-7)).all(axis=1)
        found &= (impulse[:, 8:] * np.sign(stopped) >= 0).all(axis=1)
    return impulse, found


def one_contact(a, rate, least, mu):
    """Impulse (n, 2) of one wheel: none, sticking, or sliding to either side."""
    att, atn, ann = a[:, 0, 0], a[:, 0, 1], a[:, 1, 1]
    t, v = rate[:, 0], rate[:, 1] - least
    determinant = att * ann - atn * atn
    stick_n = (-att * v + atn * t) / determinant
    stick_t = (-ann * t + atn * v) / determinant
    sticks = (stick_n >= 0) & (np.abs(stick_t) <= mu * stick_n)
    result = np.zeros((len(v), 2))
    slides = np.zeros(len(v), bool)
    for side in (1.0, -1.0):
        # Friction of +-mu times the normal impulse, against the way it slides.
        slope = ann + side * mu * atn
        with np.errstate(divide="ignore", invalid="ignore"):
            normal = -v / slope
        after = t + (side * mu * att + atn) * normal
        fits = (slope > 0) & (v < 0) & (side * after <= 0) & ~slides
        result[fits] = np.stack([side * mu * normal, normal], axis=1)[fits]
        slides |= fits
    # What fits nothing by rounding sticks.
    sticks = (v < 0) & (sticks | ~slides)
    result[sticks] = np.stack([stick_t, np.maximum(stick_n, 0.0)], axis=1)[sticks]
    result[v >= 0] = 0.0
    return result
