"""The paper's loop, and what every study of it shares: settings, stages, records, tables."""
