"""Control steps per second of rows with their own attributes, beside MuJoCo's bare rollout."""

from __future__ import annotations

import dataclasses
import time

import mujoco
import mujoco.rollout
import numpy as np

from sims.mujoco import MujocoSimulator
from sims.mujoco.rows import threads
from studies.robots.cases import nominal
from studies.robots.drives import ROBOTS


@dataclasses.dataclass(frozen=True)
class Speed:
    """Control steps per second of processor time, medians of rounds that take turns.

    Attributes:
        robot: The shipped model.
        ours: Rows that differ in the masses of all bodies and the damping of all joints.
        alike: Rows of the nominal.
        bare: ``mujoco.rollout`` of the nominal model, all steps in one call.
    """

    robot: str
    ours: float
    alike: float
    bare: float


def speeds(rows: int = 1024, steps: int = 25, rounds: int = 5) -> list[Speed]:
    """Every shipped model, on as many threads as ``OMP_NUM_THREADS`` allows."""
    return [_speed(robot, rows, steps, rounds) for robot in ROBOTS]


def _speed(robot: str, rows: int, steps: int, rounds: int) -> Speed:
    simulator = nominal(robot)
    rng = np.random.default_rng(0)
    start = simulator.smooth_states(rows, rng)
    actions = np.stack(
        [0.2 * c.scale * rng.uniform(-1, 1, (rows, steps)) for c in simulator.action_channels],
        axis=2,
    )
    values = {
        name: parameter.value * rng.uniform(0.9, 1.1, rows)
        for name, parameter in simulator.parameters.items()
        if name.startswith(("mass of body", "damping of joint"))
    }
    varied = simulator.with_parameters(**values)

    def ours(of: MujocoSimulator) -> None:
        states = start
        for k in range(steps):
            states = of.step(states, actions[:, k])

    model = simulator.model
    data = [mujoco.MjData(model) for _ in range(threads())]
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    initial = np.zeros((rows, size))
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
                for _ in range(rounds + 1)
            ]
        )
    rates = rows * steps / np.median(found[1:], axis=0)
    return Speed(robot, *map(float, rates))


def _seconds(work: object) -> float:
    begin = time.process_time()
    work()  # type: ignore[operator]
    return time.process_time() - begin


def table(found: list[Speed]) -> str:
    """Markdown."""
    lines = [
        "| model | rows that differ | rows alike | `mujoco.rollout` | share |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {s.robot} | {s.ours:,.0f} | {s.alike:,.0f} | {s.bare:,.0f} | {s.ours / s.bare:.2f} |"
        for s in found
    ]
    return "\n".join(lines)
