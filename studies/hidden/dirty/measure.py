"""How the dirty world is driven and measured."""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from residual.trajectories import Trajectory
from studies.hidden.dirty.truth import COORDINATES, INPUTS, Array, Truth, simulate

Layout = Literal["ramp", "single", "many"]

#: Largest input of each actuator, by system.
REACH = {
    "arm": (4.0,),
    "two-link arm": (6.0, 1.5),
    "cart": (6.0,),
    "oven": (20.0,),
}
#: Typical size of each coordinate and its rate, for noise and rounding.
SIZES = {
    "arm": (1.0, 3.0),
    "two-link arm": (0.7, 0.7, 3.0, 3.0),
    "cart": (0.3, 0.4, 1.0, 2.0),
    "oven": (15.0,),
}


@dataclasses.dataclass(frozen=True)
class Sensors:
    """What stands between the motion and the log.

    Attributes:
        noise: Standard deviation, as a share of the typical size of each channel.
        coloured: Share of the noise that is correlated over some samples.
        rounded: Step of the positions, as a share of their typical size; 0 for none.
        rates: Whether rates are measured.
        summed: The first position is the running sum of its measured rate.
        jitter: Standard deviation of the sample times, as a share of the period.
        dropped: Share of samples that are missing.
        input_noise: Of a measured input, as a share of its reach; None if the command is logged.
    """

    noise: float = 0.003
    coloured: float = 0.7
    rounded: float = 0.0
    rates: bool = True
    summed: bool = False
    jitter: float = 0.0
    dropped: float = 0.0
    input_noise: float | None = None


def _record(
    truth: Truth, sensors: Sensors, name: str, period: float, seconds: float, drive: float,
    rng: np.random.Generator, noise: np.random.Generator,
) -> Trajectory:  # fmt: skip
    """One measured run: ``rng`` drives it, ``noise`` is the source of all that the sensors add."""
    count = int(seconds / period) + 1
    times = period * np.arange(count, dtype=float)
    if sensors.jitter:
        times[1:-1] += period * np.clip(
            sensors.jitter * noise.standard_normal(count - 2), -0.4, 0.4
        )
    reach = [drive * most for most in REACH[truth.system]]
    thermal = truth.system == "oven"
    slow = 8.0 if thermal else 1.0
    commands: list[Callable[[float], float]] = []
    breaks: list[float] = []
    for most in reach:
        if sensors.input_noise is None:
            level, jumps = _levels(times, most, slow, thermal, rng)
            commands.append(level)
            breaks += jumps
        else:
            commands.append(_sines(most, slow, thermal, rng))
    late = truth.strength if truth.effect == "delay" else 0.0
    breaks += [t + late for t in breaks] if late else []
    c = len(COORDINATES[truth.system])
    start = [295.0] if thermal else (0.3 * rng.standard_normal(c)).tolist()
    motion, given = simulate(truth, start, commands, times, breaks)
    states = _read(truth.system, motion, times, sensors, noise)
    if sensors.input_noise is None:
        actions = np.array([[command(t) for command in commands] for t in times[:-1]])
        actions = actions.reshape(count - 1, len(INPUTS[truth.system]))
        jumped = np.append(True, np.any(np.diff(actions, axis=0) != 0, axis=1))
    else:
        size = sensors.input_noise * np.array(REACH[truth.system])
        actions = (given + size * noise.standard_normal(given.shape))[:-1]
        jumped = np.zeros(count - 1, bool)
    keep = np.ones(count, bool)
    if sensors.dropped:
        keep[1:-1] = (noise.random(count - 2) >= sensors.dropped) | jumped[1:]
    return Trajectory(name, times[keep], states[keep], actions[keep[:-1]])


def _levels(
    times: Array, most: float, slow: float, positive: bool, rng: np.random.Generator
) -> tuple[Callable[[float], float], list[float]]:
    """Random levels that begin at sample times and hold for a while."""
    begins, values, k = [], [], 0
    period = float(times[1] - times[0])
    while k < len(times) - 1:
        begins.append(float(times[k]))
        values.append(float(rng.uniform(0 if positive else -most, most)))
        k += max(1, round(slow * rng.uniform(0.1, 0.6) / period))

    def command(t: float) -> float:
        return values[max(0, bisect.bisect_right(begins, t + 1e-9) - 1)]

    return command, begins[1:]


def _sines(
    most: float, slow: float, positive: bool, rng: np.random.Generator
) -> Callable[[float], float]:
    """A sum of sines, as a smooth controller would command."""
    waves = [
        (
            float(rng.uniform(0.2, 1.0)),
            float(rng.uniform(0.2, 1.6)) / slow,
            float(rng.uniform(0, 6)),
        )
        for _ in range(5)
    ]
    total = sum(size for size, _, _ in waves)

    def command(t: float) -> float:
        wave = sum(a * math.sin(2 * math.pi * f * t + phase) for a, f, phase in waves) / total
        return most * (0.5 + 0.5 * wave if positive else 1.6 * wave)

    return command


def _read(
    system: str, motion: Array, times: Array, sensors: Sensors, rng: np.random.Generator
) -> Array:
    """States in the order of the simulator's channels: each position before its rate."""
    sizes = np.array(SIZES[system])
    white = rng.standard_normal(motion.shape)
    # A memory of five samples.
    white[1:] *= math.sqrt(1 - 0.82**2)
    slow = lfilter([1.0], [1.0, -0.82], white, axis=0)
    fresh = rng.standard_normal(motion.shape)
    mixed = math.sqrt(sensors.coloured) * slow + math.sqrt(1 - sensors.coloured) * fresh
    seen = motion + sensors.noise * sizes * mixed
    c = 1 if system == "oven" else motion.shape[1] // 2
    q, v = seen[:, :c], seen[:, c:]
    if sensors.summed:
        # A sensor of the rate alone, which drifts as it is summed up.
        steps = np.diff(times)[:, None]
        q[:, :1] = motion[0, :1] + np.vstack([[0.0], np.cumsum(v[:-1, :1] * steps, axis=0)])
    if sensors.rounded:
        step = sensors.rounded * sizes[:c]
        q = step * np.round(q / step)
    if system == "oven":
        return q
    if not sensors.rates:
        v = np.full_like(v, np.nan)
    return np.stack([q, v], axis=2).reshape(len(times), 2 * c)


def records(
    truth: Truth, sensors: Sensors, layout: Layout, period: float, seconds: float,
    seed: Sequence[int],
) -> list[Trajectory]:  # fmt: skip
    """A log: several runs driven harder and harder, one long run, or many short ones alike.

    Args:
        truth: The system.
        sensors: How it is measured.
        layout: ``"ramp"``, ``"single"`` or ``"many"``.
        period: Between samples in s.
        seconds: Length of all runs together.
        seed: Of drive and noise.
    """
    drives: list[float] = {
        "ramp": np.linspace(0.25, 1.0, 6).tolist(), "single": [0.8], "many": [0.8] * 12
    }[layout]  # fmt: skip
    found = []
    for number, share in enumerate(drives):
        rng, noise = np.random.default_rng([*seed, number]).spawn(2)
        name, each = f"run {number + 1:02d}", seconds / len(drives)
        found.append(_record(truth, sensors, name, period, each, share, rng, noise))
    return found
