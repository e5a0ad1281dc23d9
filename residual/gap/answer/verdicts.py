"""The answer: which effects are certain, which of several, what is minor, what is left."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap.answer.doubts import DOUBTS, doubts
from residual.gap.beside import Blind
from residual.gap.confirmation.certainty import TOO_FEW
from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.rivals import FEW
from residual.gap.confirmation.size import half_open, may_be_none, may_vanish, size_open
from residual.gap.fitting.contract import Left
from residual.gap.result import Gap, Kind, Span, Verdict
from residual.gap.search.sets import Search

#: Families of which an effect may be one and still be worth a name, if forecasts do not clearly
#: need it. What they do need makes a better simulator, whichever of many it is.
UNNEEDED = 3
#: Times the noise from which on what has no name may be another law that few blocks cannot show.
MUCH = 2.0


def nameable(search: Search, claim: Claim, blocks: int, adequate: bool) -> bool:
    """Whether an effect has few enough rivals, a size, and data enough, to be named at all.

    Nor is one named that makes forecasts worse, unless chance decides, or fits to all data.
    """
    if not adequate and claim.share[0] <= 0 and not claim.by_fit:
        return False
    few = claim.needed or len(families(search, claim)) <= UNNEEDED
    there = claim.by_fit or not may_vanish(search, claim)
    return few and blocks >= TOO_FEW and there


def families(search: Search, claim: Claim) -> set[str]:
    """Families that an effect cannot be told from, its own included; a loner is its own.

    What makes the same motion counts as one.
    """
    numbers = {candidate.label: i for i, candidate in enumerate(search.candidates)}
    own = search.family(claim.number) or search.candidates[claim.number].label
    # A rival that was not offered has a label only.
    known = [search.family(numbers[label]) if label in numbers else "" for label in claim.rivals]
    return {own} | {family or label for family, label in zip(known, claim.rivals, strict=True)}


def effect_verdict(
    search: Search,
    claim: Claim,
    blocks: int,
    stand_ins: Sequence[str] = (),
    together: Sequence[tuple[str, ...]] = (),
    left: float = 1.0,
) -> Verdict:
    """One chosen effect.

    Args:
        search: With the candidates.
        claim: What bears on it.
        blocks: Blocks of data.
        stand_ins: Effects that could stand in its place beside the other chosen ones, exactly.
        together: Sets of effects that make the same motion in one exact proportion.
        left: Times the noise that all chosen ones leave.
    """
    claim = claim.less(stand_ins)
    effect = search.candidates[claim.number].effect
    vanishes = may_vanish(search, claim) if claim.there else may_be_none(search, claim)
    vanishes = vanishes or half_open(search, claim)
    thin, wide = blocks < FEW and left > MUCH, size_open(search, claim, left)
    sure = claim.sure and blocks >= TOO_FEW and not (vanishes or thin or wide)
    kind: Kind = "confirmed" if sure else "ambiguous"
    family = effect.family_in(search.simulator) if claim.form or blocks < FEW else ""
    numbers = ", ".join(
        f"{name} {n.value:.4g} ({n.low:.4g} to {n.high:.4g}) {n.unit}"
        for name, n in claim.numbers.items()
    )
    given = {
        name: float(getattr(effect, name))
        for name, quantity in effect.quantities(search.simulator).items()
        if not quantity.fitted and getattr(effect, name) != 0
    }
    spelt = "".join(f", {name} {value:g}" for name, value in given.items())
    says = [f"{effect}{spelt}: {numbers}"]
    if claim.form:
        says.append(f"{family}, form undecided: {', '.join(claim.form)} would do as well")
    if claim.alike:
        says.append(f"the same motion in these data: {', '.join(claim.alike)}")
    if claim.rivals:
        rivals = dict.fromkeys(
            f"{name} of another order" if name == str(effect) else name for name in claim.rivals
        )
        says.append(f"these data cannot exclude {', '.join(rivals)}")
    twins = tuple(dict.fromkeys((*claim.twins, *stand_ins)))
    resized = tuple(name for name in twins if name not in claim.twins)
    if claim.twins:
        says.append(f"the same motion as {', '.join(claim.twins)}")
    if resized:
        says.append(f"with other sizes of the rest the same motion as {', '.join(resized)}")
    if together:
        sets = " or ".join(" with ".join(names) for names in together[:2])
        says.append(f"{sets}, in one exact proportion, would move alike")
    if claim.instead:
        says.append(f"{', '.join(claim.instead)} do as well without it")
    why = doubts(claim, vanishes, thin, wide)
    says += [DOUBTS[doubt] for doubt in why if doubt not in ("rivals", "instead")]
    if claim.by_fit and not (claim.needed and claim.gains):
        says.append("a fit to all data leaves three times as much without it")
    return Verdict(
        kind, effect.name, effect.where, claim.numbers,
        tuple(dict.fromkeys((*twins, *claim.form, *claim.alike, *claim.rivals))), family,
        "; ".join(says), Span(*claim.share), blocks < FEW, twins, tuple(together), claim.form,
        why, claim.instead, shape=given, meant=claim.meant, beside=claim.beside,
        resized=resized,
    )  # fmt: skip


def remainder_verdict(left: Left, gap: Gap, leads: Sequence[str] = ()) -> Verdict:
    """What has no name."""
    share = Span(1 - gap.share.value, 1 - gap.share.high, 1 - gap.share.low)
    says = (
        f"{100 * share.value:.3g} % of the gap has no name: residuals of the fit are "
        f"{left.ratio:.3g} times the noise"
    )
    if left.force:
        says += f"; it looks like something that follows {left.force}"
    if leads:
        says += f"; {', '.join(leads)} might take some of it, but these data do not show that"
    return Verdict("unexplained", "", "", {}, tuple(leads), "", says, share, follows=left.force)


def parted_verdict(gap: Gap, leads: Sequence[str] = ()) -> Verdict:
    """Forecasts past impacts that err by more than noise makes, whatever was named."""
    times = gap.after.value / gap.noise_floor.value
    share = Span(1 - gap.share.value, 1 - gap.share.high, 1 - gap.share.low)
    says = (
        f"{100 * share.value:.3g} % of the gap has no name: forecasts err {times:.3g} times as by "
        "noise, and no effect of the library is established"
    )
    if leads:
        says += f"; {', '.join(leads)} might take some of it, but these data do not show that"
    return Verdict("unexplained", "", "", {}, tuple(leads), "", says, share)


def minor_verdict(search: Search, number: int, share: tuple[float, float, float]) -> Verdict:
    """An effect that helps too little to be added."""
    effect = search.candidates[number].effect
    return Verdict(
        "minor", effect.name, effect.where, {}, (), effect.family_in(search.simulator),
        f"{effect}: takes too little off the error that is left without it (a fifth is asked, or "
        "three tenths at one joint), so it is not added",
        Span(*share),
    )  # fmt: skip


def no_gap_verdict(says: str) -> Verdict:
    """Nothing above noise, or nothing that matters."""
    return Verdict("no_gap", "", "", {}, (), "", says, Span(0.0, 0.0, 0.0))


def blind_verdict(blind: Sequence[Blind]) -> Verdict:
    """What this log could not show; an effect of several orders, such as cogging, once."""
    needs = {b.effect: b.needs for b in blind}
    names = ", ".join(f"{effect} (needs {needed})" for effect, needed in needs.items())
    return Verdict(
        "needs_data", "", "", {}, tuple(needs), "",
        f"this log could not show: {names}", Span(0.0, 0.0, 0.0),
    )  # fmt: skip


def dependent(
    label: str, claimed: Sequence[str], sets: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """What exactly dependent sets mean for one of several claimed effects.

    Returns:
        Effects that could stand in its place beside the other claimed ones, and sets of effects
        that make the same motion together (those that share no member with the other claims).
    """
    stand_ins: list[str] = []
    together: list[tuple[str, ...]] = []
    for members in sets:
        others = tuple(name for name in members if name != label)
        free = tuple(name for name in others if name not in claimed)
        if label not in members or not free:
            continue
        if len(free) == 1:
            stand_ins += [name for name in free if name not in stand_ins]
        elif len(free) == len(others):
            together.append(free)
    return tuple(stand_ins), tuple(together)
