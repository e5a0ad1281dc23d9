"""Units of logged columns: Pint converts them to the unit of their channel, at the border only."""

from __future__ import annotations

import difflib
import functools
import math
import re
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import pint

#: Spellings that Pint does not know, or knows for something else (Nm, a measure of yarn; kmph, a
#: thousand mph).
_DEFINED = (
    "newton_meter = newton * meter = Nm",
    "newton_centimeter = newton * centimeter = Ncm",
    "newton_millimeter = newton * millimeter = Nmm",
    "foot_per_minute = foot / minute = fpm",
    "@alias turn = rev",
    "@alias kilometer_per_hour = kmph",
    "@alias standard_gravity = gn",
)
#: What a symbol also stands for, where its first meaning cannot be: ``C`` is a charge or degC.
_ALSO = {"C": "degC", "F": "degF", "g": "gn"}
#: What logs usually count in: suggested, and asked for where a log may count in another unit.
USUAL = (
    *("%", "s", "ms", "us", "ns", "min", "h", "rad", "mrad", "deg", "rev", "rad/s", "mrad/s"),
    *("deg/s", "rev/s", "rpm", "rad/s2", "deg/s2", "m", "km", "cm", "mm", "um", "in", "ft", "nmi"),
    *("m/s", "cm/s", "mm/s", "km/h", "kn", "mph", "ft/s", "ft/min", "m/s2", "cm/s2", "mm/s2", "gn"),
    *("V", "mV", "kV", "A", "mA", "W", "mW", "kW", "ohm", "kohm", "N", "mN", "kN", "N m", "mN m"),
    *("kN m", "N cm", "N mm", "kgf", "kg", "g", "lb", "K", "mK", "degC", "degF", "Pa", "mPa"),
    *("hPa", "kPa", "bar", "mbar", "psi", "L", "mL", "m3/s", "m3/h", "L/s", "L/min", "mL/min"),
    *("Hz", "kHz"),
)
#: Symbols with exponents of one digit, multiplied or divided: nothing that takes long to work out.
_SYMBOL = r"(?:[^\W\d_]+|[°%][CF]?)(?:\*\*-?\d|\^-?\d|-?\d|⁻?[¹²³])?"
_PLAIN = re.compile(rf"(?:1 ?/ ?)?{_SYMBOL}(?: ?[ */·.] ?{_SYMBOL})*")
_BARE_POWER = re.compile(r"(?<=[^\W\d_])\^?(-?\d)")
_LONGEST = 40


class Unit(NamedTuple):
    """``factor * value + offset`` is the value in the channel's unit."""

    factor: float
    offset: float = 0.0


class _Root(NamedTuple):
    """A unit in Pint's base units; angles are one of them, so that 1/s is not taken for rad/s."""

    base: str
    factor: float
    offset: float = 0.0


@functools.cache
def find_unit(unit: str, target: str) -> Unit:
    """How values in ``unit`` become values in ``target``.

    Args:
        unit: As written in a config or a header; empty means ``target`` itself.
        target: The unit of the channel, which may be none that anybody else knows.

    Raises:
        ValueError: The unit is unknown, or measures something else than ``target``.
    """
    unit, target = unit.strip(), target.strip()
    if unit in ("", target):
        return Unit(1.0)
    wanted = _root(target)
    possible = [found for one in (unit, _ALSO.get(unit)) if one and (found := _root(one))]
    for found in possible:
        if wanted and found.base == wanted.base:
            offset = (found.offset - wanted.offset) / wanted.factor
            return Unit(found.factor / wanted.factor, offset)
    usual = units_of(target)
    what = f"unit {unit!r} cannot be converted to {target}: "
    if not (possible and wanted):
        near = difflib.get_close_matches(unit, usual, 1)
        what = f"unknown unit {unit!r}: " + (f"did you mean {near[0]!r}? " if near else "")
    expected = f"expected one of {', '.join(usual)}; or " if len(usual) > 1 else ""
    raise ValueError(
        f"{what}{expected}leave the unit out and give scale, the {target} in one of it"
    )


@functools.cache
def units_of(target: str) -> list[str]:
    """Usual units that can be converted to ``target``, itself among them."""
    wanted = _root(target)
    if wanted is None:
        return [target]
    fitting = [name for name in USUAL if (root := _root(name)) and root.base == wanted.base]
    return fitting if target in fitting else [target, *fitting]


def other_units(unit: str) -> list[tuple[str, Unit]]:
    """Usual units that values may be in but are not, with what they are in this one."""
    units = [(name, find_unit(name, unit)) for name in units_of(unit)]
    return [(name, other) for name, other in units if other != Unit(1.0)]


@functools.cache
def _root(unit: str) -> _Root | None:
    """The unit in base units; None if it is unknown, or no straight line leads there."""
    text = "dimensionless" if unit == "1" else unit
    if len(text) > _LONGEST or not _PLAIN.fullmatch(text):
        return None
    import pint  # not above: it takes longer than reading most logs, which need none of it

    registry = _registry()
    try:
        parsed = registry.parse_units(_BARE_POWER.sub(r"**\1", text), as_delta=True)
        factor, base = registry.get_root_units(parsed, check_nonmult=False)
        zero, one, two = (float(registry.convert(x, parsed, base)) for x in (0.0, 1.0, 2.0))
    except (pint.PintError, ArithmeticError, ValueError, TypeError):
        return None
    if not math.isclose(two - one, one - zero):
        return None
    return _Root(str(base), float(str(factor)), zero)


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(on_redefinition="ignore")
    for definition in _DEFINED:
        registry.define(definition)
    return registry
