"""How good an answer is, known what was hidden."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from residual.gap import GapResult
from sims.effects.aliases import exact_aliases
from sims.effects.curves import cases_of_curves
from sims.pendulum_equation import PendulumEquation
from studies.hidden.strengths import HIDDEN

#: Declared near-twins: forms of one effect that most data hardly tell apart.
TWINS: tuple[frozenset[str], ...] = (
    frozenset({"delay", "actuator_lag"}),
    frozenset({"coulomb_friction", "stribeck_friction", "directional_friction"}),
)

_ALIASES = [
    (alias.combination, frozenset(label.split("@")[0] for label in alias.effects))
    for alias in exact_aliases(PendulumEquation())
]
#: For every effect with a twin the names that no data could tell from it, its own included.
_SAME = {name: names for combined, names in _ALIASES if not combined for name in names}
_COMBINED = [names for combined, names in _ALIASES if combined]


def same(name: str) -> frozenset[str]:
    """Names that mean the same motion as ``name``."""
    return _SAME.get(name, frozenset({name}))


def alike(name: str) -> frozenset[str]:
    """The same, declared near-twins, and the curves of which it is a case."""
    found = same(name) | cases_of_curves(name)
    for family in TWINS:
        if name in family:
            found |= family
    return found


def replaceable(name: str) -> frozenset[str]:
    """All that has to go from a library so that no two effects are exactly the same as this one.

    The torque constant and the resistance of a motor together are a gain, for example.
    """
    found = same(name)
    for members in _COMBINED:
        if len(members) <= 3 and members & same(name):
            found |= frozenset().union(*(same(member) for member in members))
    return found


def score_names(named: Sequence[str], hidden: Sequence[str]) -> dict[str, Any]:
    """Score a list of names, the most certain first, against what was hidden.

    Returns:
        ``first``: whether the first name means something hidden; ``first_alike``: near-twins
        counted; ``all_named``: whether everything hidden is among the names; ``exactly``: and
        nothing else; ``false``: number of names that mean nothing hidden, near-twins not counted
        as false. None where nothing was hidden.
    """
    exact = [same(name) for name in hidden]
    near = [alike(name) for name in hidden]
    first = named[0] if named else ""
    every = all(any(name in one for name in named) for one in near)
    wrong = sum(not any(name in one for one in near) for name in named)
    return {
        "first": any(first in one for one in exact) if hidden else None,
        "first_alike": any(first in one for one in near) if hidden else None,
        "all_named": every if hidden else None,
        "exactly": every and len(named) == len(hidden) if hidden else None,
        "false": wrong,
    }


def score(
    result: GapResult, strengths: Mapping[str, float], outside: bool = False
) -> dict[str, Any]:
    """One row of the table from an answer of ``find_gap``.

    Args:
        result: The answer.
        strengths: What was hidden, of ``HIDDEN``.
        outside: Whether something that no library holds was hidden too.
    """
    chosen = [v for v in result.verdicts if v.effect]
    confirmed = [v for v in chosen if v.kind == "confirmed"]
    named = [v.effect for v in chosen]
    kinds = [v.kind for v in result.verdicts]
    said = _names(label for v in chosen for label in v.alternatives)
    unexplained = [v for v in result.verdicts if v.kind == "unexplained"]
    doubts = _names(label for v in unexplained for label in v.alternatives)
    hidden = [*strengths, *(["outside"] if outside else [])]
    row = score_names(named, hidden)
    # Where the form is said to be undecided, the family is what is confirmed.
    meant = set().union(*(alike(name) for name in hidden))
    families = [{v.effect, *_names(v.form)} for v in confirmed]
    row["false_sure"] = sum(not family & meant for family in families)
    if chosen and chosen[0].kind == "confirmed" and hidden:
        row["first_alike"] = bool(row["first_alike"] or families[0] & meant)
    row["in_set"] = (
        all(alike(name) & (set(named) | said) for name in strengths) if strengths else None
    )
    row |= {
        "named": named,
        "sure": [v.effect for v in confirmed],
        "kinds": kinds,
        "no_gap": "no_gap" in kinds,
        "unexplained": "unexplained" in kinds,
        "doubted_for_it": any(same(name) & doubts for name in strengths),
        "covered": coverage(result, strengths) if row["exactly"] and row["first"] else [],
        "before": result.gap.windows_before,
        "after": result.gap.windows_after,
        "forecast_before": result.gap.before.value / result.gap.noise_floor.value,
        "forecast_after": result.gap.after.value / result.gap.noise_floor.value,
        "seconds": sum(result.seconds.values()),
        "says": [v.says for v in result.verdicts],
        "quality": [one.words for one in result.quality],
    }
    return row


def _names(labels: Iterable[str]) -> set[str]:
    """Names of effects, without where they act."""
    return {label.split("@")[0] for label in labels}


def coverage(result: GapResult, strengths: Mapping[str, float]) -> list[bool]:
    """Whether the interval of each number holds the true one, for effects named as hidden."""
    hidden = {name: HIDDEN[name].effect(strength) for name, strength in strengths.items()}
    return [
        bool(number.low <= getattr(hidden[verdict.effect], name) <= number.high)
        for verdict in result.verdicts
        if verdict.effect in hidden
        for name, number in verdict.parameters.items()
    ]
