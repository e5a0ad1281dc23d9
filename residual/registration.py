"""The corrected pendulum as an environment that ``gymnasium.make`` knows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register as register_environment

if TYPE_CHECKING:
    from sims.environment import SimulatorEnv


def corrected_pendulum(
    difference: str | Path, render_mode: str | None = None, **task: Any
) -> SimulatorEnv:
    """The idealised pendulum corrected by a saved difference model, with its swing-up task.

    Args:
        difference: File that ``residual.save`` wrote; loading it runs no code from it.
        render_mode: ``"rgb_array"`` or None.
        **task: Passed to ``sims.tasks.SwingUp``.
    """
    from residual.corrected import CorrectedSimulator
    from residual.persistence import load
    from sims.environment import SimulatorEnv
    from sims.pendulum import Pendulum
    from sims.tasks import SwingUp

    simulator = Pendulum()
    corrected = CorrectedSimulator(simulator, load(Path(difference), simulator))
    return SimulatorEnv(corrected, SwingUp(**task), render_mode)


def register() -> None:
    """Make ``simgap/PendulumCorrected-v0`` known."""
    register_environment(
        "simgap/PendulumCorrected-v0", entry_point="residual.registration:corrected_pendulum"
    )
