"""What is settled before the search: horizon, numerics, what the log may count otherwise."""
