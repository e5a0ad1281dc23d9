"""Units of numbers that are products of others: of a friction, of a store."""

from __future__ import annotations

import re
from collections.abc import Mapping

# One unit of a product, perhaps raised to a power.
_FACTOR = re.compile(r"([^\s^()*]+?)(?:\^(-?\d+))?")


def product(dimension: Mapping[str, int], measures: Mapping[str, tuple[str, float]]) -> str:
    """Unit of a product of powers: ``force=1, rate=-1`` is ``"N m s/rad"``."""
    powers: dict[str, int] = {}
    for kind, power in dimension.items():
        first, *others = measures[kind][0].split("/")
        for unit, sign in [(first, power), *((other, -power) for other in others)]:
            for factor, own in _factors(unit):
                if factor != "1":
                    powers[factor] = powers.get(factor, 0) + sign * own
    above = [_power(unit, power) for unit, power in powers.items() if power > 0]
    below = [_power(unit, -power) for unit, power in powers.items() if power < 0]
    under = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return (" ".join(above) or "1") + (f"/{under}" if under else "")


def _factors(unit: str) -> list[tuple[str, int]]:
    """Units and their powers in a product, ``N m^2``; what is written otherwise as it is."""
    found = [_FACTOR.fullmatch(factor) for factor in unit.split()]
    return [(f[1], int(f[2] or 1)) for f in found if f] if all(found) else [(unit, 1)]


def _power(unit: str, power: int) -> str:
    return unit if power == 1 else f"{unit}^{power}"
