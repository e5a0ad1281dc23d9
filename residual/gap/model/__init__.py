"""A simulator with candidate effects, as a function of numbers."""
