"""What the benchmarks measured, as tables and figures."""
