"""The environments that ``gymnasium.make`` knows: the systems of the paper.

``import sims`` registers them. Everything heavier than a name is imported when an environment
is made.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register as register_environment

if TYPE_CHECKING:
    from sims.environment import SimulatorEnv


def idealised_pendulum(render_mode: str | None = None, **task: Any) -> SimulatorEnv:
    """The idealised pendulum (0.055 kg) with its swing-up task; ``task`` goes to ``SwingUp``."""
    from sims.environment import SimulatorEnv
    from sims.pendulum import Pendulum
    from sims.tasks import SwingUp

    return SimulatorEnv(Pendulum(), SwingUp(**task), render_mode)


def true_pendulum(render_mode: str | None = None, **task: Any) -> SimulatorEnv:
    """The true pendulum (0.090 kg) with its swing-up task; ``task`` goes to ``SwingUp``."""
    from sims.environment import SimulatorEnv
    from sims.pendulum import Pendulum
    from sims.tasks import SwingUp

    return SimulatorEnv(Pendulum.true(), SwingUp(**task), render_mode)


def register() -> None:
    """Make ``simgap/PendulumIdealised-v0`` and ``simgap/PendulumTrue-v0`` known."""
    register_environment(
        "simgap/PendulumIdealised-v0", entry_point="sims.registration:idealised_pendulum"
    )
    register_environment("simgap/PendulumTrue-v0", entry_point="sims.registration:true_pendulum")
