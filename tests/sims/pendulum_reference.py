"""The pendulum's equations written out once more, for SciPy: independent of ``sims``."""

import itertools
import math

import numpy as np
from scipy.integrate import solve_ivp

G, DAMPING, K, R, LENGTH, INERTIA = 9.81, 3e-6, 0.0536, 9.5, 0.042, 1.91e-4
TIGHT = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}


def motor(u, w):
    return K / R * (u - K * w)


def smooth_step(
    state, u, extra=lambda q, w: 0.0, mass=0.055, inertia=INERTIA, length=LENGTH, jumps=(), dt=0.05
):
    """One control period; ``u`` is a voltage or a function of time that may jump at ``jumps``."""
    voltage = u if callable(u) else lambda t: u

    def rates(t, y):
        torque = mass * G * length * math.sin(y[0]) - DAMPING * y[1] + motor(voltage(t), y[1])
        return [y[1], (torque + extra(y[0], y[1])) / inertia]

    edges = [0.0, *jumps, dt]
    for start, end in itertools.pairwise(edges):
        inner = (start + 1e-13, end - 1e-13)
        state = solve_ivp(rates, inner, state, **TIGHT).y[:, -1]
    return state


def dry_step(state, u, limit, dt=0.05):
    """One control period with dry friction, from event to event.

    ``limit(w, side)`` is its size against sliding to a side, or a pull to it at rest.
    """
    q, w = state
    t = 0.0
    while t < dt - 1e-12:
        pull = 0.055 * G * LENGTH * math.sin(q) + motor(u, 0.0)
        if abs(w) < 1e-9:
            if abs(pull) <= limit(0.0, math.copysign(1.0, pull)):
                return np.array([q, 0.0])
            side = math.copysign(1.0, pull)
        else:
            side = math.copysign(1.0, w)

        def rates(_, y, side=side):
            torque = 0.055 * G * LENGTH * math.sin(y[0]) - DAMPING * y[1] + motor(u, y[1])
            return [y[1], (torque - side * limit(abs(y[1]), side)) / INERTIA]

        def stops(t, y, side=side, t0=t):
            return side * y[1] if t > t0 + 1e-9 else 1.0

        stops.terminal, stops.direction = True, -1
        found = solve_ivp(rates, (t, dt), [q, w], events=stops, **TIGHT)
        t = found.t[-1]
        q, w = found.y[:, -1]
        if found.status == 1:
            w = 0.0
    return np.array([q, w])


def play_step(state, u, width, dt=0.05):
    """One control period with play between motor and pivot; state (angle, rate, place)."""
    y, t, edge = np.array(state, float), 0.0, width / 2
    while t < dt - 1e-12:
        push = motor(u, y[1])
        side = math.copysign(1.0, y[2]) if abs(y[2]) > edge - 1e-10 else 0.0
        closed = side != 0 and side * push > 0

        def rates(_, y, closed=closed):
            torque = 0.055 * G * LENGTH * math.sin(y[0]) - DAMPING * y[1]
            run = 0.0 if closed else u / K - y[1]
            return [y[1], (torque + (motor(u, y[1]) if closed else 0.0)) / INERTIA, run]

        def ends(t, y, closed=closed, side=side, t0=t):
            if t < t0 + 1e-9:
                return 1.0
            return side * motor(u, y[1]) if closed else edge - abs(y[2])

        ends.terminal, ends.direction = True, -1
        found = solve_ivp(rates, (t, dt), y, events=ends, max_step=2e-3, **TIGHT)
        t, y = found.t[-1], found.y[:, -1]
    return y
