"""The pendulum study on a pendulum that takes one Euler step: a trial lasts a second."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from sims.pendulum import Pendulum
from sims.simulator import Simulator
from sims.system import System
from sims.tasks import SwingUp
from studies import pendulum_gap
from studies.learning.command import run_command


class EulerPendulum(Simulator):
    """A pendulum under a torque of 0.5 Nm/V times the voltage."""

    name = "Euler pendulum"
    dt = 0.05
    state_channels = Pendulum().state_channels
    action_channels = Pendulum().action_channels

    def __init__(self, gravity: float = 9.81) -> None:
        self.gravity = gravity
        self.parameters = {}

    def step(self, states, actions):
        states, actions = self.check_rows(states, actions)
        rate = states[:, 1] + self.dt * (
            self.gravity * np.sin(states[:, 0]) + 0.5 * actions[:, 0] - 0.5 * states[:, 1]
        )
        return np.stack([states[:, 0] + self.dt * rate, rate], axis=1)


def system_of(trial) -> System:
    return System("quick", EulerPendulum(), EulerPendulum(gravity=14.0), SwingUp(horizon=50))


STUDY = dataclasses.replace(pendulum_gap.STUDY, system=system_of)


def main(arguments: Sequence[str] | None = None) -> None:
    run_command(STUDY, arguments)


if __name__ == "__main__":
    # By its importable name, which worker processes need to find the same classes.
    import quick_gap

    quick_gap.main()
