"""What effects would add to a simulator along the path that was measured.

Where a gap is large, the simulator's own path is nowhere near that, and a linear picture around it
tells nothing of what is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from residual.gap.fitting.screening import Signatures, signatures, trials
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model

if TYPE_CHECKING:
    from residual.gap.search.sets import Search


def along_measured_path(search: Search, candidates: Sequence[Candidate]) -> Signatures:
    """What candidates would add to the nominal simulator there.

    Args:
        search: Of a system without impacts.
        candidates: Of it, or others.
    """
    fitter = search.fitter
    assert isinstance(fitter, SmoothFitter)
    fit = fitter.on_measured_path(Model(search.simulator))
    return signatures(fit, trials(candidates), fitter.columns(fit, candidates))
