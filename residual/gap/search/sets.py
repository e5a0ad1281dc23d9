"""Sets of effects that were fitted, and how well they forecast.

Every set is fitted from the numbers of the set it grew from. A larger set that ends worse than one
that it contains has not converged; it is fitted again from there, and never counts as evidence if
that does not help.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import UNCONVERGED, Fit, Fitter
from residual.gap.fitting.plausible import absurd, nearly, surprises, told_by_data, unlikely
from residual.gap.fitting.screening import Signatures, signatures, trials
from residual.gap.fitting.validation import Validated, validate
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.model.nested import absent, from_nested
from residual.gap.preparation.effort import Effort
from residual.gap.search.currency import Currency, groups
from residual.gap.search.global_search import GlobalSearch
from residual.gap.search.measured_path import MeasuredPath
from residual.gap.search.pool import Key, Pool, Twins
from residual.gap.search.redundant import doubles
from sims.host import HostSimulator

Array = NDArray[np.float64]
Proposals = dict[Key, Array]

#: Cosine of what two effects do, start states allowed for, beyond which it is one motion.
SAME_MOTION = 0.995


class Search(Pool):
    """Rival sets of effects fitted to the windows of one fitter.

    Attributes:
        beside: Candidates that are free beside every set, the empty one included, and that no set
            is charged for: parameters within their tolerance.
        nominal: The simulator as it was given; ``before``: its forecasts.
        tried: Every fitted set: sorted candidate numbers -> fit; ``unfit``: not converged.
        barred: Candidates that no set may hold for now; ``at_most``: numbers that one may have.
        refused: Sets that cannot be right whatever they take off, and why.
        nearly: Those of them that could be, as far as their numbers are known; ``extreme``: sets
            with numbers as large, that explain what moved.
        halved: Those that were fitted at half the step, too, see ``numerics.at_half_step``.
        unasked: Sets and members for which there was no time to try what may stand in their place.
        validated: Cross-validated forecasts of the sets; ``currency``: relative errors.
    """

    def __init__(
        self,
        simulator: HostSimulator,
        candidates: Sequence[Candidate],
        fitter: Fitter,
        effort: Effort | None = None,
        tell: Callable[[str], None] = lambda _: None,
        until: float = np.inf,
        beside: Sequence[Candidate] = (),
        twins: Twins | None = None,
        noise: Array | None = None,
        weigh_until: float = np.inf,
    ) -> None:
        super().__init__(simulator, candidates, twins)
        self.fitter = fitter
        self.effort, self.tell = effort or Effort(), tell
        self.until, self.weigh_until = until, weigh_until
        self.beside = tuple(beside)
        self.nominal = fitter.fit(Model(simulator), np.zeros(0))
        self.before = validate(fitter, self.nominal)
        free = sum(len(candidate.knobs) for candidate in beside)
        base = fitter.fit(self.model(()), np.zeros(free), self.nominal) if free else self.nominal
        self.tried: dict[Key, Fit] = {(): base}
        self.barred: frozenset[int] = frozenset()
        self.at_most = 1_000_000
        self.unfit: set[Key] = set()
        self.refused: dict[Key, str] = {}
        self.nearly: set[Key] = set()
        self.extreme: set[Key] = set()
        self.halved: dict[Key, Fit] = {}
        self.unasked: set[tuple[Key, int]] = set()
        self._in_vain: dict[tuple[int, str], float] = {}
        self._noise, self.globally = noise, GlobalSearch(noise, until)
        self._from_longer_leads: dict[Key, Array] = {}
        self._signatures: dict[Key, Signatures] = {}
        self._columns: dict[Key, Array] = {}
        channels = [simulator.physical_channels[c] for c in fitter.samples.measured]
        self.validated: dict[Key, Validated] = {(): validate(fitter, base) if free else self.before}
        self.currency = Currency(self.before.squares, groups(channels))

    # -- what is known of a set -----------------------------------------------------------

    def model(self, key: Key) -> Model:
        """The simulator with some candidates."""
        return Model(self.simulator, [*(self.candidates[i] for i in key), *self.beside])

    def own(self, key: Key) -> Array:
        """Fitted numbers of a set, without those that are free beside every one."""
        return self.tried[key].theta[: self.numbers(key)]

    def error(self, key: Key) -> float:
        """Cross-validated relative error."""
        return self.currency.error(self.validated[key].squares)

    def fits_in(self, key: Key) -> bool:
        """Whether a set has few enough numbers for the windows there are, and each effect once.

        A law beside its own special case is one law too many, and so is a delay of two inputs
        beside that of one of them. A law by points has many numbers, and may stand alone.
        """
        windows = len(self.fitter.blocks.windows)
        most = windows if len(key) == 1 else self.most_numbers
        few = len(key) <= self.effort.most and self.numbers(key) <= min(most, self.at_most)
        return few and self.barred.isdisjoint(key) and not doubles(self, key)

    @property
    def most_numbers(self) -> int:
        """How many numbers the windows are good for."""
        return max(3, len(self.fitter.blocks.windows) // 2)

    def surprises(self, key: Key) -> int:
        """Effects of a set that are larger than usual, end at a bound, or are unlikely so."""
        return surprises(self.tried[key], self.fitter.samples) + (key in self.extreme)

    def unlikely(self, key: Key) -> int:
        """Pairs of a set that undo nearly all of each other, and sensors that are wrong as they
        seldom are: an imperfect simulator may make use of them."""
        return unlikely(self.tried[key], self.fitter.samples)

    def usable(self) -> list[Key]:
        """Sets that converged and may be right."""
        return [key for key in self.validated if self.sound(key)]

    def best(self) -> Key:
        """The set that forecasts best."""
        return min(self.usable(), key=self.error)

    def sound(self, key: Key) -> bool:
        """Whether a fitted set converged and may be right."""
        wrong = key in self.unfit or key in self.refused
        return not wrong and self.barred.isdisjoint(key)

    @property
    def late(self) -> bool:
        """Whether the time for searching is over, or as many sets are fitted as may be."""
        return time.process_time() > self.until or len(self.tried) > self.effort.tried

    @property
    def out_of_time(self) -> bool:
        """Whether the time for weighing what was found against its rivals is over, too."""
        return time.process_time() > self.weigh_until

    def signatures(self, key: Key, near: Key | None = None) -> Signatures:
        """What every candidate would add to a fitted set.

        Args:
            key: The set.
            near: One like it. What candidates do around that has to do where time is over.
        """
        if key not in self._signatures:
            around = key if near is None or not self.late else near
            screened = self.candidates[: self.screened]
            if around not in self._columns:
                columns = self.fitter.columns(self.tried[around], screened)
                self._columns = {around: columns}  # of one set: they are large
            columns = self._columns[around]
            self._signatures[key] = signatures(self.tried[key], trials(screened), columns)
        return self._signatures[key]

    @functools.cached_property
    def measured_path(self) -> MeasuredPath:
        """What candidates would add to the nominal simulator there; of what has no impacts."""
        return MeasuredPath(self.simulator, self.fitter, self.candidates[: self.screened])

    def from_longer_leads(self, key: Key) -> Array:
        """Mean squared errors of blocks, forecasts begun from twice as much data, (B, m)."""
        if key not in self._from_longer_leads:
            fitter = self.fitter.from_longer_leads()
            self._from_longer_leads[key] = validate(fitter, self.tried[key]).squares
        return self._from_longer_leads[key]

    def merged(
        self, key: Key, additions: Iterable[tuple[int, Array]], drop: Key = ()
    ) -> tuple[Key, Array]:
        """Sorted key and start vector of a set with some candidates added and some dropped."""
        fit = self.tried[key]
        kept = [(place, number) for place, number in enumerate(key) if number not in drop]
        values = {number: fit.theta[fit.model.owner == place] for place, number in kept}
        values.update(dict(additions))
        fresh = tuple(sorted(values))
        return fresh, np.concatenate([values[i] for i in fresh]) if fresh else np.zeros(0)

    # -- fitting --------------------------------------------------------------------------

    def add(self, proposals: Proposals) -> list[Key]:
        """Fit and validate sets that were not tried yet; returns them, and with them those in
        which a twin stands for what would be absurd."""
        before = len(self.tried)
        for key, theta in proposals.items():
            if key in self.tried or doubles(self, key):
                continue
            self.fit(key, theta)
            best = self.best()
            name, left = " + ".join(self.labels(best)) or "nominal", 100 * self.error(best)
            self.tell(f"  {len(self.tried)} sets tried; best: {name}, {left:.3g} % of the error")
        return list(self.tried)[before:]

    def fit(self, key: Key, theta: Array) -> None:
        """Fit a set from start values, and from its nested sets if it ends worse than one.

        If it was fitted before, the better fit stays.

        Args:
            key: The set.
            theta: Start values of its own numbers.
        """
        nested = [k for k in self.tried if len(k) < len(key) and set(k) < set(key)]
        near = min(nested, key=lambda k: self.tried[k].merit, default=())
        theta = np.append(theta, self.tried[near].theta[self.numbers(near) :])
        found = self.fitter.fit(self.model(key), theta, self.tried[near])
        if nested:
            floor = self.tried[near].merit
            # What strikes the ground is fitted from nothing as long as nothing is there.
            if found.merit > floor and (near or not self.simulator.has_contacts):
                inner = self.tried[near]
                start = from_nested(self.model(key), key, theta, inner.model, near, inner.theta)
                again = self.fitter.fit(self.model(key), start, self.tried[near])
                found = again if again.merit < found.merit else found
            found = self.globally.better(self.fitter, found, self.numbers(key), theta)
        if key in self.tried and found.merit >= self.tried[key].merit:
            return
        self._forget(key)
        if nested and found.merit > UNCONVERGED * self.tried[near].merit:
            self.unfit.add(key)
        self.tried[key] = found
        self.validated[key] = validate(self.fitter, found)
        number, reason = absurd(found.model, found.theta, self.fitter.samples)
        if reason:
            if told_by_data(found, self.nominal, self.fitter, self._noise):
                self.extreme.add(key)
            else:
                self.refused[key] = reason
                if nearly(found, number, self.fitter):
                    self.nearly.add(key)
            if number < len(key):
                self._add_twins_of_absurd(key, key[number])
        for gone in absent(found.model, key, found.theta):
            smaller, start = self.merged(key, (), drop=(gone,))
            if smaller:  # the same motion with fewer numbers
                self.fit(smaller, start)

    def _forget(self, key: Key) -> None:
        """Forget what was worked out from an earlier fit of a set."""
        for sets in (self.unfit, self.nearly, self.extreme):
            sets.discard(key)
        by_fit = (self._from_longer_leads, self._signatures, self._columns)
        for known in (self.refused, self.halved, *by_fit):
            known.pop(key, None)

    def _add_twins_of_absurd(self, key: Key, gone: int) -> None:
        """Fit a set with each exact twin of a member that would be absurd in its place.

        A twin that came to nothing where the member was less absurd comes to nothing here, too: a
        tenth of a strength is ten times the inertia.
        """
        fit = self.tried[key]
        own = fit.theta[fit.model.owner == key.index(gone)]
        for twin in self.twins_of(gone):
            least = self._in_vain.get((gone, twin.label))
            if least is not None and len(own) == 1 and own[0] / least >= 1:
                continue
            made = self.add_twin(key, gone, twin)
            if len(own) == 1 and (made in self.refused or made in self.unfit):
                self._in_vain[gone, twin.label] = own[0]

    def add_twin(self, key: Key, gone: int, twin: Candidate) -> Key:
        """Fit a set with an exact twin of a member in its place; returns that set."""
        place = [candidate.effect for candidate in self.candidates].index(twin.effect)
        start = 0.01 * twin.trials[0].values[0]
        fresh, theta = self.merged(key, [(place, start)], drop=(gone,))
        self.add({fresh: theta})
        return fresh

    def same_motion(self, rest: Key, one: int, other: int) -> bool:
        """Whether two effects make the same motion in these data beside some others, if known."""
        if rest not in self.tried:  # as of what would hold an effect twice
            return False
        around = self.signatures(rest)
        columns = {v.candidate: v.columns for v in around.variants}
        pair = [columns.get(self.stands_for(number), ()) for number in (one, other)]
        if any(len(places) != 1 for places in pair):
            return False
        a, b = (around.matrix[:, places[0]] for places in pair)
        lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
        return lengths > 0 and abs(float(a @ b)) > SAME_MOTION * lengths
