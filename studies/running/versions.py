"""Which versions made a result."""

from __future__ import annotations

import functools
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path

_PACKAGES = ("torch", "scikit-learn", "gpytorch", "pymunk", "numpy", "scipy", "gymnasium")
# Those that a result depends on only if they were loaded for it, by the name of their module.
_IF_LOADED = {"mujoco": "mujoco", "stable_baselines3": "stable-baselines3"}


def versions() -> dict[str, str]:
    """Versions of Python, of this package and of what the numbers depend on."""
    found = {"python": platform.python_version(), "simgap": own_version()}
    packages = [*_PACKAGES, *(p for module, p in _IF_LOADED.items() if module in sys.modules)]
    return found | {package: metadata.version(package) for package in packages}


@functools.cache
def own_version() -> str:
    """The version of this package, and in a checkout the commit, with a plus if files differ."""
    version, root = metadata.version("simgap"), Path(__file__).parents[2]
    if not (root / ".git").exists():
        return version
    command = ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return version
    return f"{version} ({done.stdout.strip()})"
