"""The true pendulum with play in its drive, integrated from contact to contact.

The motor turns its gear freely while the play is open and moves the pendulum only while the play
is closed on the side to which it pushes; its own inertia is neglected. Every change between the
two is an event that SciPy locates, so nothing is smoothed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from studies.hidden.data import Array, Truth

#: Share of the play that an opening begins with.
HAIR = 1e-8


def integrate_play(truth: Truth, states: Array, gaps: Array, volts: Array, seconds: float) -> Array:
    """Advance every column under constant volts.

    Args:
        truth: Its ``backlash`` is the width of the play in rad.
        states: shape (5, n), as ``Truth.derivative`` takes them.
        gaps: Where the drive is in its play, within half the width of 0; shape (n,), changed in
            place.
        volts: shape (n,).
        seconds: How far.

    Returns:
        States, shape (5, n).
    """
    after = np.empty_like(states)
    for i, volt in enumerate(volts):
        after[:, i], gaps[i] = _one(truth, states[:, i], float(gaps[i]), float(volt), seconds)
    return after


def _one(
    truth: Truth, state: Array, gap: float, volt: float, seconds: float
) -> tuple[Array, float]:
    half = truth.backlash / 2
    input_volts = np.array([volt])
    begin = 0.0

    def pushes(y: Array) -> float:
        """Rate at which the free drive would cross the play, of the drive force's sign."""
        return float(truth.free_speed(y[:5, None], input_volts)[0])

    side = float(np.sign(gap)) if abs(gap) >= half else 0.0
    y = np.append(state, gap)
    while begin < seconds:
        if side and side * pushes(y) < 0:
            y[5] = half * side * (1 - HAIR)
            side = 0.0

        def derivative(t: float, y: Array, closed: bool = side != 0) -> Array:
            rates = truth.derivative(y[:5, None], input_volts, closed)[:, 0]
            return np.append(rates, 0.0 if closed else pushes(y))

        def lets_go(t: float, y: Array, side: float = side) -> float:
            return side * pushes(y)

        def reaches(t: float, y: Array) -> float:
            return half - abs(float(y[5]))

        event = lets_go if side else reaches
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(
            derivative, (begin, seconds), y, "DOP853", events=event, rtol=1e-8, atol=1e-9,
            first_step=min(seconds - begin, 0.01),
        )  # fmt: skip
        if found.status < 0:
            raise ArithmeticError(f"DOP853 gave up at {found.t[-1]:.4g} s with {truth}")
        begin, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            # A hair inside, so that the rounded start of an opening is not taken for its end.
            y[5] = half * np.sign(y[5]) * (1 - HAIR if side else 1)
            side = 0.0 if side else float(np.sign(y[5]))
    return y[:5], float(y[5])
