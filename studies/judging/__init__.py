"""How good any simulator is on measured runs, and the best that given effects could do."""
