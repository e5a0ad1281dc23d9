"""Control steps per second of rows with their own attributes, beside MuJoCo's bare rollout."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np

from sims.mujoco import MujocoSimulator
from sims.mujoco.rows import threads
from studies.robots.cases import nominal
from studies.robots.drives import ROBOTS

#: Rows, control steps of each, and rounds that take turns.
ROWS, STEPS, ROUNDS = 1024, 25, 5


def speeds() -> list[dict[str, Any]]:
    """Control steps per second of processor time of every shipped model, medians of the rounds.

    On as many threads as ``OMP_NUM_THREADS`` allows.

    Returns:
        ``robot``; ``ours``, of rows that differ in the masses of all bodies and the damping of all
        joints; ``alike``, of rows of the nominal; ``bare``, of ``mujoco.rollout`` of the nominal
        model, all steps in one call; ``share``, of ours in bare.
    """
    return [_speed(robot) for robot in ROBOTS]


def _speed(robot: str) -> dict[str, Any]:
    simulator = nominal(robot)
    rng = np.random.default_rng(0)
    start = simulator.smooth_states(ROWS, rng)
    actions = np.stack(
        [0.2 * c.scale * rng.uniform(-1, 1, (ROWS, STEPS)) for c in simulator.action_channels],
        axis=2,
    )
    values = {
        name: parameter.value * rng.uniform(0.9, 1.1, ROWS)
        for name, parameter in simulator.parameters.items()
        if name.startswith(("mass of body", "damping of joint"))
    }
    varied = simulator.with_parameters(**values)

    def ours(of: MujocoSimulator) -> None:
        states = start
        for k in range(STEPS):
            states = of.step(states, actions[:, k])

    model = simulator.model
    data = [mujoco.MjData(model) for _ in range(threads())]
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    initial = np.zeros((ROWS, size))
    initial[:, 1 : 1 + model.nq + model.nv] = start
    control = np.repeat(actions, simulator.substeps, axis=1)
    with mujoco.rollout.Rollout(nthread=threads()) as roll:
        found = np.array(
            [
                [
                    _seconds(lambda: ours(varied)),
                    _seconds(lambda: ours(simulator)),
                    _seconds(lambda: roll.rollout(model, data, initial, control)),
                ]
                for _ in range(ROUNDS + 1)
            ]
        )
    own, alike, bare = ROWS * STEPS / np.median(found[1:], axis=0)
    return {"robot": robot, "ours": own, "alike": alike, "bare": bare, "share": own / bare}


def _seconds(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin
