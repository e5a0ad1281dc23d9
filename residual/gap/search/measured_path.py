"""What effects would add to a simulator along the path that was measured.

Where a gap is large, the simulator's own path is nowhere near that, and a linear picture around it
tells nothing of what is missing.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

from residual.gap.fitting.contract import Fitter
from residual.gap.fitting.screening import Signatures, signatures, trials
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from sims.host import HostSimulator


class MeasuredPath:
    """The linear picture of a nominal simulator around the measured path.

    Args:
        simulator: The nominal simulator, of what has no impacts.
        fitter: Holds what was measured.
        screened: What is on offer.
    """

    def __init__(
        self, simulator: HostSimulator, fitter: Fitter, screened: Sequence[Candidate]
    ) -> None:
        assert isinstance(fitter, SmoothFitter)
        self._fitter, self._screened = fitter, screened
        self._fit = fitter.on_measured_path(Model(simulator))

    @functools.cached_property
    def offered(self) -> Signatures:
        """What each candidate on offer would add there."""
        return self.of(self._screened)

    def of(self, candidates: Sequence[Candidate]) -> Signatures:
        """The same of others."""
        columns = self._fitter.columns(self._fit, candidates)
        return signatures(self._fit, trials(candidates), columns)
