"""What the study of Leo reports."""
