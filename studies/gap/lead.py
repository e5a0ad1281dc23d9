"""The first sentence of an answer: how much of the gap has a name, and which."""

from __future__ import annotations

from collections.abc import Container, Mapping

from residual.gap import GapResult
from residual.gap.fitting.forecasts import own_channels
from residual.gap.result import OFF, ChannelGap, Gap, Verdict
from residual.trajectories import moment
from studies.gap.answer import cannot_tell, rivals
from studies.gap.beforehand import seen_first
from studies.gap.records import beside_lead, changes_instead, repeats_instead
from studies.gap.words import (
    ahead,
    by_place,
    capitalized,
    effect_name,
    listed,
    names_of,
    percent,
    quantities_text,
    quantity_text,
)

#: Rivals that are listed.
FEW_RIVALS = 2
#: Names that are listed of those that are not certain.
FEW_NAMES = 3
#: Part of the gap that calibrated parameters take off alone, below which, or below that of what is
#: not certain, they only serve the rest.
TRIFLE = 0.05
#: Share of what is certain, over the largest of what is not, below which it is told last.
LITTLE = 0.1
#: Error on records set aside, over that of the nominal simulator, from which on a channel is worse
#: that is not the main one.
MUCH_WORSE = 1.1
#: Part of the gap without a name that is told where it is no more than noise.
REST = 0.05
#: Difference between channels' shares from which on they are told one by one, so many at most.
UNLIKE, FEW_CHANNELS = 0.2, 3


def lead(result: GapResult, tolerance: float | None = None) -> str:
    """The first sentence: the share of the gap that has a name.

    Before it, what the log may count otherwise than the simulator, and what the simulator may cut
    off by mistake, which no effect undoes, or what explains more than the effects by its change.

    Args:
        result: What was found.
        tolerance: Forecast error that does not matter.
    """
    first = seen_first(result) or changes_instead(result) or repeats_instead(result)
    told = _named_share(result, tolerance)
    told = f"{first}{told[:1].lower()}{told[1:]}" if first else told
    return told + beside_lead(result)


def _named_share(result: GapResult, tolerance: float | None) -> str:
    gap = result.gap
    before = quantity_text(gap.before.value, gap.unit)
    if tolerance is not None and gap.before.value <= tolerance:
        allowed = quantity_text(tolerance, gap.unit)
        smaller = " What is named below is smaller than that." if result.effects else ""
        return f"Nothing that matters: the {ahead(gap)} is {before}, allowed is {allowed}.{smaller}"
    kinds = {verdict.kind for verdict in result.verdicts}
    if kinds & {"confirmed", "ambiguous", "calibrated"}:
        share = f"{capitalized(percent(gap.share.value))} of the gap is {_what(result)}"
        told = f"{share}{_by_channel(result)}.{_noise_for_the_rest(gap, kinds)}"
        return f"{told}{_but_worse_apart(result)}"
    floor = quantity_text(gap.noise_floor.value, gap.unit)
    if "unexplained" in kinds and cannot_tell(result):
        if gap.drowned:
            return (
                f"Noise hides whether there is a gap: the {ahead(gap)} is {before}, and noise "
                f"alone makes {floor}, as much as all that moves."
            )
        return (
            f"Too few data to tell whether there is a gap: the {ahead(gap)} is {before}, noise "
            f"alone makes {floor}."
        )
    if "unexplained" in kinds:
        return f"The gap has no name: the {ahead(gap)} is {before}{_in_one_stretch(result)}."
    return _no_gap(gap) + _but_off_apart(result)


def _noise_for_the_rest(gap: Gap, kinds: Container[str]) -> str:
    """What is to be said of the rest where nothing else is: forecasts never err less than noise."""
    rest = 1 - gap.share.value
    if "unexplained" in kinds or rest < REST:
        return ""
    return f" The other {percent(rest)} cannot be told from noise."


def _in_one_stretch(result: GapResult) -> str:
    """Where most of the error lies, if that is one stretch of the log."""
    lone = result.lone
    if lone is None:
        return ""
    where = f"{lone.run} from {moment(lone.begin)} to {moment(lone.end)}"
    return f", and {percent(lone.share)} of its square lies in one stretch, {where}"


def _no_gap(gap: Gap) -> str:
    """No gap, and, where the error looks like one, how badly it is known."""
    known, floor = gap.before, quantity_text(gap.noise_floor.value, gap.unit)
    if known.value <= OFF * gap.noise_floor.value:
        before = quantity_text(known.value, gap.unit)
        return f"No gap above the noise: the {ahead(gap)} is {before}, noise alone makes {floor}."
    low, value, high = quantities_text((known.low, known.value, known.high), gap.unit)
    return (
        f"No gap that these data tell from noise: the {ahead(gap)} is {value} ({low} to {high}), "
        f"noise alone makes {floor}."
    )


def own_errors(result: GapResult, apart: Gap | None = None) -> dict[str, ChannelGap]:
    """Errors of all measured channels, but of those that are the rate of another one; of the
    records that were set aside, if their table is given."""
    table = (apart or result.gap).by_channel
    channels = [c for c in result.corrected.physical_channels if c.name in table]
    return {channels[i].name: table[channels[i].name] for i in own_channels(channels)}


def _by_channel(result: GapResult) -> str:
    """The share of every channel's own gap, where they differ: the share is a mean over them.

    Measured rates are told, too, where a position's share is not that mean.
    """
    own, every = own_errors(result), result.gap.by_channel
    shares, mean = _shares(own, OFF), result.gap.share.value
    if len(every) > len(own) and any(abs(share - mean) > UNLIKE for share in shares.values()):
        shares = _shares(every)
    if len(shares) < 2 or max(shares.values()) - min(shares.values()) < UNLIKE:
        return ""
    told = [f"{name} {percent(share)}" for name, share in shares.items()]
    if len(told) > FEW_CHANNELS:
        ends = [min(shares, key=lambda name: shares[name]), max(shares, key=lambda n: shares[n])]
        told = [f"{name} {percent(shares[name])}" for name in ends]
        return f" (between {' and '.join(told)})"
    return f" ({', '.join(told)})"


def _shares(errors: Mapping[str, ChannelGap], least: float = 0.0) -> dict[str, float]:
    """What is gone of the squared error of channels that err at least so many times as by noise."""
    return {
        name: 1 - (error.after.value / error.before.value) ** 2
        for name, error in errors.items()
        if error.before.value > least * error.noise_floor.value
    }


def _but_off_apart(result: GapResult) -> str:
    """That records set aside do have a gap, if they do."""
    apart = result.held_out
    if apart is None or not apart.exceeds_noise(OFF):
        return ""
    spans = (apart.before, apart.noise_floor)
    before, alone = (quantity_text(span.value, apart.unit) for span in spans)
    return (
        f" But the records set aside have one: there the {ahead(apart)} is {before}, and noise "
        f"alone makes {alone}. Search them, too."
    )


def _but_worse_apart(result: GapResult) -> str:
    """What speaks against the corrected simulator on the records that were set aside, if it is
    no better there."""
    apart = result.held_out
    if apart is None:
        return ""
    if apart.helps:
        return _but_worse_elsewhere(result, apart)
    before, after = (quantity_text(s.value, apart.unit) for s in (apart.before, apart.after))
    if not apart.tells:
        alone = quantity_text(apart.noise_floor.value, apart.unit)
        errors = f"the {ahead(apart)} is {after} with it and {before} without"
        if max(apart.before.value, apart.after.value) > OFF * apart.noise_floor.value:
            return f" The records set aside are too few to tell: there {errors}."
        return f" The records set aside cannot tell: there noise alone makes {alone}, and {errors}."
    if apart.refutes:
        return (
            f" But it does not hold on the records set aside, where the corrected simulator is "
            f"worse: the {ahead(apart)} is {after}, the nominal one's {before}."
        )
    if any("no_help" in verdict.doubts for verdict in result.verdicts):
        return (
            f" But it does not help on the records set aside, where the {ahead(apart)} is {after} "
            f"with it and {before} without."
        )
    return (
        " The records set aside do not show it: they have a gap of their own, beside which what "
        f"was found makes little difference: the {ahead(apart)} is {after} with it and {before} "
        "without."
    )


def unborne(result: GapResult) -> bool:
    """Whether the records that were set aside do not bear the answer out, although they could."""
    apart = result.held_out
    if apart is None:
        return False
    if not result.effects:
        return apart.exceeds_noise(OFF)
    return (apart.tells and not apart.helps) or bool(_but_worse_elsewhere(result, apart))


def _but_worse_elsewhere(result: GapResult, apart: Gap) -> str:
    """The channel that the corrected simulator makes clearly worse on the records set aside, while
    the main one is better there."""
    errors = own_errors(result, apart)
    worse = {
        name: error.after.value / error.before.value
        for name, error in errors.items()
        if error.after.value > max(MUCH_WORSE * error.before.value, OFF * error.noise_floor.value)
    }
    if not worse:
        return ""
    name = max(worse, key=lambda name: worse[name])
    error = errors[name]
    before, after = (quantity_text(s.value, error.unit) for s in (error.before, error.after))
    return (
        f" But on the records set aside it makes {name} worse: {after} with it, {before} without."
    )


def _what(result: GapResult) -> str:
    """What the gap is made of, certain names first unless they are next to nothing of it."""
    certain = [v for v in result.verdicts if v.kind == "confirmed"]
    others = [v for v in result.verdicts if v.kind == "ambiguous"]
    moved = [verdict for verdict in result.verdicts if verdict.kind == "calibrated"]
    words = by_place([_briefly(verdict, result) for verdict in certain])
    beside = ""
    least = max([TRIFLE, *(verdict.share.value for verdict in others)])
    if moved and (moved[0].share.value > least or not (certain or others)):
        words.append("parameters that are off within their tolerance")
    elif moved:
        beside = ", beside parameters that are moved within their tolerance"
    sure = listed(words)
    if not others:
        return sure + beside
    if len(others) == 1:
        doubtful = _with_rivals(others[0], result)
    else:
        names = by_place([_briefly(v, result) for v in others])
        if len(names) > FEW_NAMES:
            names = [*names[: FEW_NAMES - 1], f"{len(names) - FEW_NAMES + 1} more"]
        doubtful = f"perhaps {listed(names)}"
    if certain and sum(v.share.value for v in certain) < LITTLE * max(
        v.share.value for v in others
    ):
        return f"{doubtful}{beside}, and {sure}, which {'are' if len(words) > 1 else 'is'} certain"
    return (f"{sure} and {doubtful}" if sure else doubtful) + beside


def _briefly(verdict: Verdict, result: GapResult) -> str:
    """The family if the form is undecided and nothing else named is of it, else the effect."""
    name = effect_name(_short(verdict, result))
    named = [v for v in result.verdicts if v.kind in ("confirmed", "ambiguous")]
    of_it = [v for v in named if (v.family, v.where) == (verdict.family, verdict.where)]
    if not verdict.family or len(of_it) > 1:
        return name
    _, at, place = name.partition(" at ")
    return f"{verdict.family}{at}{place}"


def _with_rivals(verdict: Verdict, result: GapResult) -> str:
    name = _briefly(verdict, result)
    others = [label for label in rivals(verdict) if label != verdict.label]
    if not others:
        return f"perhaps {name}"
    if len(others) <= FEW_RIVALS:
        return f"perhaps {name} or {names_of(others)}"
    return f"perhaps {name} or one of {len(others)} others"


def _short(verdict: Verdict, result: GapResult) -> str:
    """Name and place; of a system with a single joint the place goes without saying."""
    joints = [joint.name for joint in result.corrected.joints]
    return verdict.effect if joints == [verdict.where] else verdict.label
