"""Learning a controller in any Gymnasium environment with box spaces: DDPG, for one core."""

from policy.config import DDPGConfig
from policy.ddpg import DDPG, Progress
from policy.evaluate import Policy, Rollout, collect, evaluate, rollout
from policy.mlp import MlpPolicy
from policy.noise import OrnsteinUhlenbeck
from policy.selection import Point, Selection, learn_and_select, score

__all__ = [
    "DDPG",
    "DDPGConfig",
    "MlpPolicy",
    "OrnsteinUhlenbeck",
    "Point",
    "Policy",
    "Progress",
    "Rollout",
    "Selection",
    "collect",
    "evaluate",
    "learn_and_select",
    "rollout",
    "score",
]
