"""Whether a sensor or a clock was found, where a position and its measured rate disagree."""

from __future__ import annotations

from collections.abc import Mapping

from residual.gap.confirmation.claim import Claim
from residual.gap.fitting.plausible import ratios
from residual.gap.search.sets import Search
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import EncoderScale

#: Times that a scale may be of the one by which two sensors disagree, to be about as large.
ABOUT = 1.33
#: Powers of the time that parameters have in their units: of inertia and masses, of dampings.
POWERS = (1, 2)


def by_sensor_or_clock(claim: Claim, search: Search, disagree: Mapping[str, float]) -> bool:
    """Whether a claim moves as a scale does by which a position and its rate were seen to disagree.

    The rate is put on the position's scale. If it was the position's sensor that is off, both are
    off now, and in a system whose forces are in proportion to its motion that is a gain. If it was
    the clock, whatever has a time in its unit is off by that.

    Args:
        claim: With what its twins would be.
        search: Has what is claimed.
        disagree: Part by which each position moves more than the integral of its rate, by name.
    """
    scales = {
        meant.effect: meant.numbers["scale"][0] for meant in claim.meant if "scale" in meant.numbers
    }
    encoder = any(
        _about(scales.get(str(EncoderScale(name)), 0.0) / share) for name, share in disagree.items()
    )
    return encoder or any(_by_the_clock(claim, search, share) for share in disagree.values())


def _by_the_clock(claim: Claim, search: Search, share: float) -> bool:
    """Whether a parameter changed by about as much as a clock that is off would have it."""
    effect = search.candidates[claim.number].effect
    if not isinstance(effect, ParameterChange):
        return False
    changed = effect.with_values(change=claim.numbers["change"].value)
    times = ratios(search.simulator, [changed]).get(0, 1.0)
    return any(_about(abs(times - 1) / abs(power * share)) for power in POWERS)


def _about(times: float) -> bool:
    return 1 / ABOUT <= times <= ABOUT
