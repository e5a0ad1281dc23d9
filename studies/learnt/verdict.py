"""The verdict over one trial or many: is the policy better, is it the model's doing, what is left?

Returns differ from seed to seed and from start to start, so policies are compared in pairs, and
what the interval of the pairs does not leave out is not claimed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import pandas as pd

from studies.learnt.errors import by_group, model_errors, no_gap, over_rollouts
from studies.learnt.statistics import Mean, above, mean, return_text, starts
from studies.learnt.words import NEAR, POLICY_WORDS, duration
from studies.reporting.sections import KeyValues, Section, Tone, Verdict

About = Mapping[str, Any]
_PLACE = ["true_samples", "estimator", "iteration"]
# A model that leaves so much of the gap in one step, in its worst group of channels, closes none.
_OPEN = 0.5
# One that leaves more than this closes most of it.
_SMALL = 0.2
# Part of its return that more training brings a policy that had only begun to learn.
_BEGUN = 0.5
# Part of the gain by which an earlier update has to be better to be told.
_EARLIER = 0.1
# Returns that differ by a smaller share are the same.
_UNCHANGED = 1e-3


@dataclasses.dataclass(frozen=True)
class Evidence:
    """What a verdict rests on.

    Attributes:
        gain: Return above the idealised policy's, over the pairs.
        seeds: How many were compared; a single one is compared start by start.
        worth: The same above the control's; None without a control.
        unchanged: Whether the return is the idealised policy's.
        error: One-step error of the model where the policy goes, as a share of the gap, of its
            worst group of channels; None if there is none.
        worst: That group.
        most: Upper end of the interval of that error, over seeds, or over the rollouts of one.
        same: Whether the true system does what the simulator does.
        passed: Whether the target is reached on every seed; None without one to reach.
        near: Whether the policy learnt on the true system gains hardly more; None without one.
    """

    gain: Mean
    seeds: int
    worth: Mean | None = None
    unchanged: bool = False
    error: float | None = None
    worst: str = ""
    most: float = 0.0
    same: bool = False
    passed: bool | None = None
    near: bool | None = None

    @property
    def by_model(self) -> bool:
        """Whether the control shows that the gain is the difference model's doing."""
        if self.worth is None:
            return False
        # The interval of a single seed does not hold the luck of training.
        least = self.gain.value / 2 if self.seeds == 1 else 0.0
        return self.worth.low > 0 and self.worth.value > least

    @property
    def left(self) -> bool:
        """Whether something of the gap is known to be left."""
        open_ = self.error is not None and self.error >= _OPEN
        return open_ or self.passed is False or self.near is False

    def says(self) -> tuple[str, Tone]:
        """The verdict in a word or two, and its tone."""
        if self.same:
            return "no gap found", "neutral"
        if self.unchanged:
            return "unchanged", "warning"
        if self.gain.high < 0:
            return "worse", "bad"
        if self.gain.low <= 0:
            return "not settled", "warning"
        if not self.by_model:
            return "better, cause not shown", "warning" if self.left or not self.passed else "good"
        if self.left:
            return "better, gap remains", "warning"
        if self.gain.count == 1:
            return "better, not settled", "warning"
        if self.most >= _OPEN:
            return "better, gap may remain", "warning"
        most = "most of the gap" if self.error is not None and self.error > _SMALL else "gap"
        return f"{most} closed{', on one seed' if self.seeds == 1 else ''}", "good"


def headline(
    once: pd.DataFrame, errors: pd.DataFrame, about: About, beside: str = ""
) -> list[Section]:
    """Did it work, was it the difference model's doing, and in which numbers?

    Args:
        once: Every policy once, as ``policies_once`` gives them.
        errors: One row for each measurement of accuracy.
        about: The system.
        beside: How long the true system ran beside the samples, in words.
    """
    kinds = {str(name): part for name, part in once.groupby("name")}
    before, target = kinds["idealised"], about["target"]
    start, learnt = _value(before), kinds.get("difference", kinds.get("corrected"))
    if learnt is None:
        good = target is not None and before["return_true"].min() >= target
        says = (
            f"Trained on the simulator alone, the policy returns {return_text(start)} on the true "
            "system."
        )
        return [Verdict(says, tone="neutral" if target is None else "good" if good else "bad")]
    chosen, reached = _chosen(learnt, target)
    samples, estimator, update = chosen.iloc[0][_PLACE]
    seen = model_errors(errors, estimator, samples, update)
    value = _value(chosen)
    control = once[(once["name"] == "control") & (once["iteration"] == update)]
    pairs = above(chosen, control) if len(control) else []
    true = _value(kinds["true"]) if "true" in kinds else None
    worst, error, told = _worst(seen, about)
    found = Evidence(
        gain=mean(above(chosen, before) or [value - start]),
        seeds=chosen["seed"].nunique(),
        worth=mean(pairs) if pairs else None,
        unchanged=abs(value - start) <= _UNCHANGED * max(abs(value), abs(start)),
        error=error.value if error else None,
        worst=worst,
        most=error.high if error else 0.0,
        same=no_gap(seen),
        passed=reached if target is not None and start < target else None,
        near=None if true is None else value - start >= NEAR * (true - start),
    )
    by = f"{estimator}, update {update}" if "difference" in kinds else POLICY_WORDS["corrected"]
    needed = f"{samples} true samples, {duration(samples * about['dt'])}"
    gone = f"from {return_text(start)} to {return_text(value)} ({by}, {needed})"
    went = f"On the true system the return went {gone}."
    alone = _value(control) if len(control) else None
    text = [went] if found.same else []
    text += [_of_gain(found, starts(chosen)), *_of_target(found, target)]
    text += [*_of_earlier(learnt[learnt["estimator"] == estimator], start, value)]
    text += [*_of_cause(found, alone), *_of_training(before, control)]
    text += _of_rest(found, true, about)
    tiles = {
        "idealised policy": return_text(start), f"after update {update}": return_text(value),
        "gain": str(found.gain), "true samples": duration(samples * about["dt"]),
    } | ({"beside them, tests and accuracy on the truth": beside} if beside else {})  # fmt: skip
    if found.error is not None and not found.same:
        ends = f" ({told})" if told else ""
        tiles[f"one-step error, share of gap{ends}"] = f"{found.error:.2g}"
    label, tone = found.says()
    same = "Where the policy goes, the true system does what the simulator does."
    return [
        Verdict(same if found.same else went, " ".join(text), tone=tone, label=label),
        KeyValues(tiles, style="tiles"),
    ]


def _of_gain(found: Evidence, tested: int) -> str:
    """The gain, and what its interval holds."""
    if found.gain.count == 1:
        return "One seed without several common starts gives no interval: run more seeds."
    common = f"{tested} common starts" if tested > 1 else "one start"
    settled = found.unchanged or found.gain.low > 0 or found.gain.high < 0
    more = "" if settled else " More seeds, or more starts (true_episodes), narrow that interval."
    if found.seeds == 1:
        return (
            f"Start by start over {common} the gain is {found.gain}, of this training alone: "
            f"another seed may do otherwise.{more}"
        )
    return f"Seed by seed, each over {common}, the gain is {found.gain}.{more}"


def _of_earlier(learnt: pd.DataFrame, start: float, value: float) -> list[str]:
    """An update that was clearly better than the one that is judged."""
    returns = learnt.groupby("iteration")["return_true"].mean()
    if returns.empty or returns.max() - value <= _EARLIER * max(abs(value - start), 1e-12):
        return []
    best = return_text(float(returns.max()))
    return [f"Update {returns.idxmax()} had returned {best}: not every update helps."]


def _of_target(found: Evidence, target: float | None) -> list[str]:
    """Whether the target was reached."""
    seeds = " on every seed" if found.seeds > 1 else ""
    if found.passed is None:
        return []
    if found.passed:
        return [f"The target of {target:g} is passed{seeds}."]
    return [
        f"The target of {target:g} is not reached{seeds}: more samples, another update or another "
        "estimator may close the rest; the accuracy below says where the model errs."
    ]


def _of_cause(found: Evidence, control: float | None) -> list[str]:
    """What the control says; nothing where there is nothing to explain."""
    if found.worth is not None and control is not None:
        by = "seed by seed" if found.seeds > 1 else "in pairs"
        return [
            f"As much training without a difference model ends at {return_text(control)}; {by} the "
            f"model is worth {found.worth}."
        ]
    if found.same or found.unchanged or found.gain.low <= 0:
        return []
    return [
        "Whether that is the difference model's doing or that of longer training, a control shows: "
        "give --budget.control_steps."
    ]


def _of_training(idealised: pd.DataFrame, control: pd.DataFrame) -> list[str]:
    """Whether the idealised policy had only begun to learn on its own simulator."""
    if control.empty:
        return []
    first, then = (float(rows["return_model"].mean()) for rows in (idealised, control))
    if not then - first > _BEGUN * abs(first):
        return []
    return [
        f"The idealised policy had only begun to learn: as much training again brings it from "
        f"{return_text(first)} to {return_text(then)} on its own simulator. Give more "
        "--budget.idealised_steps before the gap is judged."
    ]


def _of_rest(found: Evidence, true: float | None, about: About) -> list[str]:
    """What is left, and what would be possible."""
    text, best = [], about.get("best")
    if found.same:
        text.append("A difference model has nothing to learn there; what differs is training.")
    elif found.error is not None and found.error >= _OPEN:
        text.append(
            f"One step of the corrected simulator still errs by {found.error:.2g} of the gap in "
            f"{found.worst}: the gap is not closed, whatever the return."
        )
        if about.get("sampled"):
            text.append("Noise in the state that the environment reports would look the same.")
    elif found.error is not None and found.most >= _OPEN:
        text.append(
            f"One step of the corrected simulator errs by {found.error:.2g} of the gap in "
            f"{found.worst}, which its interval cannot tell from {found.most:.2g}: more rollouts "
            "(visited_rollouts) or seeds say whether the gap is closed."
        )
    if true is not None:
        text.append(f"Learnt on the true system: {return_text(true)}.")
    if best is not None:
        text.append(f"The best that is possible is {best:.0f}.")
    return text


def _value(rows: pd.DataFrame) -> float:
    """The mean return on the true system over seeds."""
    return float(rows.groupby("seed")["return_true"].mean().mean())


def _worst(seen: pd.DataFrame, about: About) -> tuple[str, Mean | None, str]:
    """The worst group of channels, its one-step error with the interval, and the ends of that."""
    errors = pd.DataFrame() if seen.empty else by_group(seen, "one_step", about)
    errors = errors.dropna(axis=1, how="all")
    if errors.empty:
        return "", None, ""
    worst = str(errors.mean().idxmax())
    error = mean(errors[worst].dropna().tolist())
    low, high = over_rollouts(seen, worst, about) or (error.low, error.high)
    # Of a share of a gap nothing lies below zero.
    wide = dataclasses.replace(error, half_width=high - error.value)
    return worst, wide, f"{max(low, 0.0):.2g} to {high:.2g}" if high > low else ""


def _chosen(learnt: pd.DataFrame, target: float | None) -> tuple[pd.DataFrame, bool]:
    """The policies with the fewest samples that reach the target on every seed; or the last ones,
    of several estimators those with the best mean. The best of all updates would be luck.

    Returns:
        One policy for each seed, and whether all reach the target.
    """
    found = learnt.groupby(_PLACE)["return_true"].agg(["min", "mean"])
    works: Any = found.index[found["min"] >= target] if target is not None else []
    samples = found.index.get_level_values("true_samples")
    place: Any = works[0] if len(works) else found["mean"][samples == samples.max()].idxmax()
    chosen = (learnt[_PLACE] == pd.Series(place, index=_PLACE)).all(axis=1)
    return learnt[chosen], bool(len(works))
