"""Rows of a pendulum with effects: their numbers as arrays for the compiled kernel."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sims.driven import DrivenJoint, Field
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.friction import CoulombFriction, DryFriction, StribeckFriction
from sims.effects.joint import (
    Cogging,
    ConstantLoad,
    CubicSpring,
    JointEffect,
    LinearSpring,
    NegativeStiffness,
    QuadraticDrag,
    Value,
    ViscousFriction,
)
from sims.kick import swing_rows
from sims.simulator import Array

C_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_double)

# Where the kernel keeps the numbers of an effect, and how they are called there and here.
COLUMNS = {name: i for i, name in enumerate((*DrivenJoint._fields[:10], *Field._fields[:2]))}
SPRINGS: dict[type[Effect], tuple[int, int]] = {  # sign and power of the distance
    LinearSpring: (1, 1),
    NegativeStiffness: (-1, 1),
    CubicSpring: (1, 3),
}
NUMBERS: dict[type[Effect], dict[str, str]] = {
    ViscousFriction: {"damping": "coefficient"},
    QuadraticDrag: {"drag": "coefficient"},
    ConstantLoad: {"constant": "load"},
    CoulombFriction: {"coulomb": "level"},
    StribeckFriction: {"sliding": "sliding", "breakaway": "breakaway", "speed": "speed"},
    Backlash: {"width": "width"},
}


def swing(
    states: Array,
    inputs: Array,
    durations: Array,
    motor: Mapping[str, Value],
    effects: Sequence[Any],
) -> Array:
    """Rows with effects after their durations.

    Args:
        states: (n, 2), then a place in each play; plays in a row are one of their sum.
        inputs: (n, 2 m): mean input in each half of m sub-steps.
        durations: (n,) seconds.
        motor: The pendulum without effects, by the names of ``sims.driven``;
            scalars or (n,).
        effects: On the joint, with scalars or (n,).

    Returns:
        States at the end, same shape.
    """
    n = len(states)
    full = np.zeros((n, 3))
    full[:, :2], full[:, 2] = states[:, :2], states[:, 2:].sum(axis=1)
    numbers = np.zeros((n, len(COLUMNS)))
    for name, value in motor.items():
        numbers[:, COLUMNS[name]] = value
    springs: list[Sequence[Value]] = []
    waves: list[Sequence[Value]] = []
    own: list[JointEffect] = []
    for effect in effects:
        if type(effect) in SPRINGS:
            sign, power = SPRINGS[type(effect)]
            springs.append((sign * effect.stiffness, effect.rest, power))
        elif type(effect) is Cogging:
            waves.append((effect.sine, effect.cosine, effect.order))
        elif type(effect) in NUMBERS and not (
            type(effect) is StribeckFriction and numbers[:, COLUMNS["speed"]].any()
        ):
            for column, name in NUMBERS[type(effect)].items():
                numbers[:, COLUMNS[column]] += getattr(effect, name)
        elif isinstance(effect, JointEffect):
            # The user's own, or a second one where the kernel has place for one.
            own.append(effect)
    tables = _table(n, springs), _table(n, waves)
    if not own:
        after = swing_rows(full, inputs, durations, numbers, *tables, (0, 0, 0))
        return _apart(after, effects)
    # Python is asked for these, with the numbers of one row at a time.
    after = np.empty_like(full)
    for i in range(n):
        row = slice(i, i + 1)
        with _Calls([effect.take(i) for effect in own]) as addresses:
            after[row] = swing_rows(
                full[row], inputs[row], durations[row], numbers[row], tables[0][row],
                tables[1][row], addresses,
            )  # fmt: skip
    return _apart(after, effects)


def _apart(states: Array, effects: Sequence[Any]) -> Array:
    """The place in the play parted among several, each by its share of the width."""
    plays = [effect for effect in effects if isinstance(effect, Backlash)]
    if len(plays) < 2:
        return states[:, : 2 + len(plays)]
    whole = sum(np.asarray(play.width) for play in plays)
    shares = [np.divide(p.width, whole, out=np.zeros(len(states)), where=whole > 0) for p in plays]
    return np.concatenate([states[:, :2], states[:, 2:] * np.stack(shares, axis=1)], axis=1)


def _table(n: int, entries: Sequence[Sequence[Value]]) -> Array:
    found = np.empty((n, len(entries), 3))
    for k, values in enumerate(entries):
        for column, value in enumerate(values):
            found[:, k, column] = value
    return found


class _Calls:
    """C functions for effects that are not compiled, with the numbers of one row.

    Used as a context, since an error cannot pass through compiled code: it is raised at the end.
    """

    def __init__(self, effects: Sequence[JointEffect]) -> None:
        present = [effect for effect in effects if not effect.absent]
        dry = [effect for effect in present if isinstance(effect, DryFriction)]
        smooth = [effect for effect in present if not isinstance(effect, DryFriction)]
        moving = [effect for effect in smooth if effect.follows_rate]
        standing = [effect for effect in smooth if not effect.follows_rate]
        self._errors: list[Exception] = []
        self._functions = [
            self._function(lambda q, v: sum(float(e.force(q, v)) for e in moving), moving),
            self._function(lambda v, _: sum(float(e.limit(v)) for e in dry), dry),
            self._function(lambda q, _: sum(float(e.force(q, 0.0)) for e in standing), standing),
        ]

    def __enter__(self) -> Any:
        """Addresses as ``sims.kick.swing_rows`` wants them."""
        return tuple(
            ctypes.cast(function, ctypes.c_void_p).value or 0 if function else 0
            for function in self._functions
        )

    def __exit__(self, *_: object) -> None:
        if self._errors:
            raise self._errors[0]

    def _function(
        self, force: Callable[[float, float], float], effects: Sequence[JointEffect]
    ) -> Any:
        def guarded(first: float, second: float) -> float:
            try:
                return force(first, second)
            except Exception as error:
                self._errors.append(error)
                return float("nan")

        return C_FUNCTION(guarded) if effects else None
