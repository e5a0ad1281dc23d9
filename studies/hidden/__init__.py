"""Effects hidden in data of known truth: made, judged by ``find_gap`` and its rivals, scored."""
