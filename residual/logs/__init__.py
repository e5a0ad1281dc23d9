"""Measured logs (text, Parquet, NPZ, MCAP, HDF5, data sets) as trajectories in SI units."""

from residual.logs.checks import Finding
from residual.logs.layout import Column, LogFormat
from residual.logs.read import LogData, read_logs
from residual.logs.table import LogError

__all__ = ["Column", "Finding", "LogData", "LogError", "LogFormat", "read_logs"]
