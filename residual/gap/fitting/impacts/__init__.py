"""Finding the gap of systems that strike the ground: short windows, each with one robust vote."""
