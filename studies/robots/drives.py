"""How the shipped robots are driven while they are measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import sims.mujoco
from residual.trajectories import Trajectory
from studies.robots.truth import Array, Controller, Sensors, Truth

MODELS = Path(sims.mujoco.__file__).parent / "models"
ROBOTS = ("cart_pole", "arm2", "arm6", "hopper")


def measure(
    robot: str, hidden: dict[str, float], seed: int = 0, runs: int = 4, seconds: float = 7.5
) -> list[Trajectory]:
    """Records of a shipped robot that hides something.

    Args:
        robot: ``"cart_pole"``, ``"arm2"``, ``"arm6"`` or ``"hopper"``.
        hidden: See ``Truth``; empty if nothing is to be found.
        seed: Of motion and noise.
        runs: Number of records.
        seconds: Length of each; the hopper's end where it falls.
    """
    rng = np.random.default_rng(seed)
    truth = Truth(MODELS / f"{robot}.xml", hidden)
    sensors = Sensors()
    found = []
    for k in range(runs):
        name = f"{robot}-{k + 1:02d}"
        if robot == "hopper":
            start, controller = _hop(truth, rng)
            found.append(
                truth.run(controller, min(seconds, 2.5), sensors, rng, start, name, _fallen)
            )
            continue
        controller = _waves(truth, _REACH[robot], rng)
        found.append(truth.run(controller, seconds, sensors, rng, name=name))
    return found


#: Largest commands as shares of their range, and the band of their frequencies in Hz.
_REACH = {
    "cart_pole": ((0.6,), (0.3, 2.0)),
    "arm2": ((0.35, 0.35), (0.2, 2.5)),
    "arm6": ((0.35, 0.3, 0.35, 0.4, 0.4, 0.4), (0.1, 0.8)),
}


def _waves(
    truth: Truth, reach: tuple[Sequence[float], tuple[float, float]], rng: np.random.Generator
) -> Controller:
    """Sums of five sines on every input, held over control periods."""
    shares, (low, high) = reach
    size = np.asarray(shares) * truth.model.actuator_ctrlrange[:, 1]
    frequencies = rng.uniform(low, high, (len(size), 5))
    phases = rng.uniform(0, 2 * np.pi, frequencies.shape)
    weights = rng.uniform(0.4, 1.0, frequencies.shape)
    weights *= (size / weights.sum(axis=1))[:, None] * 1.6

    def command(t: float, q: Array, v: Array) -> Array:
        # A position servo is not asked for a jump at the start.
        ramp = min(1.0, t / 0.5)
        return np.asarray(
            ramp * (weights * np.sin(2 * np.pi * frequencies * t + phases)).sum(axis=1)
        )

    return command


def _hop(truth: Truth, rng: np.random.Generator) -> tuple[tuple[Array, Array], Controller]:
    """A start above the ground, and legs that crouch and stretch about once in a second."""
    model = truth.model
    q, v = np.array(model.qpos0), np.zeros(model.nv)
    q[1] = rng.uniform(0.0, 0.1)
    crouch = np.array([-0.5, 1.0, -0.5]) * rng.uniform(0.7, 1.1)
    q[3:] = crouch
    # The legs are shorter in a crouch, so the torso starts lower.
    q[1] -= 0.4 * (1 - np.cos(crouch[0])) + 0.4 * (1 - np.cos(crouch[0] + crouch[1]))
    v[0] = rng.uniform(-0.2, 0.4)
    period, phase = rng.uniform(0.5, 0.8), rng.uniform(0, 1)
    strength = rng.uniform(0.5, 0.9)
    gains = np.array([300.0, 300.0, 120.0]) / (model.actuator_gear[:, 0])

    def command(t: float, q: Array, v: Array) -> Array:
        stretched = 0.5 + 0.5 * np.sin(2 * np.pi * (t / period + phase))
        wanted = crouch * (1 - strength * stretched)
        # The torso is kept upright by the hip, as far as it can.
        wanted = wanted + np.array([0.5 * q[2] + 0.05 * v[2], 0.0, 0.0])
        return np.asarray(gains * (wanted - q[3:] - 0.05 * v[3:]))

    return (q, v), command


def _fallen(q: Array) -> bool:
    return bool(abs(q[2]) > 0.9 or q[1] < -0.6)
