"""The environments that ``gymnasium.make`` knows: the systems of the paper.

``import sims`` registers them. Everything heavier than a name is imported when an environment
is made.
"""

from __future__ import annotations

from collections.abc import Collection
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


def idealised_leo(
    render_mode: str | None = None,
    observed: Collection[str] | None = None,
    stops: bool = False,
    **task: Any,
) -> SimulatorEnv:
    """The idealised Leo with its walking task.

    Args:
        render_mode: As for every environment of Gymnasium.
        observed: See ``SimulatorEnv``; ``sims.leo.walking.AUTHORS_OBSERVATION`` is the authors'.
        stops: Whether the joints have mechanical stops.
        task: Goes to ``sims.leo.walking.Walking``.
    """
    from sims.environment import SimulatorEnv
    from sims.leo.simulator import Leo
    from sims.leo.walking import Walking

    return SimulatorEnv(Leo(stops=stops), Walking(**task), render_mode, observed)


def true_leo(
    render_mode: str | None = None,
    observed: Collection[str] | None = None,
    stops: bool = False,
    **task: Any,
) -> SimulatorEnv:
    """The true Leo (heavier torso, joints with friction); arguments as for ``idealised_leo``."""
    from sims.environment import SimulatorEnv
    from sims.leo.simulator import Leo
    from sims.leo.walking import Walking

    return SimulatorEnv(Leo.true(stops=stops), Walking(**task), render_mode, observed)


def register() -> None:
    """Make ``simgap/PendulumIdealised-v0``, ``simgap/LeoTrue-v0`` and the like known."""
    for name, maker in (
        ("PendulumIdealised", "idealised_pendulum"),
        ("PendulumTrue", "true_pendulum"),
        ("LeoIdealised", "idealised_leo"),
        ("LeoTrue", "true_leo"),
    ):
        register_environment(f"simgap/{name}-v0", entry_point=f"sims.registration:{maker}")
