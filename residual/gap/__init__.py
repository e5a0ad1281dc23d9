"""Find where a simulator and measured logs disagree, and name the effect that is missing."""

from residual.gap.find import find_gap as find_gap
from residual.gap.result import GapResult as GapResult
