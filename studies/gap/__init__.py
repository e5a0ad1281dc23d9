"""The answer of ``find_gap``: its words, figures, report and files."""
