"""Sets in which one effect does again what another does already."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import Signatures
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.parameter_curve import ParameterCurve
from sims.effects.sensor import SensorEffect

if TYPE_CHECKING:
    from residual.gap.search.pool import Key
    from residual.gap.search.sets import Proposals, Search

Array = NDArray[np.float64]

#: Part of the length of what an effect does within what a curve can do, beyond which it is a case
#: of the curve.
CASE = 0.995


def by_points(search: Search) -> list[int]:
    """Numbers of the candidates that are curves by points."""
    return [n for n, one in enumerate(search.candidates) if isinstance(one.effect, Curve)]


def doubles(search: Search, key: Key) -> bool:
    """Whether a set holds an effect twice: under two names, a curve beside a case of it, or beside
    a sensor that only moves its points."""
    effects = [search.candidates[i].effect for i in key]
    if any(
        one.covers(other) or _misplaces(search, one, other) for one in effects for other in effects
    ):
        return True
    points = [number for number in by_points(search) if number in key]
    if len(key) < 2 or not points:
        return False
    around = search.signatures(())
    return any(
        _is_case(around, search.stands_for(other), curve)
        for curve in points
        for other in key
        if other != curve and not _takes_away(search, other, curve)
    )


def _misplaces(search: Search, sensor: Effect, curve: Effect) -> bool:
    """Whether a sensor's zero or scale only moves the points of a curve by what it shows."""
    if not (isinstance(sensor, SensorEffect) and isinstance(curve, Curve)):
        return False
    if isinstance(curve, ParameterCurve):
        return sensor.where == curve.over
    joints = {joint.name: joint.position for joint in search.simulator.joints}
    return curve.along == "position" and sensor.where == joints[curve.where]


def _takes_away(search: Search, number: int, curve: int) -> bool:
    """Whether an effect may be negative and a curve may not: less of a damping that is too large
    makes room for the curve."""
    lows = [[knob.low for knob in search.candidates[n].knobs] for n in (number, curve)]
    return min(lows[0]) < 0 <= min(lows[1])


def curves_in_place(search: Search, keys: Iterable[Key]) -> Proposals:
    """Sets with a curve in place of all that it does, and every curve alone."""
    found: Proposals = {}
    for key in [(), *keys]:
        for curve in by_points(search):
            gone = tuple(n for n in key if doubles(search, (n, curve)))
            if curve in key or (key and not gone):
                continue
            start = _shape_of(search, key, gone, curve)
            fresh, theta = search.merged(key, [(curve, start)], drop=gone)
            if search.fits_in(fresh):
                found[fresh] = theta
    return found


def _shape_of(search: Search, key: Key, gone: Key, curve: int) -> Array:
    """Numbers of a curve to start from: those of one through fewer points among what is gone, which
    were fitted with the set, and zero without one."""
    candidate = search.candidates[curve]
    effect, start = candidate.effect, 0.0 * candidate.trials[0].values[0]
    for number in gone:
        coarse = search.candidates[number]
        if not (isinstance(effect, Curve) and isinstance(coarse.effect, Curve)):
            continue
        if key not in search.tried or not effect.contains(coarse.effect):
            continue
        fit = search.tried[key]
        own = fit.model.added(fit.theta)[key.index(number)]
        assert isinstance(own, Curve)
        places = [effect.point_of(knob.field) for knob in candidate.knobs]
        start = np.array([own.at(there[0]) if there else 0.0 for there in places])
    return start


def _is_case(around: Signatures, number: int, curve: int) -> bool:
    """Whether a curve moves, start states allowed for, as an effect of one column does."""
    columns = {v.candidate: v.columns for v in around.variants}
    own, of_curve = columns.get(number, ()), columns.get(curve, ())
    if len(own) != 1 or not of_curve:
        return False
    column, basis = around.matrix[:, own[0]], around.matrix[:, list(of_curve)]
    length = float(np.linalg.norm(column))
    if not length > 0:
        return False
    fitted = basis @ np.linalg.lstsq(basis, column, rcond=1e-10)[0]
    return bool(np.linalg.norm(fitted) > CASE * length)
