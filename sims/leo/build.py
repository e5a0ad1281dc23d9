"""What one Leo of a batch is made of."""

from __future__ import annotations

import dataclasses

from sims.leo.body import FOOT, SHANK, THIGH, Link, torso_with_load


@dataclasses.dataclass(frozen=True)
class Build:
    """What one row of a batch is made of; SI units, see ``sims.leo.simulator.leo_parameters``."""

    torso_mass: float
    torso_inertia: float
    arm_mass: float
    thigh_mass: float
    shank_mass: float
    foot_mass: float
    boom_mass: float
    gravity: float
    slope: float
    ground_friction: float


def links_of(build: Build) -> list[tuple[Link, float]]:
    """Torso, thighs, shanks and feet, with their masses."""
    torso = torso_with_load(build.torso_mass, build.torso_inertia, build.arm_mass, build.boom_mass)
    legs = [(THIGH, build.thigh_mass), (SHANK, build.shank_mass), (FOOT, build.foot_mass)]
    return [(torso, torso.mass), *(leg for leg in legs for _ in range(2))]
