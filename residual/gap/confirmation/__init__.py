"""How sure what was chosen is."""
