"""Robots of known truth: logs that MuJoCo simulates finely, and how often find_gap is right."""
