"""Find where a simulator and measured logs disagree, and name the physical effect that is missing."""
