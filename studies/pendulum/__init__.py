"""What the study of the pendulum reports."""
