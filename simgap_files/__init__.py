"""Files that are right or absent: written whole, sealed by checksums, read without running code."""
