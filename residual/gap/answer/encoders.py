"""Whether what was found is an encoder's scale, where a position and its measured rate disagree."""

from __future__ import annotations

from collections.abc import Mapping

from residual.gap.confirmation.claim import Claim
from sims.effects.sensor import EncoderScale

#: Times that a scale may be of the one by which two sensors disagree, to be about as large.
ABOUT = 1.33


def by_an_encoder(claim: Claim, disagree: Mapping[str, float]) -> bool:
    """Whether a claim moves as a scale does by which a position and its rate were seen to disagree.

    The rate is put on the position's scale. If it was the position's sensor that is off, both are
    off now, and in a system whose forces are in proportion to its motion that is a gain.

    Args:
        claim: With what its twins would be.
        disagree: Part by which each position moves more than the integral of its rate, by name.
    """
    scales = {
        meant.effect: meant.numbers["scale"][0] for meant in claim.meant if "scale" in meant.numbers
    }
    return any(
        1 / ABOUT <= scales.get(str(EncoderScale(name)), 0.0) / share <= ABOUT
        for name, share in disagree.items()
    )
