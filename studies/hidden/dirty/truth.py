"""The true systems of the dirty world, written out for SciPy's LSODA and sharing no code with ours.

Beside at most one hidden effect they have what no library holds: parameters that are all a little
off, friction that is soft around zero speed or gives way elastically before it slides, a small
flexible part, and a sensor that filters.
"""

from __future__ import annotations

import bisect
import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import LSODA

from studies.hidden.dirty.systems import SYSTEMS

Array = NDArray[np.float64]
Input = Callable[[float], float]
G = 9.81
NOMINAL = {name: kind() for name, kind in SYSTEMS.items()}

#: Jumps closer than this in s are one.
_TINY = 1e-7
#: Nominal parameters, coordinates and inputs, by system; not how any of them moves it.
PARAMETERS = {
    name: {key: float(parameter.value) for key, parameter in made.parameters.items()}
    for name, made in NOMINAL.items()
}
COORDINATES = {name: [joint.name for joint in made.joints] for name, made in NOMINAL.items()}
INPUTS = {name: [c.name for c in made.action_channels] for name, made in NOMINAL.items()}
#: Inertia that a flexible part hangs on, roughly.
INERTIA = {"arm": 0.3, "two-link arm": 0.25, "cart": 1.2, "oven": 1.0}
#: Seconds in which the second thermal mass of the oven follows.
STORE_TIME = 4.0


@dataclasses.dataclass(frozen=True)
class Truth:
    """A true system.

    Attributes:
        system: Of ``PARAMETERS``.
        off: Relative error of the nominal parameters, by name.
        effect: Name of the hidden effect, empty for none.
        where: Coordinate, input or parameter that it acts on.
        strength: In its unit; for a parameter the absolute change.
        soft: Speed over which dry friction builds up.
        presliding: Distance that dry friction gives way elastically; 0 for the soft law.
        flexible: Share of the inertia that hangs on a spring, of the oven in a second thermal mass.
        resonance: Of that part, in Hz.
        filtered: Time constant of the sensors in s, 0 for none.
    """

    system: str
    off: Mapping[str, float]
    effect: str = ""
    where: str = ""
    strength: float = 0.0
    soft: float = 0.01
    presliding: float = 0.0
    flexible: float = 0.0
    resonance: float = 6.0
    filtered: float = 0.0

    def parameters(self) -> dict[str, float]:
        """Their true values."""
        found = {k: v * (1 + self.off.get(k, 0.0)) for k, v in PARAMETERS[self.system].items()}
        if self.effect in found:
            found[self.effect] += self.strength
        return found


def accelerations(
    system: str, p: Mapping[str, float], q: Sequence[float], v: Sequence[float],
    u: Sequence[float], f: Sequence[float],
) -> list[float]:  # fmt: skip
    """Second derivatives of the coordinates (the first one of the oven) under inputs and forces."""
    if system == "arm":
        moment = p["mass"] * p["length"]
        total = u[0] + f[0] - G * moment * math.sin(q[0])
        return [total / (p["inertia"] + moment * p["length"])]
    if system == "oven":
        return [(p["ambient"] - q[0] + p["gain"] * u[0]) / p["time_constant"] + f[0]]
    if system == "cart":
        m, length = p["pole_mass"], p["length"]
        sine, cosine = math.sin(q[1]), math.cos(q[1])
        # Newton for both masses, the tension of the pole eliminated.
        pulled = u[0] + f[0] - p["stiffness"] * q[0] - f[1] * cosine / length
        pulled += m * sine * (length * v[1] ** 2 + G * cosine)
        cart = pulled / (p["cart_mass"] + m * sine**2)
        return [cart, (f[1] / (m * length) - G * sine - cosine * cart) / length]
    m1, m2, l1, l2 = (p[k] for k in ("upper_mass", "lower_mass", "upper_length", "lower_length"))
    # Absolute angles: Lagrange's equations are shorter, and unlike those of the simulator.
    a, b = q[0], q[0] + q[1]
    av, bv = v[0], v[0] + v[1]
    elbow, shoulder = u[1] + f[1], u[0] + f[0]
    couple = m2 * l1 * l2 * math.cos(a - b)
    twist = m2 * l1 * l2 * math.sin(a - b)
    r1 = shoulder - elbow - twist * bv**2 - (m1 + m2) * G * l1 * math.sin(a)
    r2 = elbow + twist * av**2 - m2 * G * l2 * math.sin(b)
    m11, m22 = (m1 + m2) * l1**2, m2 * l2**2
    det = m11 * m22 - couple**2
    aa = (m22 * r1 - couple * r2) / det
    return [aa, (m11 * r2 - couple * r1) / det - aa]


def _shaped(effect: str, s: float, command: Input) -> Input:
    """What reaches an actuator, but for a lag."""
    if effect == "actuator_gain":
        return lambda t: (1 + s) * command(t)
    if effect == "actuator_bias":
        return lambda t: command(t) + s
    if effect == "delay":
        return lambda t: command(t - s)
    if effect == "dead_zone":
        return lambda t: math.copysign(max(abs(command(t)) - s, 0.0), command(t))
    return command


def simulate(
    truth: Truth, start: Sequence[float], commands: Sequence[Input], times: Array,
    breaks: Sequence[float],
) -> tuple[Array, Array]:  # fmt: skip
    """True motion as the sensors pass it on, and the true inputs.

    Args:
        truth: The system.
        start: Coordinates at rest, shape (c,).
        commands: One for each input.
        times: Increasing, shape (n,).
        breaks: Times at which a command jumps.

    Returns:
        Coordinates and their rates (n, 2 c) (of the oven the temperature alone, (n, 1)), and the
        input at the actuator, (n, inputs).
    """
    system, p = truth.system, truth.parameters()
    c, thermal = len(start), truth.system == "oven"
    paths = [
        _shaped(truth.effect, truth.strength, command) if truth.where == name else command
        for name, command in zip(INPUTS[system], commands, strict=True)
    ]
    lagged = INPUTS[system].index(truth.where) if truth.effect == "actuator_lag" else -1
    at = COORDINATES[system].index(truth.where) if truth.where in COORDINATES[system] else -1
    mass = truth.flexible * INERTIA[system]
    spring = mass * (2 * math.pi * truth.resonance) ** 2
    damper = 0.04 * math.sqrt(spring * mass)
    law, s = truth.effect, truth.strength
    # Layout: q, v, lagged input, flexible position and rate, bristle, filtered q and v.
    first = [*start, *([0.0] * c), paths[lagged](times[0]) if lagged >= 0 else 0.0]
    first += [start[0], 0.0, 0.0, *start, *([0.0] * c)]

    def inputs(t: float, y: Sequence[float]) -> list[float]:
        given = [path(t) for path in paths]
        if lagged >= 0:
            given[lagged] = y[2 * c]
        return given

    def change(t: float, y: Array) -> list[float]:
        state = y.tolist()
        q, v = state[:c], state[c : 2 * c]
        u = inputs(t, state)
        force = [0.0] * c
        bristle = 0.0
        if at >= 0:
            x, w = q[at], v[at]
            if law == "viscous_friction":
                force[at] -= s * w
            elif law == "quadratic_drag":
                force[at] -= s * w * abs(w)
            elif law == "linear_spring":
                force[at] -= s * x
            elif law == "constant_load":
                force[at] += s
            elif law == "coulomb_friction" and truth.presliding:
                # Dahl, "A solid friction model", Aerospace Corporation (1968).
                bend = state[2 * c + 3]
                bristle = w - abs(w) * bend / truth.presliding
                force[at] -= s * bend / truth.presliding
            elif law == "coulomb_friction":
                force[at] -= s * math.tanh(w / truth.soft)
        second, second_rate = state[2 * c + 1], state[2 * c + 2]
        hanging = 0.0
        if mass and not thermal:
            pull = spring * (second - q[0]) + damper * (second_rate - v[0])
            force[0] += pull
            hanging = -pull / mass
        elif mass:
            # A second thermal mass that follows slowly.
            flow = truth.flexible * (second - q[0]) / STORE_TIME
            force[0] += flow
            second_rate = (q[0] - second) / STORE_TIME
        rates = accelerations(system, p, q, v, u, force)
        moved = rates if thermal else v
        pushed = [0.0] * c if thermal else rates
        lag = (paths[lagged](t) - state[2 * c]) / s if lagged >= 0 else 0.0
        seen = state[2 * c + 4 :]
        smooth = (
            [(true - read) / truth.filtered for true, read in zip((*q, *v), seen, strict=True)]
            if truth.filtered
            else [0.0] * (2 * c)
        )
        return [*moved, *pushed, lag, second_rate if mass else 0.0, hanging, bristle, *smooth]

    path = _integrate(change, first, times, breaks)
    seen = path[:, 2 * c + 4 :] if truth.filtered else path[:, : 2 * c]
    given = np.array([inputs(t, y) for t, y in zip(times, path.tolist(), strict=True)])
    seen = np.array(seen)
    if law == "sensor_offset":
        seen[:, at] += s
    return (seen[:, :1] if thermal else seen), given


def _integrate(
    change: Callable[[float, Array], list[float]], first: Sequence[float], times: Array,
    breaks: Sequence[float],
) -> Array:  # fmt: skip
    """LSODA, begun anew at every jump of the inputs."""
    edges = [float(times[0])]
    for t in sorted(breaks):
        # Two that coincide, as of two inputs at once or of an input and its late echo, are one.
        if edges[-1] + _TINY < t < times[-1] - _TINY:
            edges.append(t)
    edges.append(float(times[-1]))
    path = np.empty((len(times), len(first)))
    y = np.array(first)
    path[0] = y
    done = 1
    for begin, end in itertools.pairwise(edges):
        # Just short of the jump on either side, so that it is never stepped over.
        tiny = 1e-9 * (end - begin)
        solver = LSODA(change, begin + tiny, y, end - tiny, rtol=1e-7, atol=1e-9)
        while solver.status == "running":
            solver.step()
            stop = bisect.bisect_right(times, solver.t) if done < len(times) else done
            if stop > done:
                path[done:stop] = solver.dense_output()(times[done:stop]).T
                done = stop
        if solver.status == "failed":
            raise ArithmeticError(f"LSODA gave up at {solver.t:.4g} s")
        y = solver.y
        if done < len(times) and times[done] <= end + 1e-12:
            path[done] = y
            done += 1
    return path
