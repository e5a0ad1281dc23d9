"""How a command runs: its options, its trials, its workers, its progress, its files."""
