"""What is learnt about the gap between a simulator and the system it stands for.

Names are loaded when they are used: importing this package pulls in neither PyTorch nor
GPyTorch.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from residual.registration import register

if TYPE_CHECKING:
    from residual.accuracy import Accuracy, accuracy_along
    from residual.corrected import CorrectedSimulator
    from residual.difference import DifferenceModel
    from residual.dropout_net import DropoutNet
    from residual.ensemble import Ensemble
    from residual.gaussian_process import GaussianProcess
    from residual.linear import Linear
    from residual.named_effects import NamedEffects
    from residual.persistence import load, save

__all__ = [
    "Accuracy",
    "CorrectedSimulator",
    "DifferenceModel",
    "DropoutNet",
    "Ensemble",
    "GaussianProcess",
    "Linear",
    "NamedEffects",
    "accuracy_along",
    "load",
    "save",
]

_HOMES = {
    "CorrectedSimulator": "corrected",
    "DifferenceModel": "difference",
    "DropoutNet": "dropout_net",
    "Ensemble": "ensemble",
    "GaussianProcess": "gaussian_process",
    "Linear": "linear",
    "NamedEffects": "named_effects",
    "Accuracy": "accuracy",
    "accuracy_along": "accuracy",
    "load": "persistence",
    "save": "persistence",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'residual' has no attribute {name!r}")
    return getattr(importlib.import_module(f"residual.{_HOMES[name]}"), name)


register()
