"""Find where a simulator and measured logs disagree, and name the effect that is missing."""
