"""Walking with Leo: reward, falls and start poses, and how a walk is measured."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from sims.leo.body import COORDINATES, GEAR, MOTORS, centre_of_mass, clearance
from sims.leo.simulator import RESISTANCE, TORQUE_CONSTANT
from sims.simulator import Array
from sims.tasks import Task

TURNING = ("pitch", *MOTORS)
AUTHORS_OBSERVATION = (*TURNING, *(f"{name}_rate" for name in TURNING))
"""The 14 channels that the authors' policies saw: no height, no speed of the torso."""

POSE = dict(zip(COORDINATES, (0.0, 0.0, 0.0, 0.0, 0.82, -0.02, -1.27, 0.0, 0.0), strict=True))
"""Standing on the left leg with the right one swung forward, in rad."""

SPREAD = np.deg2rad(5.0)
STRAIGHT = -0.02
"""Knees start flexed at least this much, in rad."""

FALLEN_PITCH, FALLEN_ANKLE, FALLEN_BY = 1.0, 0.36 * np.pi, 0.15


@dataclasses.dataclass(frozen=True)
class Walking(Task):
    """Walk far with little work: r = 300 dx - 1.5 - 2 W - 75 on a fall (paper, section IV-B).

    dx is how far the centre of mass of the whole (idealised) robot moved forward, in m; W the
    electrical work of the motors in J, see ``electrical_work``.

    A fall: the torso leans by more than 1 rad or is 0.15 m below its height on straight legs,
    or an ankle is turned by more than 0.36 pi.

    Args:
        horizon: Steps per episode; 667 steps of 0.03 s are the paper's 20 s.
        start_at: ``"pose"`` starts standing on the left leg, as tests do; ``"around"`` with
            every joint up to 5 degrees from there, as learning does.
        knees: ``"fall"`` if overstretching a knee is a fall too, as in the authors' code, or
            ``"free"``.
        dt: Control period in seconds.
    """

    horizon: int = 667
    start_at: Literal["pose", "around"] = "pose"
    knees: Literal["fall", "free"] = "fall"
    dt: float = 0.03

    def start(self, rng: np.random.Generator) -> Array:
        """A start state (18,): at rest, the lowest wheel on the ground."""
        state = np.zeros(18)
        state[:9] = list(POSE.values())
        if self.start_at == "around":
            state[3:9] += rng.uniform(-SPREAD, SPREAD, 6)
            state[5:7] = np.minimum(state[5:7], STRAIGHT)
        state[1] -= clearance(state[None, :9]).min()
        return state

    def reward(self, states: Array, actions: Array, next_states: Array) -> Array:
        """Reward per step, from states as in ``STATE_CHANNELS`` and actions in V."""
        ahead = centre_of_mass(next_states[:, :9])[:, 0] - centre_of_mass(states[:, :9])[:, 0]
        work = electrical_work(states, actions, next_states, self.dt)
        return 300 * ahead - 1.5 - 2 * work - 75 * self.terminal(next_states)

    def terminal(self, next_states: Array) -> np.ndarray:
        """True where Leo has fallen."""
        fallen = (
            (np.abs(next_states[:, 2]) > FALLEN_PITCH)
            | (np.abs(next_states[:, 7:9]) > FALLEN_ANKLE).any(axis=1)
            | (next_states[:, 1] < -FALLEN_BY)
        )
        if self.knees == "fall":
            fallen |= (next_states[:, 5:7] > 0).any(axis=1)
        return fallen


def electrical_work(
    states: Array,
    actions: Array,
    next_states: Array,
    dt: float = 0.03,
    constant: float | None = None,
) -> Array:
    """Work in J that the motors take up in each control period, shape (n,).

    dt times the sum over motors of max(0, U I), I = (U - K w) / R, with the mean w of the
    joint's rate before and after; none is fed back.

    Args:
        states, actions, next_states: shape (n, 18), (n, 6), (n, 18).
        dt: Control period in seconds.
        constant: K in N m/A; by default with the gear.
    """
    k = TORQUE_CONSTANT if constant is None else constant
    rates = 0.5 * (states[:, 12:18] + next_states[:, 12:18])
    current = (actions - k * rates) / RESISTANCE
    return dt * np.maximum(actions * current, 0.0).sum(axis=1)


@dataclasses.dataclass(frozen=True)
class Walk:
    """What one episode amounts to.

    Args:
        distance: m, of the torso.
        time: s until the fall or the end.
        fell: Whether it ended in a fall.
        work: J, electrical, with the motor constant referred to the joint, as in the reward.
        work_without_gear: J, the same with the bare motor constant, which neglects nearly all
            of the back-EMF; it is the reading that gives the paper's 98 to 111 J/m.
        score: Sum of the rewards.
    """

    distance: float
    time: float
    fell: bool
    work: float
    work_without_gear: float
    score: float


def measure_walk(states: Array, actions: Array, task: Walking | None = None) -> Walk:
    """Measure one episode.

    Args:
        states: shape (T + 1, n_s), the start first.
        actions: shape (T, 6) in V.
        task: Its rules; by default the paper's.
    """
    task = task or Walking()
    states, actions = np.asarray(states, float), np.asarray(actions, float)
    fallen = task.terminal(states[1:])
    steps = int(fallen.argmax()) + 1 if fallen.any() else len(actions)
    before, actions, after = states[:steps], actions[:steps], states[1 : steps + 1]
    bare = TORQUE_CONSTANT / GEAR
    return Walk(
        distance=float(after[-1, 0] - before[0, 0]),
        time=steps * task.dt,
        fell=bool(fallen.any()),
        work=float(electrical_work(before, actions, after, task.dt).sum()),
        work_without_gear=float(electrical_work(before, actions, after, task.dt, bare).sum()),
        score=float(task.reward(before, actions, after).sum()),
    )
