"""Measure MuJoCo models for ``python -m studies.benchmarks --mujoco``: JSON on standard output."""

import json

from tests.benchmarks.mujoco_speed import speeds
from tests.benchmarks.mujoco_sysid import rivals

if __name__ == "__main__":
    print(json.dumps({"speeds": speeds(), "rivals": rivals()}))
