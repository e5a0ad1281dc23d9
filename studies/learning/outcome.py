"""What the loop leaves: policies, difference models, and a record of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from policy.evaluate import Policy
from residual.difference import DifferenceModel
from residual.trajectories import Trajectory
from studies.learning.results import Measured, Model, Samples
from studies.learning.training import Training
from studies.learnt.words import counted, record_key

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Record = dict[str, Any]


@dataclasses.dataclass(frozen=True, repr=False)
class Learnt:
    """The result of the learning loop.

    Attributes:
        system: What it was about, in plain values.
        policies: One record per policy, in the order learnt (docs/results.md).
        accuracy: One record per update of the difference model.
        trainings: Each policy, by a name such as ``"idealised"``, ``"difference-1"``.
        models: The difference models, one per update.
        runs: The true samples, every episode of every update as a recorded run, as ``find_gap``
            takes them.
    """

    system: dict[str, Any]
    policies: list[Record] = dataclasses.field(default_factory=list)
    accuracy: list[Record] = dataclasses.field(default_factory=list)
    trainings: dict[str, Training] = dataclasses.field(default_factory=dict)
    models: list[DifferenceModel] = dataclasses.field(default_factory=list)
    runs: list[Trajectory] = dataclasses.field(default_factory=list)

    @property
    def policy(self) -> Policy:
        """The policy after the last update, or the idealised one."""
        return self.trainings[record_key(self._last())].policy

    @property
    def model(self) -> DifferenceModel:
        """The last difference model.

        Raises:
            ValueError: There was no update.
        """
        if not self.models:
            raise ValueError(
                "no update was made, so there is no difference model: learn with updates=1 or more"
            )
        return self.models[-1]

    def add_policy(self, name: str, training: Training, **more: int) -> None:
        """Record a policy that was learnt on a simulator."""
        record = policy_record(training, name) | more
        self.policies.append(record)
        self.trainings[record_key(record)] = training

    def add_samples(self, update: int, samples: Samples) -> None:
        """Keep the true samples of an update, as runs."""
        self.runs.extend(samples.data.runs(self.system["dt"], f"update-{update}"))

    def add_update(
        self, update: int, samples: int, policy: Training, model: Model, measured: Measured
    ) -> None:
        """Record an update of the difference model and the policy learnt with it."""
        seen = {"iteration": update, "true_samples": samples}
        self.add_policy("difference", policy, **seen)
        self.models.append(model.difference)
        learnt: dict[str, Any] = {"fit_seconds": model.fit_seconds}
        # What an estimator that can say what it learnt says, as NamedEffects does.
        if says := getattr(model.difference.fitted(), "says_", ""):
            learnt["says"] = str(says)
        self.accuracy.append({**seen, **measured.accuracy, **learnt})

    def add_on_truth(self, name: str, training: Training, within: int) -> None:
        """Record a policy learnt on the true system, as if it had ended after so many samples."""
        if not within:
            return
        self.policies.append(policy_record(training, name, within))
        if name != "cold":
            self.trainings[name] = training

    def results(self) -> dict[str, Any]:
        """The records, as ``results.json`` has them."""
        return {
            "system": self.system["name"],
            "about": self.system,
            "policies": self.policies,
            "accuracy": self.accuracy,
        }

    def to_dataframe(self) -> pd.DataFrame:
        """One row per policy: samples, steps, returns, and what else was measured."""
        from studies.learnt.tables import policy_frame

        return policy_frame(self.policies)

    def plot(self) -> Figure:
        """The return on the true system after each update."""
        from studies.learnt.figures import updates_figure
        from studies.learnt.sections import policies_once
        from studies.learnt.tables import tables_of

        return updates_figure(policies_once(tables_of([self.results()])[0]))[0]

    def report(self, path: str | Path) -> Path:
        """Write one HTML page (and figures beside it) and return its path."""
        from studies.learnt.report import write_report

        path = Path(path)
        episodes = {name: training.episode for name, training in self.trainings.items()}
        write_report([self.results()], path.parent, episodes, name=path.name)
        return path

    def __repr__(self) -> str:
        if not self.policies:
            return f"Learnt({self.system['name']}: nothing yet)"
        first, last, updates = self.policies[0], self._last(), len(self.models)
        return (
            f"Learnt({self.system['name']}: return on the true system "
            f"{first['return_true']:.4g} -> {last['return_true']:.4g} "
            f"with {last['true_samples']} true samples, {counted(updates, 'update')})"
        )

    def _last(self) -> Mapping[str, Any]:
        learnt = [record for record in self.policies if record["name"] == "difference"]
        return learnt[-1] if learnt else self.policies[0]

    def _repr_html_(self) -> str:
        return self.to_dataframe().to_html(index=False, float_format="{:.5g}".format)


def policy_record(training: Training, name: str, within: int | None = None) -> Record:
    """The record of a policy for ``results.json``.

    Args:
        training: Of the policy.
        name: ``"idealised"``, ``"difference"``, ``"control"``, ``"corrected"``, ``"true"``,
            ``"cold"`` or ``"warm"``.
        within: For policies learnt on the true system: read the experiment as if it had
            ended after so many true samples.
    """
    summary, curve = training.summary, training.curve
    if within is not None:
        curve = tuple(point for point in curve if point.step <= within)
    common = {
        "name": name,
        "iteration": 0,
        "true_samples": within or 0,
        "curve": [[point.step, point.deterministic] for point in curve],
    }
    note = note_on(summary)
    if within is None:
        return common | summary | note
    best = max(curve, key=lambda point: point.score).deterministic
    share = within / summary["simulated_steps"]
    # At the full length the policy itself is there, and was tested as all others.
    whole: Record = {k: summary[k] for k in ("return_true", "tests") if k in summary and share == 1}
    return {
        **common,
        "simulated_steps": 0,
        "return_true": best,
        **whole,
        "return_model": best,
        "seconds": summary["seconds"] * share,
        **note,
    }


def note_on(summary: Mapping[str, Any]) -> dict[str, str]:
    """What the table must say of a training that did not go as it should; nothing otherwise."""
    notes = []
    if not summary["updates"]:
        notes.append("nothing learnt")
    elif summary["simulated_steps"] and not summary["best_step"]:
        notes.append("no better than at its start")
    if held := summary.get("held"):
        notes.append(f"state held in {held} steps")
    return {"note": ", ".join(notes)} if notes else {}
