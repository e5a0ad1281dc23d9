"""Units of logged columns: one explicit table of factors to SI, used at the border only."""

from __future__ import annotations

import difflib
import math
from typing import NamedTuple


class Unit(NamedTuple):
    """``si = factor * value + offset``, in the unit ``base``."""

    base: str
    factor: float
    offset: float = 0.0


_TURN = 2 * math.pi

UNITS: dict[str, Unit] = {
    "1": Unit("1", 1.0),
    "%": Unit("1", 0.01),
    "s": Unit("s", 1.0),
    "ms": Unit("s", 1e-3),
    "us": Unit("s", 1e-6),
    "ns": Unit("s", 1e-9),
    "min": Unit("s", 60.0),
    "h": Unit("s", 3600.0),
    "rad": Unit("rad", 1.0),
    "mrad": Unit("rad", 1e-3),
    "deg": Unit("rad", _TURN / 360),
    "rev": Unit("rad", _TURN),
    "rad/s": Unit("rad/s", 1.0),
    "mrad/s": Unit("rad/s", 1e-3),
    "deg/s": Unit("rad/s", _TURN / 360),
    "rev/s": Unit("rad/s", _TURN),
    "rpm": Unit("rad/s", _TURN / 60),
    "rad/s2": Unit("rad/s2", 1.0),
    "deg/s2": Unit("rad/s2", _TURN / 360),
    "m": Unit("m", 1.0),
    "km": Unit("m", 1e3),
    "cm": Unit("m", 1e-2),
    "mm": Unit("m", 1e-3),
    "um": Unit("m", 1e-6),
    "in": Unit("m", 0.0254),
    "ft": Unit("m", 0.3048),
    "nmi": Unit("m", 1852.0),
    "m/s": Unit("m/s", 1.0),
    "cm/s": Unit("m/s", 1e-2),
    "mm/s": Unit("m/s", 1e-3),
    "km/h": Unit("m/s", 1 / 3.6),
    "kn": Unit("m/s", 1852 / 3600),
    "mph": Unit("m/s", 0.44704),
    "ft/s": Unit("m/s", 0.3048),
    "ft/min": Unit("m/s", 0.3048 / 60),
    "m/s2": Unit("m/s2", 1.0),
    "cm/s2": Unit("m/s2", 1e-2),
    "mm/s2": Unit("m/s2", 1e-3),
    "gn": Unit("m/s2", 9.80665),
    "V": Unit("V", 1.0),
    "mV": Unit("V", 1e-3),
    "kV": Unit("V", 1e3),
    "A": Unit("A", 1.0),
    "mA": Unit("A", 1e-3),
    "W": Unit("W", 1.0),
    "mW": Unit("W", 1e-3),
    "kW": Unit("W", 1e3),
    "N": Unit("N", 1.0),
    "mN": Unit("N", 1e-3),
    "kN": Unit("N", 1e3),
    "N m": Unit("N m", 1.0),
    "mN m": Unit("N m", 1e-3),
    "N cm": Unit("N m", 1e-2),
    "N mm": Unit("N m", 1e-3),
    "kg": Unit("kg", 1.0),
    "g": Unit("kg", 1e-3),
    "lb": Unit("kg", 0.45359237),
    "K": Unit("K", 1.0),
    "degC": Unit("K", 1.0, 273.15),
    "degF": Unit("K", 5 / 9, 459.67 * 5 / 9),
    "Pa": Unit("Pa", 1.0),
    "kPa": Unit("Pa", 1e3),
    "hPa": Unit("Pa", 1e2),
    "bar": Unit("Pa", 1e5),
    "mbar": Unit("Pa", 1e2),
    "psi": Unit("Pa", 6894.757),
}

_SPELLINGS = {
    "°": "deg",
    "°/s": "deg/s",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "turn": "rev",
    "turns": "rev",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "µs": "us",
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
    "rad/s^2": "rad/s2",
    "rad/s²": "rad/s2",
    "Nm": "N m",
    "N*m": "N m",
    "N.m": "N m",
    "N·m": "N m",
    "mNm": "mN m",
    "Ncm": "N cm",
    "Nmm": "N mm",
    "kt": "kn",
    "kts": "kn",
    "knot": "kn",
    "knots": "kn",
    "kph": "km/h",
    "fps": "ft/s",
    "fpm": "ft/min",
    "°C": "degC",
    "C": "degC",
    "°F": "degF",
}


def find_unit(unit: str, target: str) -> Unit:
    """How values in ``unit`` become values in ``target``.

    Args:
        unit: As written in a config; empty means ``target`` itself.
        target: The unit of the channel, of the table or not.

    Raises:
        ValueError: The unit is unknown, or measures something else than ``target``.
    """
    unit = _SPELLINGS.get(unit.strip(), unit.strip())
    plain = _SPELLINGS.get(target.strip(), target.strip())
    if unit in ("", plain, target):
        return Unit(target, 1.0)
    if unit not in UNITS:
        possible = units_of(plain) or list(UNITS)
        near = difflib.get_close_matches(unit, possible, 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise ValueError(
            f"unknown unit {unit!r}: {hint}expected one of {', '.join(possible)}; or leave the "
            f"unit out and give scale, the {plain} in one of it"
        )
    found, wanted = UNITS[unit], UNITS.get(plain, Unit(plain, 1.0))
    if found.base != wanted.base:
        fitting = ", ".join(units_of(plain)) or target
        raise ValueError(
            f"unit {unit!r} is converted to {found.base}, but {target} is needed: "
            f"expected one of {fitting}"
        )
    return Unit(plain, found.factor / wanted.factor, (found.offset - wanted.offset) / wanted.factor)


def units_of(target: str) -> list[str]:
    """All units of the table that can be converted to ``target``."""
    base = UNITS[target].base if target in UNITS else target
    return [name for name, unit in UNITS.items() if unit.base == base]
