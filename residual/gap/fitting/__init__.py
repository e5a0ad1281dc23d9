"""Numbers of effects from windows, and what forecasts by them err."""
