"""Measured rigs: what one would write down first, and how far a correction brings it."""
