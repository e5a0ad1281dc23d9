"""Leo, the paper's biped on a boom: the robot on Pymunk, and the task of walking with it."""

from sims.leo.simulator import Leo
from sims.leo.walking import Walking, measure_walk

__all__ = ["Leo", "Walking", "measure_walk"]
