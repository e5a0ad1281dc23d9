"""Sets of effects: grown, forecast, chosen."""
