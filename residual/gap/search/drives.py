"""What holds still beside the drive that overcomes it."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.sound import sound

#: Part of the time left that is spent on it where there are several joints.
AT_MOST = 0.3


def driven(search: Search) -> list[Key]:
    """Fit every effect that holds still beside the gain of its input, or of what moves its joint.

    When motion begins depends on both, on friction and on the drive that overcomes it; where both
    are wrong, friction alone ends at numbers from which the linear picture is of no use. Of several
    joints those come first that explain most alone, for a part of the time.
    """
    screened = search.candidates[: search.screened]
    gains = [number for number, candidate in enumerate(screened) if candidate.effect.drives]
    if not gains:
        return []
    singles = [key for key in search.validated if len(key) == 1 and key[0] < search.screened]
    still = [key for key in singles if screened[key[0]].effect.holds_still]
    now, found = time.process_time(), list[Key]()
    over = now + AT_MOST * (search.until - now) if len(search.currency.groups) > 1 else np.inf
    for key in sorted(still, key=search.error):
        place = search.place(key[0])
        own = [number for number in gains if search.place(number) == place]
        gain = own[0] if own else _drive_of(search, place, gains)
        small = 0.01 * screened[gain].trials[0].values[0]
        start = search.own((gain,)) if (gain,) in search.tried else small
        fresh, theta = search.merged(key, [(gain, start)])
        if search.late or time.process_time() > over:
            break
        if search.fits_in(fresh):
            found += sound(search, fresh, theta)
    return found


def _drive_of(search: Search, place: str, gains: Sequence[int]) -> int:
    """The gain of the input that moves a joint most by the linear screen, or, where nothing of the
    joint was measured, the gain that does best alone."""
    joint = next((one for one in search.simulator.joints if one.name == place), None)
    channels, measured = search.simulator.physical_channels, search.fitter.samples.measured
    names = (joint.position, joint.rate) if joint else ()
    own = [i for i, column in enumerate(measured) if channels[column].name in names]
    if not own:
        return min(gains, key=lambda n: search.error((n,)) if (n,) in search.tried else np.inf)
    around = search.signatures(())
    moves = np.linalg.norm(around.matrix[around.rows_of(own, len(measured))], axis=0)
    by_candidate = {one.candidate: moves[one.columns[0]] for one in around.variants}
    return max(gains, key=lambda number: by_candidate.get(number, 0.0))
