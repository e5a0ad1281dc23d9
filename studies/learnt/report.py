"""The report over one trial or many, of any system: verdict, pictures, tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from policy.learner import other_name
from simgap_files.npz import read_npz
from studies.learnt.figures import (
    Drawn,
    budgets_figure,
    curves_figure,
    drawn_steps,
    episodes_figure,
    path_figure,
    updates_figure,
)
from studies.learnt.on_truth import beside_samples, warnings_section
from studies.learnt.samples_needed import samples_section
from studies.learnt.sections import (
    accuracy_section,
    legend,
    policies_once,
    policies_section,
    says_section,
    summarise,
)
from studies.learnt.statistics import to_digits
from studies.learnt.tables import apart, tables_of
from studies.learnt.verdict import headline
from studies.learnt.words import Results, counted, measures_of, record_key, shown
from studies.reporting.figures import save_figure
from studies.reporting.sections import Animation, Code, Figure, Gallery, KeyValues, Report, Section

Episodes = Mapping[str, Mapping[str, np.ndarray]]
#: Name of its file, the figure with its numbers, heading, what it shows, caption.
Drawing = tuple[str, Drawn, str, str, str]


def read_episodes(results: Results, folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """The episode of every policy that left one in ``folder/rollouts``, by ``record_key``."""
    keys = [record_key(record) for record in results["policies"]]
    paths = {key: folder / "rollouts" / f"{key}.npz" for key in keys}
    return {key: read_npz(path) for key, path in paths.items() if path.exists()}


def write_report(
    results: Sequence[Results],
    folder: Path,
    episodes: Episodes | None = None,
    films: Mapping[str, Path] | None = None,
    failures: Mapping[Path, str] | None = None,
    name: str = "report.html",
) -> str:
    """Figures as PNG with their numbers as CSV, and one page, into ``folder``.

    Args:
        results: Of every finished trial, what its ``results.json`` holds.
        folder: Where to write.
        episodes: Of a single trial, one of each policy on the true system, by ``record_key``.
        films: GIF files of some of them.
        failures: Traceback of every failed trial, by folder.
        name: Of the page.

    Returns:
        The table of the policies as text, and what its columns mean.
    """
    about = results[0]["about"]
    rows, errors = tables_of(results)
    once = policies_once(rows)
    measures = list(dict.fromkeys(m for p in results[0]["policies"] for m in measures_of(p)))
    summary = summarise(once, errors, about, measures)
    sections: list[Section] = headline(once, errors, about, beside_samples(results))
    sections += warnings_section(results)
    if failures:
        text = "\n".join(f"{path}\n{failure}" for path, failure in failures.items())
        count = f"{counted(len(failures), 'trial')} failed, in no mean"
        sections.append(Code(text, summary=count, heading="Failed trials"))
    drawings: list[Drawing] = []
    if episodes:
        sections += _before_and_after(results[0], films or {})
        drawings += _of_episodes(results[0], episodes)
    drawings += _of_returns(results, rows, once, errors)
    for file, (figure, numbers), heading, alt, caption in drawings:
        save_figure(figure, folder / "figures" / f"{file}.png", numbers)
        sections.append(Figure(figure, alt, caption, heading=heading))
    sections += [
        policies_section(summary, once, about),
        *accuracy_section(errors, about),
        *says_section(results),
        *samples_section(once, apart(results), about),
        *_provenance(results),
    ]
    title = f"{about['name'].replace('_', ' ').capitalize()}: closing the simulation gap"
    seeds = len(set(rows["seed"]))
    subtitle = f"{counted(len(results), 'trial')}, {counted(seeds, 'seed')}"
    if len(results) == 1:
        by = other_name(results[0].get("config", {}).get("learner"))
        own = [results[0].get("label", ""), by, f"seed {results[0].get('seed', 0)}"]
        subtitle = ", ".join(filter(None, own))
    Report(title, subtitle, sections).write(folder / name)
    # What others published makes lines too long for a terminal.
    told = summary.drop(columns="published", errors="ignore")
    table = told.to_string(index=False, na_rep="", float_format=lambda value: to_digits(value, 3))
    single = says_section(results) if len(results) == 1 else []
    says = [f"{row[0]}: {row[-1]}" for part in single for row in part.rows]
    return "\n".join([table, "", *legend(summary, once), *(["", *says] if says else [])])


def _before_and_after(results: Results, films: Mapping[str, Path]) -> list[Section]:
    """The films of the policies that pictures show, if there are any."""
    pictures = [
        Animation(films[key], f"The true system under the policy: {title}.", title)
        for key, title in shown(results).items()
        if key in films
    ]
    caption = "The first seconds on the **true** system."
    return [Gallery(pictures, caption, heading="Before and after")] if pictures else []


def _of_episodes(results: Results, episodes: Episodes) -> list[Drawing]:
    """Pictures of one episode of each policy on the true system."""
    about = results["about"]
    drawn = {title: episodes[key] for key, title in shown(results).items() if key in episodes}
    steps = drawn_steps(about["dt"])
    cut = any(len(episode["states"]) > steps for episode in drawn.values())
    what = f"The first {steps * about['dt']:.4g} s" if cut else "One whole episode of each policy"
    drawings = [(
        "trajectories", episodes_figure(about, drawn), "Episodes on the true system",
        "State and action over time for each policy on the true system.",
        f"{what} on the true system; a line ends where its episode ends.",
    )]  # fmt: skip
    if about.get("path"):
        drawings.append((
            "path", path_figure(about, drawn), "Paths on the true system",
            f"{about['path'][1]} against {about['path'][0]} for each policy.",
            "One whole episode of each policy.",
        ))  # fmt: skip
    return drawings


def _of_returns(
    results: Sequence[Results], rows: pd.DataFrame, once: pd.DataFrame, errors: pd.DataFrame
) -> list[Drawing]:
    """Pictures of the returns by budget, by update and while learning, those that say something."""
    about, drawings = results[0]["about"], []
    learnt = rows[rows["name"] == "difference"]
    if learnt["samples_per_update"].nunique() > 1:
        drawings.append((
            "budgets", budgets_figure(rows, errors, about), "Return by sample budget",
            "Return and accuracy against the number of true samples for each estimator.",
            "After one update, mean and 95 % interval of the mean over seeds; below, the one-step "
            "error where the policy goes, as a share of the gap.",
        ))  # fmt: skip
    if len(learnt):
        drawings.append((
            "updates", updates_figure(once), "Return by update",
            "Return on the true system after each update, with and without a difference model.",
            "In tests on the true system that are not counted as samples; of several seeds the "
            "mean and its 95 % interval; dashed, learnt on the true system. Cold and warm start "
            "learnt there, too, from as many samples as the legend says.",
        ))  # fmt: skip
    if len(results) == 1:
        drawings.append((
            "curves", curves_figure(results[0]), "Learning curves",
            "Return while learning against steps.",
            "Tests in what each policy learns in, of every training from a start of its own: "
            "compare where a line goes, not two lines. The best policy of a line is kept. Cold and "
            "warm start learn on the true system: their steps are true samples.",
        ))  # fmt: skip
    return drawings


def _provenance(results: Sequence[Results]) -> list[Section]:
    """What made the numbers."""
    sections: list[Section] = []
    if "versions" in results[0]:
        sections.append(KeyValues(dict(results[0]["versions"]), heading="Versions"))
    if len(results) == 1 and "config" in results[0]:
        settings = yaml.safe_dump(results[0]["config"], sort_keys=False)
        sections.append(Code(settings, "The resolved configuration", heading="Configuration"))
    return sections
