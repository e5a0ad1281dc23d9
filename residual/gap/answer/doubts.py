"""Why an effect is not certain, and how that is said."""

from __future__ import annotations

from residual.gap.confirmation.claim import Claim
from residual.gap.result import Doubt

DOUBTS: dict[Doubt, str] = {
    "not_needed": "without it forecasts are not worse in enough blocks of data to be sure",
    "unsteady": "its size differs between parts of the data",
    "creeps": "it is no constant: its size changes along the records, with how far the motion "
    "goes, or from one record to another",
    "drift": "a push, or a parameter, that changes steadily along the records, as of a room that "
    "warms, would do as well",
    "one_way": "motion goes one way only, so that a part of it may be a constant load",
    "law": "the law may be another one, to which a parameter that changes with what was measured "
    "comes near",
    "numerics": "its size changes with the integration step or with how the input is held",
    "at_bound": "its size lies at its bound",
    "clock": "the log does not tell its time well enough: late time stamps, an input that is held, "
    "a filter in a sensor, or an input that came on later would do as well",
    "within_step": "it may be less than one of the steps in which its sensor reads",
    "swapped": "a lag of the drive and a time constant in each other's place make the same motion, "
    "and the drive would be the slower of the two",
    "conventions": "it has to be seen first whether the log counts as the simulator does",
    "cut_off": "it has to be seen first whether the simulator is meant to cut an input or a state "
    "off where it does",
    "extreme": "a parameter or an input would be more than ten times off, or act the other way, so "
    "see first whether the simulator has it right",
    "stretched": "a parameter so many times its nominal value, or so small a part of it, may stand "
    "for a law of another form, and something has no name",
    "orders": "torques that repeat along a turn fit whatever follows the position, where there are "
    "several or something has no name",
    "levels": "its input rests at no more levels than its laws have numbers, so that other laws "
    "fit as well: log more levels",
    "loop": "every input follows what was measured, so that other laws in proportion to either fit "
    "as well: log while the goal changes",
    "records": "an effect with its own size in each record does better, or may be what this one "
    "stands for",
    "set_aside": "the corrected simulator is worse on the records that were set aside",
    "no_help": "it hardly helps on the records that were set aside, where it could",
    "sensor": "sensors are seldom wrong in their scale, or by a fifth of all that they showed, and "
    "what has no name yet may look so",
    "no_time": "there was no time to ask whether another effect, or parameters that are a few "
    "percent off, would do as well, give more --minutes",
    "may_be_zero": "its interval holds zero, or nearly",
    "size_open": "it may be many times as large as what fits best",
    "share_may_be_zero": "what it takes off the gap may be nothing: most of that is in few blocks",
    "company": "it only helps beside another effect that may not be there",
    "rare": "it is rare, and what has no name is many times the noise, so that it may stand for a "
    "law of another form",
    "calibration": "parameters that are a few percent off would do nearly as well",
    "within": "its interval reaches into the few percent that are allowed to every parameter",
    "slight": "without it errors are less than twice as large, and what has no name may favour "
    "it by as much",
    "few_blocks": "what has no name is much more than noise, and there are too few blocks of data "
    "to say that it is not what this one stands for",
    "rivals": "an effect of another kind does nearly as well",
    "instead": "other effects together do as well without it",
}


def doubts(
    claim: Claim, vanishes: bool, thin: bool = False, wide: bool = False
) -> tuple[Doubt, ...]:
    """Why an effect is not certain.

    Args:
        claim: What bears on it.
        vanishes: Whether its interval holds zero, or nearly.
        thin: Whether few blocks of data leave much without a name.
        wide: Whether it may be many times as large.
    """
    why: dict[Doubt, bool] = {
        "not_needed": not claim.needed,
        "unsteady": not claim.steady,
        "creeps": claim.creeps,
        "drift": claim.drifts,
        "one_way": claim.one_way,
        "law": claim.other_law,
        "numerics": not claim.sound,
        "at_bound": claim.bounded,
        "calibration": claim.calibration and not claim.slight,
        "within": claim.within and not claim.calibration,
        "slight": claim.slight,
        "no_time": claim.unasked,
        "clock": claim.brief,
        "within_step": claim.within_step,
        "swapped": claim.swapped,
        "sensor": claim.sensor,
        "conventions": claim.counted,
        "cut_off": claim.cut_off,
        "extreme": claim.extreme,
        "stretched": claim.stretched,
        "orders": claim.orders,
        "levels": claim.few_levels,
        "loop": claim.in_a_loop,
        "records": claim.unlike,
        "set_aside": claim.refuted,
        "no_help": claim.helpless,
        "may_be_zero": vanishes,
        "size_open": wide,
        "share_may_be_zero": not claim.gains,
        "company": claim.in_company,
        "rare": claim.rare,
        "few_blocks": thin,
        "rivals": bool(claim.rivals or claim.alike),
        "instead": bool(claim.instead),
    }
    return tuple(doubt for doubt, there in why.items() if there)
