"""Seeds derived from one, and estimators in plain values: what tells one step from another."""

from __future__ import annotations

import zlib
from typing import Any

from sklearn.base import BaseEstimator, clone


def derived_seed(seed: int, *purpose: str) -> int:
    """A seed of its own for each purpose, the same on every machine."""
    return zlib.crc32("/".join([str(seed), *purpose]).encode())


def describe(estimator: BaseEstimator) -> dict[str, Any]:
    """The class and the settings of an estimator, in plain values."""
    kind = type(estimator)
    parameters = {name: repr(value) for name, value in estimator.get_params().items()}
    return {"class_path": f"{kind.__module__}.{kind.__qualname__}", "parameters": parameters}


def seeded(estimator: BaseEstimator, seed: int) -> BaseEstimator:
    """A clone with every unset ``random_state`` set."""
    copy = clone(estimator)
    unset = [
        name
        for name, value in copy.get_params().items()
        if name.split("__")[-1] == "random_state" and value is None
    ]
    return copy.set_params(**dict.fromkeys(unset, derived_seed(seed, "estimator") % 2**31))
