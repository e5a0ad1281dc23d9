"""The shipped models, and rows to try them with."""

from pathlib import Path

import numpy as np

import sims.mujoco
from sims.mujoco import MujocoSimulator

MODELS = Path(sims.mujoco.__file__).parent / "models"
NAMES = ("cart_pole", "arm2", "arm6", "hopper")


def robot(name, **options):
    return MujocoSimulator(str(MODELS / f"{name}.xml"), **options)


def rows(simulator, n=32, seed=0):
    """Random states, the hopper's above and in the ground, and controls."""
    rng = np.random.default_rng(seed)
    states = simulator.smooth_states(n, rng)
    if simulator.has_contacts:
        states[:, 1] = rng.uniform(-0.15, 0.1, n)
    actions = np.stack(
        [rng.uniform(-0.6, 0.6, n) * c.scale for c in simulator.action_channels], axis=1
    )
    return states, actions
