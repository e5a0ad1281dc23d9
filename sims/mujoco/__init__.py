"""MuJoCo models (MJCF, URDF) as simulators that host effects; needs the extra ``mujoco``."""

from sims.mujoco.effects import AttributeChange as AttributeChange
from sims.mujoco.simulator import MujocoSimulator as MujocoSimulator
