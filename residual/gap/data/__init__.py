"""What was recorded, before any physics: samples, faults, windows, blocks over folds."""
