"""How else a log may be read, and whether it is explained better so."""
