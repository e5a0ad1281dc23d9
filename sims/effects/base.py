"""What every named physical effect has: numbers with units, a place, a plain sentence."""

from __future__ import annotations

import abc
import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from sims.effects.dimensions import product

if TYPE_CHECKING:
    from sims.host import HostSimulator

Role = Literal["strength", "shape", "fixed"]
#: What two joints have, or feel: numbers, or arrays with one entry per row.
Both = tuple[Any, Any]


@dataclasses.dataclass(frozen=True)
class Quantity:
    """What is known about one number of an effect once it sits in a simulator.

    Args:
        unit: SI unit.
        scale: Size at which the effect is comparable to what the simulator does already;
            finite differences take a small share of it.
        low, high: Bounds; what dissipates or stores energy is not negative.
        role: ``"strength"`` (at ``nominal`` the effect is absent), ``"shape"`` (fitted too,
            meaningless without strength), or ``"fixed"`` (given by the user).
        nominal: Value at which the effect is absent; zero but for the level of a saturation.
        starts: Values that a search should begin from, empty if any small one will do.
        integer: True if only whole numbers make sense.
        bold: Value from which the effect is fitted in full whatever small trials say, if they can
            mislead: what holds a joint at rest does nothing that is in proportion to its size.
        above: Name of a number of the effect below which this one does nothing more.
    """

    unit: str
    scale: float
    low: float
    high: float
    role: Role
    nominal: float
    starts: tuple[float, ...]
    integer: bool
    bold: float | None = None
    above: str = ""

    @property
    def fitted(self) -> bool:
        """Whether data decide it: a strength, or a shape that is not a whole number."""
        return self.role == "strength" or (self.role == "shape" and not self.integer)


def number(
    default: float = 0.0,
    *,
    role: Role = "strength",
    low: float = -math.inf,
    high: float = math.inf,
    nominal: float = 0.0,
    share: float = 1.0,
    starts: tuple[float, ...] = (),
    integer: bool = False,
    bold: float | None = None,
    above: str = "",
    **dimension: int,
) -> Any:
    """A numeric field of an effect.

    Args:
        default: Value when none is given.
        role, low, high, nominal, integer, above: See ``Quantity``.
        bold: See ``Quantity``, as a multiple of the typical size.
        share: The scale, as a share of the typical size of the dimension.
        starts: Values worth starting a search from, as multiples of the same typical size.
        dimension: Exponents of what the host names: ``force``, ``position``, ``rate`` (of the
            joint), ``input``, ``time``, ``channel`` or ``parameter``; viscous friction has
            ``force=1, rate=-1``.
    """
    known = {
        "role": role,
        "low": low,
        "high": high,
        "nominal": nominal,
        "share": share,
        "starts": starts,
        "integer": integer,
        "bold": bold,
        "above": above,
        "dimension": dimension,
    }
    return dataclasses.field(default=default, metadata=known)


@dataclasses.dataclass(frozen=True)
class Effect(abc.ABC):
    """One named piece of physics; subclasses are frozen dataclasses.

    A user's own effect derives from ``JointEffect``, ``DryFriction``, ``StaticActuatorEffect``
    or ``SensorEffect`` in any file and is named by its import path::

        @dataclasses.dataclass(frozen=True)
        class FanTorque(JointEffect):
            level: float = number(force=1, rate=-3, low=0.0)
            name = "fan_torque"
            sentence = "A torque that grows with the cube of speed."
            needs = "fast motion"

            def force(self, q, v):
                return -self.level * v * v * v

    The first field says where it acts (``joint``, ``actuator``, ``channel`` or ``parameter``),
    the fields made by ``number`` say how much: scalars or, one per row of a batch, arrays.

    Attributes:
        name: Its name in the field, ``"viscous_friction"``.
        sentence: What it is, in one plain sentence.
        enters: ``"joint"``, ``"actuator"``, ``"sensor"`` or ``"parameter"``.
        needs: What data must contain to show it.
        family: What effects that differ in form more than in kind have in common, such as
            ``"dissipation"``; empty if it stands alone. ``family_in`` asks for it.
        subfamily: What a part of the family has in common beside that, ``"dry friction"``.
        special_cases: Names of effects that it is equal to at some of its values, as Stribeck's
            friction with equal levels is Coulomb's: data that show one of these fit it as well.
        upstream_of_sensor: True if it acts before an input that was measured at the actuator's
            output, so that such a record holds its consequence already.
        holds_still: True if up to a size of its own nothing moves: forces of friction, or inputs.
        drives: True if it makes an input stronger or weaker in proportion.
        looks_like: What outside the library moves a system in the same way if the effect is in all
            its inputs, in words.
        creeps: True if it is a constant that is seldom one for long, as zeros of sensors are.
        pushes: True if to most logs it is a constant push.
        comes_with: Name of an effect that is usually there, too, where it is.
        whole: Names of numbers at whose upper bound it is a law of its own, and whole.
        turns: Part of a turn that data have to cover for it to be told from what does not turn.
        compound: True if its strengths are parts of one size, so that any one of them may be zero.
    """

    name: ClassVar[str]
    sentence: ClassVar[str]
    enters: ClassVar[Literal["joint", "actuator", "sensor", "parameter"]]
    needs: ClassVar[str]
    family: ClassVar[str] = ""
    subfamily: ClassVar[str] = ""
    special_cases: ClassVar[tuple[str, ...]] = ()
    upstream_of_sensor: ClassVar[bool] = False
    holds_still: ClassVar[bool] = False
    drives: ClassVar[bool] = False
    creeps: ClassVar[bool] = False
    pushes: ClassVar[bool] = False
    comes_with: ClassVar[str] = ""
    whole: ClassVar[tuple[str, ...]] = ()
    turns: ClassVar[float] = 0.0
    compound: ClassVar[bool] = False
    looks_like: ClassVar[str] = ""

    @property
    def where(self) -> str:
        """The joint, actuator, channel or parameter that it acts on."""
        return getattr(self, dataclasses.fields(self)[0].name)

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the two joints that it acts between; empty if it acts on one place."""
        return ()

    @property
    def surprising(self) -> bool:
        """Whether its size or its kind is rarer than others', so that what explains as much and is
        not comes first."""
        return False

    def contains(self, other: Effect) -> bool:
        """Whether another effect is a special case of it at the same place."""
        return other.name in self.special_cases and self.where == other.where

    def covers(self, other: Effect) -> bool:
        """Whether another effect beside it would be there twice."""
        return self.contains(other)

    @classmethod
    def numbers(cls) -> tuple[str, ...]:
        """Names of the numeric fields."""
        return tuple(name for name, known in _known(cls).items() if "dimension" in known)

    @classmethod
    def strengths(cls) -> tuple[str, ...]:
        """Names of the fields that make the effect vanish at their nominal value."""
        return tuple(name for name, known in _known(cls).items() if known.get("role") == "strength")

    def present(self) -> Any:
        """Whether it does anything: a bool, or per row an array of them."""
        known = _known(type(self))
        there: Any = False
        for name in self.strengths():
            there = there | (np.asarray(getattr(self, name)) != known[name].get("nominal"))
        return there

    @functools.cached_property
    def absent(self) -> bool:
        """True at zero strength (in every row)."""
        return not np.any(self.present())

    @property
    def rows(self) -> int | None:
        """Number of rows if some value is an array with one entry per row."""
        sizes = {
            np.size(getattr(self, name)) for name in self.numbers() if np.ndim(getattr(self, name))
        }
        if len(sizes) > 1:
            raise ValueError(f"{self.name}: values for {sorted(sizes)} rows, expected one number")
        return sizes.pop() if sizes else None

    def take(self, index: Any) -> Self:
        """The effect for some rows of a batch: values given per row are indexed."""
        values = {name: getattr(self, name) for name in self.numbers()}
        arrays = {name: value[index] for name, value in values.items() if np.ndim(value)}
        return dataclasses.replace(self, **arrays) if arrays else self

    def with_values(self, **values: ArrayLike) -> Self:
        """A copy with other numbers; arrays hold one entry per row."""
        return dataclasses.replace(
            self, **{k: np.asarray(v, float) if np.ndim(v) else v for k, v in values.items()}
        )

    def where_turn_is(self, turn: float) -> Self:
        """The same where a whole turn of the position is ``turn``, if it goes by turns."""
        return self

    def suited_to(self, low: float, high: float) -> Self:
        """The effect as it is looked for in readings, or commands, between two values."""
        return self

    def quantities(self, simulator: HostSimulator) -> dict[str, Quantity]:
        """Unit, scale, bounds and role of every numeric field in this simulator."""
        measures = self.measures(simulator)
        found = {}
        for field in dataclasses.fields(self):
            known = field.metadata
            if "dimension" not in known:
                continue
            typical = math.prod(
                measures[kind][1] ** power for kind, power in known["dimension"].items()
            )
            found[field.name] = Quantity(
                unit=product(known["dimension"], measures),
                scale=_tidy(known["share"] * typical),
                low=known["low"],
                high=known["high"],
                role=known["role"],
                nominal=known["nominal"],
                starts=tuple(_tidy(start * typical) for start in known["starts"]),
                integer=known["integer"],
                above=known["above"],
                bold=None if known["bold"] is None else _tidy(known["bold"] * typical),
            )
        return found

    @abc.abstractmethod
    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of each dimension where the effect acts.

        Raises:
            ValueError: The simulator has no such place; the message lists those it has.
        """

    def family_in(self, simulator: HostSimulator) -> str:
        """Its family where it acts, an empty string if it stands alone."""
        return self.family

    def __str__(self) -> str:
        return f"{self.name}@{self.where}"


@functools.cache
def _known(kind: type[Effect]) -> dict[str, Mapping[str, Any]]:
    """What the fields of a class say of themselves; asked for at every step of a simulation."""
    return {field.name: field.metadata for field in dataclasses.fields(kind)}


def _tidy(value: float) -> float:
    """Without the dust of a product of decimal fractions: 0.1 x 3 is 0.3."""
    return float(f"{value:.12g}")


def place(kind: str, name: str, known: Mapping[str, Any]) -> Any:
    """``known[name]``, or a ValueError that lists what there is."""
    if name not in known:
        there = ", ".join(known) or "none"
        raise ValueError(f"there is no {kind} {name!r} in this simulator; it has: {there}")
    return known[name]
