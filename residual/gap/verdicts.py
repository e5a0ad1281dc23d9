"""The answer in words."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.adequacy import Remainder
from residual.gap.result import Blind, Gap, Kind, Number, Verdict

#: Effects that differ in form more than in kind.
FAMILIES: dict[str, frozenset[str]] = {
    "delay or lag": frozenset({"delay", "actuator_lag"}),
    "dry friction": frozenset({"coulomb_friction", "stribeck_friction"}),
    "dissipation": frozenset(
        {"viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag", "damping"}
    ),
    "constant push": frozenset({"constant_load", "actuator_bias", "sensor_offset"}),
    "spring": frozenset({"linear_spring", "cubic_spring"}),
}


@dataclasses.dataclass(frozen=True)
class Claim:
    """One chosen effect with everything that bears on its verdict.

    Attributes:
        name, where, label: What and where.
        numbers: Fitted numbers.
        ties: Effects that these data cannot exclude in its place.
        twins: Exact aliases, beside whatever else is claimed: no data could.
        instead: Sets of effects that these data cannot exclude in place of this one and
            another claimed one; single effects among them were not offered.
        gain: What leaving it out would cost.
        artefact: True if another step size or input hold explains it.
        sentence: What the effect is.
        silent: True if held-out data do not go where it shows.
    """

    name: str
    where: str
    label: str
    numbers: dict[str, Number]
    ties: tuple[str, ...]
    twins: tuple[str, ...]
    instead: tuple[str, ...]
    gain: float
    artefact: bool
    sentence: str
    silent: bool = False


def family(labels: Sequence[str]) -> str:
    """The family that all effects belong to, or an empty string."""
    names = {label.split("@")[0] for label in labels}
    for title, members in FAMILIES.items():
        if names <= members:
            return title
    return ""


def verdicts(
    claims: Sequence[Claim],
    left: Remainder,
    gap: Gap,
    sets: Sequence[tuple[str, ...]],
    tolerance: float | None,
    blind: Sequence[Blind],
    provisional: bool = False,
) -> tuple[Verdict, ...]:
    """All verdicts, most important first.

    Args:
        claims: The chosen effects.
        left: What they leave.
        gap: Forecast errors on held-out data.
        sets: Exactly dependent sets of effects, see ``residual.gap.claims.aliases``.
        tolerance: Forecast error that does not matter.
        blind: Effects that the log could hide.
        provisional: True if there is one record only, so that its end had to confirm it.
    """
    found: list[Verdict] = []
    small = tolerance is not None and gap.before.value <= tolerance
    real = [claim for claim in claims if not claim.artefact]
    # Three free effects imitate nearly anything, so they name nothing.
    sound = left.adequate and len(claims) <= 2
    removed = gap.windows_before / max(gap.windows_after, 1e-9)
    labels = [claim.label for claim in real]
    for claim in real:
        stand_ins, together = dependent(claim.label, labels, sets)
        claim = dataclasses.replace(claim, twins=(*claim.twins, *stand_ins))
        found.append(_effect(claim, sound, removed, gap, together))
    for claim in claims:
        if claim.artefact:
            found.append(
                Verdict("unexplained", "", "", {}, (claim.label,), "",
                        f"numerics: what looks like {claim.label} changes with the integration "
                        "step or the input hold, so it is not given a physical name")
            )  # fmt: skip
    if not claims and sound:
        found.insert(0, Verdict("no_gap", "", "", {}, (), "", "no gap above noise"))
    elif small:
        found.insert(
            0,
            Verdict("no_gap", "", "", {}, (), "",
                    f"nothing that matters: the {gap.horizon_s:.3g} s error is "
                    f"{gap.before.value:.3g} {gap.unit}, within the tolerance of {tolerance:.3g}"),
        )  # fmt: skip
    instead = tuple(dict.fromkeys(name for claim in real for name in claim.instead))
    if not sound:
        found.append(_unexplained(left, gap, len(claims)))
    elif instead:
        says = (
            f"unexplained: no single effect on offer does it, and in place of "
            f"{' with '.join(labels)} these data cannot exclude {' or '.join(instead)}"
        )
        found.append(Verdict("unexplained", "", "", {}, instead, "", says))
    if blind:
        names = ", ".join(f"{b.effect} (needs {b.needs})" for b in blind)
        found.append(
            Verdict("needs_data", "", "", {}, tuple(b.effect for b in blind), "",
                    f"this log could not show: {names}")
        )  # fmt: skip
    if provisional:
        word = "; provisional: one record only"
        found = [dataclasses.replace(v, says=v.says + word) if v.effect else v for v in found]
    return tuple(found)


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


def _effect(
    claim: Claim, sound: bool, removed: float, gap: Gap, together: Sequence[tuple[str, ...]]
) -> Verdict:
    numbers = ", ".join(
        f"{name} {n.value:.4g} ({n.low:.4g} to {n.high:.4g}) {n.unit}"
        for name, n in claim.numbers.items()
    )
    title = family((claim.label, *claim.ties)) if claim.ties else ""
    says = f"{claim.label}: {numbers}"
    sure = not claim.instead and not claim.silent and (not claim.ties or bool(title))
    confirmed = (sound or removed >= 10) and sure
    if claim.ties:
        says += f"; these data cannot exclude {', '.join(claim.ties)}"
        if title:
            says += f" ({title}, form undecided)"
    if claim.instead:
        says += f"; together they could be {' or '.join(claim.instead)}"
    if claim.twins:
        says += f"; the same motion as {', '.join(claim.twins)}"
    if together:
        sets = " or ".join(" with ".join(names) for names in together[:2])
        more = f" (and {len(together) - 2} more such sets)" if len(together) > 2 else ""
        says += f"; {sets}, in one exact proportion, would move alike{more}"
    if claim.silent:
        says += "; held-out data do not go where it shows, so nothing confirms it"
    if not sound:
        says += "; a remainder is unexplained"
    kind: Kind = "confirmed" if confirmed else "ambiguous"
    return Verdict(
        kind,
        claim.name,
        claim.where,
        claim.numbers,
        (*claim.twins, *claim.ties, *claim.instead),
        title,
        says,
    )


def _unexplained(left: Remainder, gap: Gap, count: int) -> Verdict:
    size = float(left.ratio.max())
    says = f"unexplained: the residual is {size:.3g} times the noise"
    if left.force:
        says += f"; it looks like a force that follows {left.force}"
    if count > 2:
        says += f"; {count} effects at once can imitate others, so take them as a lead only"
    return Verdict("unexplained", "", "", {}, (), "", says)
