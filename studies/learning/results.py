"""What the steps leave beside trainings: samples, difference models and their accuracy."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from pathlib import Path
from typing import Any

from residual.difference import DifferenceModel
from residual.persistence import is_ours, load, save
from residual.trajectories import Transitions


@dataclasses.dataclass(frozen=True)
class Samples:
    """True transitions."""

    data: Transitions
    key: str = ""

    def save(self, folder: Path) -> None:
        """Write them."""
        self.data.save(folder / "transitions.npz")

    @classmethod
    def load(cls, folder: Path, key: str) -> Samples:
        """Read what ``save`` wrote."""
        return cls(Transitions.load(folder / "transitions.npz"), key)


@dataclasses.dataclass(frozen=True)
class Model:
    """A difference model, and what it was fitted to."""

    difference: DifferenceModel
    data: Transitions
    fit_seconds: float
    key: str = ""

    def save(self, folder: Path) -> None:
        """Write it; another library's estimator is fitted again by ``load``."""
        self.data.save(folder / "transitions.npz")
        (folder / "fit.json").write_text(json.dumps({"fit_seconds": self.fit_seconds}))
        if is_ours(self.difference.fitted()):
            with contextlib.suppress(TypeError):
                save(self.difference, folder / "difference.safetensors")

    @classmethod
    def load(cls, folder: Path, key: str, unfitted: DifferenceModel) -> Model:
        """Read what ``save`` wrote."""
        data = Transitions.load(folder / "transitions.npz")
        saved = folder / "difference.safetensors"
        difference = load(saved, unfitted.simulator) if saved.exists() else unfitted.fit(data)
        seconds = json.loads((folder / "fit.json").read_text())["fit_seconds"]
        return cls(difference, data, seconds, key)


@dataclasses.dataclass(frozen=True)
class Measured:
    """Accuracy by place: ``visited`` and, where the truth can be set, ``uniform``."""

    accuracy: dict[str, Any]
    key: str = ""

    def save(self, folder: Path) -> None:
        """Write it."""
        (folder / "accuracy.json").write_text(json.dumps(self.accuracy))

    @classmethod
    def load(cls, folder: Path, key: str) -> Measured:
        """Read what ``save`` wrote."""
        return cls(json.loads((folder / "accuracy.json").read_text()), key)
