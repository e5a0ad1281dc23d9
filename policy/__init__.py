"""Learning a controller in any Gymnasium environment with box spaces: DDPG, for one core."""

from policy.config import DDPGConfig
from policy.ddpg import DDPG, Progress
from policy.evaluate import Policy, Rollout, action_of, collect, evaluate, rollout
from policy.learner import Algorithm, Learner, load_policy
from policy.mlp import MlpPolicy
from policy.noise import OrnsteinUhlenbeck
from policy.observations import Column, StateColumns
from policy.selection import Point, Selection, learn_and_select, score

__all__ = [
    "DDPG",
    "Algorithm",
    "Column",
    "DDPGConfig",
    "Learner",
    "MlpPolicy",
    "OrnsteinUhlenbeck",
    "Point",
    "Policy",
    "Progress",
    "Rollout",
    "Selection",
    "StateColumns",
    "action_of",
    "collect",
    "evaluate",
    "learn_and_select",
    "load_policy",
    "rollout",
    "score",
]
