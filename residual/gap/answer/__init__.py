"""From a choice to verdicts and tables, as plain data."""
