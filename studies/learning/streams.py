"""Random streams: one of its own for every purpose, all from one seed."""

from __future__ import annotations

import hashlib
from typing import Any

from sklearn.base import BaseEstimator, clone

from residual.estimator import unset_seeds

# Rollouts count on from a seed, so streams begin this far apart.
_APART = 20


def stream(seed: int, *purpose: str | int) -> int:
    """Where the random numbers of one purpose begin, the same on every machine.

    Args:
        seed: Of the trial.
        purpose: What they are for, and of which round, such as ``"collect", 2``.

    Returns:
        A seed of 63 bits; the 2^20 seeds from it on are no other purpose's.
    """
    text = "/".join(str(part) for part in (seed, *purpose))
    number = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")
    return (number >> (1 + _APART)) << _APART


def seeded(estimator: BaseEstimator, seed: int) -> BaseEstimator:
    """A clone with every unset ``random_state`` set."""
    copy: Any = clone(estimator, safe=False)
    if not hasattr(copy, "get_params"):
        return copy
    # Half of a stream's beginning: scikit-learn takes 32 bits.
    own = (stream(seed, "estimator") >> _APART) % 2**31
    return copy.set_params(**dict.fromkeys(unset_seeds(copy), own))
