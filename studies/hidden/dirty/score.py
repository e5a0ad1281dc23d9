"""How good an answer in the dirty world is, beside the oracle that knows what was hidden."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from residual.gap import GapResult, find_gap
from residual.gap.answer.curves import curves_for
from residual.gap.result import Verdict
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.effects.aliases import exact_aliases, exact_twins
from sims.effects.base import Effect
from sims.effects.library import library
from sims.effects.store import SecondStore
from sims.host import HostSimulator
from studies.hidden.dirty.sets import LEAD, Dirty, make_set
from studies.hidden.dirty.truth import STORE_TIME
from studies.judging.forecasts import Forecasts, plan, relative_error, root_mean_squares
from studies.judging.oracle import fit_effects

#: Forecasts by which the oracle is fitted, and by which all are judged.
FORECASTS = 120


def run_dirty(config: Mapping[str, Any]) -> dict[str, Any]:
    """Make a set, ask find_gap and the oracle, score both.

    Args:
        config: As for ``make_set``, and ``block``: ``"hidden"``, ``"dirt only"`` (nothing hidden)
            or ``"removed"`` (not in the library that find_gap is offered).
    """
    made = make_set(config)
    offered = list(library(made.simulator))
    twins = same_as(made.label, made.simulator)
    if config["block"] == "removed":
        offered = [effect for effect in offered if str(effect) not in twins]
    measured = made.sensors.input_noise is not None
    begin = time.process_time()
    result = find_gap(
        made.simulator,
        made.logs,
        effects=offered,
        hold="linear" if measured else "zero",
        measured_input=measured,
        horizon=made.horizon,
    )
    return {
        "rows": sum(len(run) for run in made.logs),
        "period_s": made.simulator.dt,
        "strength": made.truth.strength,
        "seconds": time.process_time() - begin,
        "findings": [one.words for one in result.quality],
        "says": [verdict.says for verdict in result.verdicts],
        **names(result, made, twins),
        **errors(result, made),
    }


def errors(result: GapResult, made: Dirty) -> dict[str, Any]:
    """Held-out errors of the nominal, the corrected simulator and the oracle; its strength."""
    held = plan(made.simulator, made.held, made.horizon, LEAD * made.horizon, _each(made.held))
    row: dict[str, Any] = {
        "nominal": relative_error(made.simulator, held),
        "corrected": relative_error(result.corrected, held),
    }
    if not made.label:
        return row
    fit = plan(made.simulator, made.logs, made.horizon, LEAD * made.horizon, _each(made.logs))
    (found,) = oracle(made, fit)
    repaired = made.simulator.with_effects([found])
    row["oracle"] = relative_error(repaired, held)
    (field,) = found.strengths()
    row["oracle_strength"] = float(getattr(found, field))
    row["covered"] = None
    for verdict in result.verdicts:
        if verdict.label == made.label and verdict.kind in ("confirmed", "ambiguous"):
            number = verdict.parameters[field]
            row["covered"] = bool(number.low <= row["oracle_strength"] <= number.high)
            row["covered_truth"] = bool(number.low <= made.truth.strength <= number.high)
            break
    return row


def oracle(made: Dirty, fit: Sequence[Forecasts]) -> tuple[Effect, ...]:
    """The hidden effect, its strength fitted by the forecasts of the logs that find_gap saw."""
    channels = list(root_mean_squares(made.simulator, fit))
    return fit_effects(made.simulator, chosen_effects(made.simulator, [made.label]), fit, channels)


def _each(runs: Sequence[Trajectory]) -> int:
    return max(1, FORECASTS // len(runs))


def names(result: GapResult, made: Dirty, twins: frozenset[str]) -> dict[str, Any]:
    """What was named first and what with confidence, held against what was hidden."""
    known = library(made.simulator)
    curves = curves_for(made.simulator, [str(effect) for effect in known])
    offered = {str(effect): effect for effect in (*known, *curves)}
    chosen = [v for v in result.verdicts if v.effect and v.kind in ("confirmed", "ambiguous")]
    named = [v.label for v in chosen]
    sure = [v.label for v in chosen if v.kind == "confirmed"]
    row: dict[str, Any] = {
        "named": named,
        "sure": sure,
        "kinds": [v.kind for v in result.verdicts],
        "unlike": [one.label for one in result.unlike],
        "truly_off": [verdict.label for verdict in chosen if truly_off(verdict, made)],
    }
    there = {verdict.label for verdict in chosen if is_the_store(verdict, made)}
    if not made.label:
        wrong = [name for name in sure if name not in there]
        return row | {"first": None, "family": None, "among": None, "wrong_sure": wrong}
    right = twins | _family(made.label, made.simulator, offered)
    first = "".join(named[:1])
    alternatives = chosen[0].alternatives if chosen else ()
    meant = right | there | together(made.label, made.simulator, named)
    return row | {
        "first": first in twins,
        "family": first in right,
        "among": not right.isdisjoint([first, *alternatives]),
        "wrong_sure": [name for name in sure if name not in meant],
    }


def truly_off(verdict: Verdict, made: Dirty) -> bool:
    """Whether a verdict names a parameter that is off, as all are a little, or its exact twin."""
    (strength,) = [n.value for n in verdict.parameters.values()][:1]
    off = made.truth.off
    parameters = [name for name in same_as(verdict.label, made.simulator) if name in off]
    return verdict.label != made.label and any(off[name] * strength > 0 for name in parameters)


def is_the_store(verdict: Verdict, made: Dirty) -> bool:
    """Whether a verdict names the oven's second thermal mass, and its intervals hold its numbers.

    Of all that the dirt is made of the library holds this alone (``SecondStore``).
    """
    thermal = verdict.effect == SecondStore.name and made.truth.flexible > 0
    true = {"rate": made.truth.flexible / STORE_TIME, "time": STORE_TIME}
    numbers = verdict.parameters
    return thermal and all(numbers[k].low <= v <= numbers[k].high for k, v in true.items())


def together(label: str, simulator: HostSimulator, named: Sequence[str]) -> frozenset[str]:
    """Named effects that, all of them in one exact proportion, make the motion of another."""
    found: set[str] = set()
    for alias in exact_aliases(simulator):
        others = [same_as(name, simulator) for name in alias.effects if name != label]
        if alias.combination and label in alias.effects and all(o & set(named) for o in others):
            found.update(*others)
    return frozenset(found)


def same_as(label: str, simulator: HostSimulator) -> frozenset[str]:
    """Labels that mean exactly the same motion, its own included; none for no label."""
    return exact_twins(simulator).get(label, frozenset({label} if label else ()))


def _family(label: str, simulator: HostSimulator, offered: Mapping[str, Effect]) -> frozenset[str]:
    """Labels of the same family at the same place."""
    if label not in offered:
        return frozenset()
    hidden = offered[label]
    family = hidden.family_in(simulator)
    return frozenset(
        name
        for name, effect in offered.items()
        if family and effect.family_in(simulator) == family and effect.where == hidden.where
    )
