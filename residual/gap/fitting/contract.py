"""What a fit of effects to windows is, and what finds it.

Systems without impacts and systems that strike the ground differ in how a window is fitted;
everything else (search, choice, confirmation, verdict) only knows what stands here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import Blocks
from residual.gap.data.samples import Samples
from residual.gap.fitting.noise import Noise
from residual.gap.fitting.where import Where
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model

if TYPE_CHECKING:
    from residual.gap.fitting.screening import Signatures

Array = NDArray[np.float64]

#: Loss over that of a model that this one holds, beyond which a fit did not converge.
UNCONVERGED = 1.001


@dataclasses.dataclass(frozen=True)
class Told:
    """What tells of the numbers of a model, linear about its fit.

    Attributes:
        residual: Residuals, weighed, (W, R).
        by_knob: Their derivative by the numbers, its sign turned, (W, R, p).
        taken: Numbers of each window that these were fitted with beside.
    """

    residual: Array
    by_knob: Array
    taken: int


@dataclasses.dataclass(frozen=True)
class Fit:
    """A model fitted to windows, each with its own free start state.

    Attributes:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        loss: Robust loss of every window, (W,).
        weights: What a unit of squared residual counts in every window, (W,).
        projected: Whitened residual with start states projected out, (W, R).
        by_knob: Its derivative by the numbers, (W, R, p).
        basis: Orthonormal basis of what start states can imitate, (W, R, f).
        converged: Whether the last step no longer lowered the loss.
        inner: What the fitter itself needs to go on from here.
        beyond: Where more than the windows tells of the numbers: that and they together.
        spread: Standard deviation of the numbers by the profile of the loss, (p,), if asked for.
    """

    model: Model
    theta: Array
    loss: Array
    weights: Array
    projected: Array
    by_knob: Array
    basis: Array
    converged: bool
    inner: Any
    beyond: Told | None = None
    spread: Array | None = None

    @property
    def told(self) -> Told:
        """What tells of the numbers."""
        if self.beyond is not None:
            return self.beyond
        root = np.sqrt(self.weights)[:, None]
        return Told(self.projected * root, self.by_knob * root[..., None], self.basis.shape[2])

    @property
    def merit(self) -> float:
        """Sum of the losses."""
        return float(self.loss.sum())


@dataclasses.dataclass(frozen=True)
class Foretold:
    """Forecasts over every window, started from a state fitted to its lead-in.

    Attributes:
        squares: Mean squared error over ``Fitter.seconds``, (W, m), in the channels' units squared.
        half: The same over the first half of the horizon.
        shown: What was foretold, (W, L, m), lead-in included.
    """

    squares: Array
    half: Array
    shown: Array


@dataclasses.dataclass(frozen=True)
class Left:
    """What a fit leaves.

    Attributes:
        adequate: Whether that is no more than noise, in every fold.
        ratio: Largest residual of a channel over its noise.
        force: What a force that would explain it follows, in words; empty if none stands out.
        by_channel: Residual over noise of every measured channel.
    """

    adequate: bool
    ratio: float
    force: str
    by_channel: tuple[float, ...]


class Fitter(Protocol):
    """Fits models to the windows of one table."""

    @property
    def samples(self) -> Samples:
        """The table."""

    @property
    def blocks(self) -> Blocks:
        """Its windows in blocks and folds."""

    @property
    def sigma(self) -> Array:
        """Weight of every measured channel: an error of this size counts one, (m,)."""

    @property
    def seconds(self) -> float:
        """Over how long errors of forecasts are told."""

    def halved(self) -> Fitter:
        """The same with half the integration step."""

    def from_longer_leads(self) -> Fitter:
        """The same with forecasts from start states fitted to twice as much of a window."""

    def weighed_like(self, other: Fitter) -> Fitter:
        """The same with the weights of another."""

    def fit(self, model: Model, theta: Array, near: Fit | None = None) -> Fit:
        """Numbers and start states of least loss, from ``theta`` on.

        Args:
            model: Simulator with effects; without unknowns only start states are fitted.
            theta: First guess of the numbers, (p,).
            near: A fit whose start states are worth starting from.
        """

    def profiled(self, fit: Fit) -> Fit:
        """A fit with numbers and their spread by the profile of the loss, if it needs one."""

    def resumed(self, model: Model, theta: Array, near: Fit) -> Fit:
        """The same from where a fit ended, of which ``model`` is an extension."""

    def columns(self, fit: Fit, candidates: Sequence[Candidate]) -> Array:
        """Change of the whitened output by all trials of candidates, (W, R, c)."""

    def foretell(self, model: Model, thetas: Array, which: NDArray[np.int64], fit: Fit) -> Foretold:
        """Forecasts over all windows.

        Args:
            model: Simulator with effects.
            thetas: Vectors of numbers, (V, p).
            which: Which of them each window has, (W,).
            fit: Where start states are sought from.
        """

    def redrawn(self, fit: Fit, sigma: Array, rng: np.random.Generator) -> Fitter:
        """The same windows filled with the fitted simulator's own motion and noise, sigma (m,)."""

    def left(self, fit: Fit, floor: Noise) -> Left:
        """What a fit leaves, beside the noise."""

    def where(self, nominal: Fit, floor: Noise) -> Where:
        """Where the nominal simulator fails."""

    def needed(self, around: Callable[[], Signatures], nominal: Fit) -> float:
        """Fall of the loss that earns an effect a name where only noise is left.

        Args:
            around: Gives the signatures of all candidates around the nominal simulator.
            nominal: Its fit.
        """

    def tie(self, nominal: Fit) -> float:
        """Difference of the loss beyond which a rival is excluded where only noise is left."""

    def chance(self, one: Fit, other: Fit) -> float:
        """The same for two fits, as far as it depends on them: luck in finding start states."""
