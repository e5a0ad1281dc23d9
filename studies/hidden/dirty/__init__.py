"""A dirty world: one effect hidden among things that no library holds, truth by SciPy."""
