"""Where rival sets of effects are refitted: fixed windows, one noise, one threshold."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.candidates import Candidate
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.shooting import Fit, capped, fit
from residual.gap.signatures import Signatures, gains, signatures
from residual.gap.windows import Windows
from sims.host import HostSimulator

Array = NDArray[np.float64]
Key = tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Settings:
    """How hard to search.

    Args:
        singles: Effects that enter a round by their own gain.
        pairs: Pairs that enter a round.
        swaps: Exchanges that enter a round.
        most: Largest number of effects chosen.
        share: Smallest part of the noise energy worth a name; it binds in long logs, where
            chance alone would let effects in that change the residual by a thousandth.
        part: Smallest part of the squared error that an effect must remove as long as a
            remainder well above the noise is left; it bears on leads only, since what leaves
            such a remainder is reported as unexplained.
        nominal_turns: Gauss-Newton iterations of the nominal simulator.
        first_turns, more_turns: The same of all rivals, and of the close ones.
        runs: Training runs that the tournament sees; the final fit sees all.
        close: Rivals refitted on all training runs.
        finest: Smallest noise that is believed, as a share of each state's typical variation:
            below it integrators differ, not physics.
    """

    singles: int = 5
    pairs: int = 2
    swaps: int = 3
    most: int = 3
    share: float = 0.004
    part: float = 0.15
    nominal_turns: int = 6
    first_turns: int = 3
    more_turns: int = 5
    runs: int = 6
    close: int = 4
    finest: float = 1e-5


class Arena:
    """Fixed windows of some runs, on which rival sets of effects are refitted.

    Args:
        nodes: Smoothed path of the physical states, where every refit starts.
        by_state: Derivatives by the state there.

    Attributes:
        tried: Every refitted set: sorted candidate numbers -> fit.
    """

    def __init__(
        self,
        simulator: HostSimulator,
        candidates: Sequence[Candidate],
        samples: Samples,
        windows: Windows,
        nodes: Array,
        by_state: Array,
        sigma: Array,
        scale: Array,
        settings: Settings,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.simulator, self.candidates = simulator, list(candidates)
        self.samples, self.windows = samples, windows
        self.sigma, self.scale, self.settings, self.tell = sigma, scale, settings, tell
        self.size = int(
            np.isfinite(samples.seen[windows.index[windows.inside]][:, samples.measured]).sum()
        )
        self.cap = np.inf
        self.nodes = nodes
        self.tried: dict[Key, Fit] = {}
        nominal = self._fit(Model(simulator), nodes, np.zeros(0), settings.nominal_turns, None)
        rows = windows.inside.sum(axis=1).max() * len(samples.measured)
        self.cap = 20 * max(float(np.median(nominal.costs)), float(rows))
        self.tried[()] = dataclasses.replace(
            nominal, cap=self.cap, merit=capped(nominal.costs, self.cap)
        )
        self.by_state = by_state
        self._signatures: dict[Key, Signatures] = {}
        self.material = settings.share * self.size
        self.noise_gain = 16.0
        self.threshold = max(self.noise_gain, self.material)

    def _fit(
        self, model: Model, nodes: Array, theta: Array, turns: int, by_state: Array | None,
        widths: float = 0.3,
    ) -> Fit:  # fmt: skip
        nodes = model.widen(self.samples, nodes[:, : model.physical], theta)
        if by_state is not None and by_state.shape[1] != model.width:
            by_state = None
        return fit(
            model, self.samples, self.windows, nodes, theta, self.sigma, model.scales(self.scale),
            iterations=turns, cap=self.cap, by_state=by_state, widths=widths,
        )  # fmt: skip

    def calibrate(self, found: Signatures) -> None:
        """Set the threshold from no-gap redraws: noise alone pushed through the same signatures.

        The largest gain over all candidates is recorded for each redraw of the noise, and the
        threshold is the 99.9 % point of a Gumbel law fitted to these maxima.
        """
        rng = np.random.default_rng(0)
        size = np.sqrt(np.maximum(found.strengths, 1e-300))
        alive = found.strengths > 1e-9 * max(found.strengths.max(initial=0.0), 1e-300)
        if not alive.any():
            return
        unit = found.matrix[:, alive] / size[alive]
        # The Gram matrix of unit signatures is the covariance of their products with the noise.
        values, vectors = np.linalg.eigh(unit.T @ unit)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn = root @ rng.standard_normal((len(values), 400))
        largest = (drawn**2).max(axis=0)
        spread = largest.std() * np.sqrt(6) / np.pi
        point = largest.mean() - 0.5772 * spread - spread * np.log(-np.log(0.999))
        self.noise_gain = float(point)
        self.threshold = max(self.noise_gain, self.material)

    def score(self, key: Key) -> float:
        """Cost plus the price of the unknowns; lower is better."""
        found = self.tried[key]
        return found.merit + np.log(self.size) * len(found.theta)

    def near_floor(self, key: Key) -> bool:
        """Whether a set leaves little more than noise."""
        return self.tried[key].merit < 1.3 * self.size

    def far_off(self, key: Key) -> bool:
        """Whether what a set leaves is so large that its path is not the measured one."""
        return self.tried[key].merit > 9 * self.size

    def refit(self, base: Fit, sets: dict[Key, list[Array]], most: bool = False) -> None:
        """Refit sets of candidates from start values, those near the best for longer.

        Args:
            base: Where nodes start.
            sets: Candidate numbers (sorted) -> list of start vectors.
            most: Give every set all iterations.
        """
        settings = self.settings
        for key, starts in sets.items():
            for theta in starts:
                model = Model(self.simulator, [self.candidates[i] for i in key])
                theta = np.clip(theta, model.low, model.high)
                # From the measured path, not from a rival's: that may be in a wrong basin.
                found = self._fit(model, self.nodes, theta, settings.first_turns, self.by_state)
                if key not in self.tried or found.merit < self.tried[key].merit:
                    self.tried[key] = found
        if not sets:
            return
        merits = {key: self.tried[key].merit for key in sets}
        best = min(merits.values())
        reach = base.merit - best
        for key, merit in merits.items():
            if most or base.merit - merit > 0.7 * reach:
                self.polish(key)

    def polish(self, key: Key) -> None:
        """More iterations for one set, with small finite differences at the end."""
        found = self.tried[key]
        turns = self.settings.more_turns
        again = self._fit(found.model, found.nodes, found.theta, turns, None, 0.05)
        if again.merit < found.merit:
            self.tried[key] = again

    def alone(self, candidate: Candidate) -> Fit:
        """Fit of an effect that takes no part in the tournament."""
        nominal = self.tried[()]
        found = signatures(nominal, self.samples, self.windows, self.sigma, [candidate])
        (start,) = gains(found)[0].values
        model = Model(self.simulator, [candidate])
        theta = np.clip(start, model.low, model.high)
        rough = self._fit(model, self.nodes, theta, self.settings.first_turns, self.by_state)
        return self._fit(model, rough.nodes, rough.theta, self.settings.more_turns, None, 0.05)

    def signatures(self, key: Key) -> Signatures:
        """Signatures of all candidates around a fitted set."""
        if key not in self._signatures:
            self._signatures = {
                key: signatures(
                    self.tried[key], self.samples, self.windows, self.sigma, self.candidates
                )
            }
        return self._signatures[key]

    def signatures_of_path(self, key: Key) -> Signatures:
        """The same along the measured path, which a fitted set far from it does not follow."""
        found = self.tried[key]
        there = self._fit(found.model, self.nodes, found.theta, 0, None, 0.05)
        return signatures(there, self.samples, self.windows, self.sigma, self.candidates)

    def merged(
        self, key: Key, additions: Sequence[tuple[int, Array]], drop: Key = ()
    ) -> tuple[Key, Array]:
        """Sorted key and start vector of a set with some candidates added and some dropped."""
        found = self.tried[key]
        values: dict[int, Array] = {}
        at = 0
        for number in key:
            width = len(self.candidates[number].knobs)
            values[number] = found.theta[at : at + width]
            at += width
        for number in drop:
            values.pop(number)
        values.update(dict(additions))
        fresh = tuple(sorted(values))
        theta = np.concatenate([values[i] for i in fresh]) if fresh else np.zeros(0)
        return fresh, theta
