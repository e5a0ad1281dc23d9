"""Tables and pictures of hidden_effects: one row per cell, and what is taken for what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from matplotlib.figure import Figure as Drawing

from simgap_files.atomic import atomic_write_text
from studies.hidden.counts import asked, count, told
from studies.hidden.strengths import HIDDEN
from studies.reporting.figures import new_figure, save_figure, styled
from studies.reporting.sections import Code, Figure, Prose, Report, Section, Table
from studies.running.versions import versions

#: Residual over noise on held-out windows at which a gap counts as closed.
CLOSED = 1.1
NOTHING, NO_NAME = "nothing hidden", "no name"
METHODS = {"find_gap": "find_gap", "one_step": "one-step regression", "pysindy": "pysindy"}


def tidy(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row for each set of logs and method."""
    rows = []
    for result in results:
        config = result["config"]
        for method, answer in result["answers"].items():
            row = {key: config[key] for key in ("block", "size", "excitation", "noise", "runs")}
            row |= {"hidden": " + ".join(config["hidden"]) or NOTHING, "method": method}
            row["seed"] = config["seed"]
            values = {k: v for k, v in answer.items() if k not in ("says", "quality")}
            for key, value in values.items():
                row[key] = " ".join(map(str, value)) if isinstance(value, list) else value
            if config["remove"]:
                # What is not in the library cannot be named, except by a near-twin.
                row |= dict.fromkeys(["first", "all_named", "exactly", "in_set"])
            covered = answer.get("covered", [])
            row |= {"numbers": len(covered), "numbers_covered": sum(covered)}
            rows.append(row)
    return pd.DataFrame(rows)


def cells(data: pd.DataFrame) -> pd.DataFrame:
    """One row per cell of the grid with find_gap's scores as counts."""
    keys = ["block", "excitation", "noise", "size", "runs"]
    counted = {
        "first right": "first", "or twin": "first_alike", "all named": "all_named",
        "closed": "closed", "named": "any_name", "wrong": "wrong", "unexplained": "unexplained",
    }  # fmt: skip
    rows = []
    for (block, excitation, noise, size, runs), part in _ours(data).groupby(keys):
        logs = {"block": block, "logs": f"{excitation} {noise} x {runs}", "size": size}
        rows.append(
            {**logs, "sets": len(part)}
            | {title: told(part[column]) for title, column in counted.items()}
            | {
                "cover": count(*_covered(part)),
                "s": round(float(part["processor_seconds"].median()), 1),
                "s most": round(float(part["processor_seconds"].max()), 1),
            }
        )
    return pd.DataFrame(rows)


def _ours(data: pd.DataFrame) -> pd.DataFrame:
    """The rows of find_gap, with what is counted of them."""
    ours = data[data["method"] == "find_gap"]
    return ours.assign(
        closed=ours["after"] <= CLOSED,
        wrong=ours["false_sure"] > 0,
        any_name=ours["named"].fillna("").astype(bool),
        unexplained=ours["unexplained"].astype(bool),
        twin=ours["first_alike"].eq(True),
    )


def _covered(part: pd.DataFrame) -> tuple[int, int]:
    """Intervals that hold the true number, and all intervals."""
    return int(part["numbers_covered"].sum()), int(part["numbers"].sum())


def headlines(data: pd.DataFrame) -> pd.DataFrame:
    """What is asked of find_gap, how often it should be so, and how often it was."""
    ours = _ours(data)
    single, pair, nothing, removed, outside = (
        ours[ours["block"] == block] for block in ("single", "pair", "no gap", "removed", "outside")
    )
    some = ours[ours["block"].isin(["single", "pair"]) & (ours["hidden"] != NOTHING)]
    rows: list[tuple[str, str, pd.Series]] = []
    driven = single["excitation"] == "policy"
    for title, part, first, cover in (
        ("", single[~driven], "97 %", "90 to 99 %"),
        ("policy, ", single[driven], "92 %", "90 %"),
    ):
        hits, numbers = _covered(part)
        rows += [
            (f"{title}first name right", first, part["first"]),
            (f"{title}or its near-twin", "", part["first_alike"]),
            (f"{title}95 % intervals that cover", cover, pd.Series(np.arange(numbers) < hits)),
            (f"{title}a confident wrong name", "at most 2 %", part["wrong"]),
        ]
    # With a pair that imitates something not on offer the answer is "unexplained" and says what it
    # imitates; nobody could say that of an effect that no library holds, so it is counted apart.
    by_itself = removed["unexplained"] & ~removed["doubted_for_it"].eq(True)
    rows += [
        ("both of a pair", "90 %", pair["all_named"]),
        ("pairs with a confident wrong name", "", pair["wrong"]),
        (f"gap after at most {CLOSED} times the noise", "97 %",
         some[some["excitation"] != "policy"]["closed"]),
        ("nothing hidden, yet a name", "at most 1 %", nothing["any_name"]),
        ("nothing hidden, yet unexplained", "at most 3 %", nothing["unexplained"]),
        ("removed from the library: unexplained, or a near-twin", "90 %",
         removed["unexplained"] | removed["twin"]),
        ("removed: the same, without doubts that look up what was removed", "",
         by_itself | removed["twin"]),
        ("removed: a confident wrong name", "", removed["wrong"]),
        ("outside of every library: unexplained", "", outside["unexplained"]),
        ("outside: a confident wrong name", "", outside["wrong"]),
    ]  # fmt: skip
    return asked(rows, ours["processor_seconds"], "60 and 120")


def rivals(data: pd.DataFrame) -> pd.DataFrame:
    """First names and false names of every method, on the same sets."""
    rows = []
    for (block, excitation, noise), part in data.groupby(["block", "excitation", "noise"]):
        row: dict[str, Any] = {"block": block, "excitation": excitation, "noise": noise}
        row["sets"] = part["seed"].nunique()
        for method, title in METHODS.items():
            own = part[part["method"] == method]
            if len(own):
                row[f"{title}: first right"] = told(own["first_alike"])
                row[f"{title}: a false name"] = told(own["false"] > 0)
        rows.append(row)
    return pd.DataFrame(rows)


def confusion_counts(data: pd.DataFrame) -> pd.DataFrame:
    """How often a hidden effect (rows) was first called what (columns)."""
    ours = data[(data["method"] == "find_gap") & ~data["hidden"].str.contains("+", regex=False)]
    ours = ours[ours["block"].isin(["single", "no gap"])]
    said = [names.split(" ")[0] if names else NO_NAME for names in ours["named"].fillna("")]
    table = pd.crosstab(ours["hidden"], np.array(said))
    order = [*HIDDEN, NOTHING]
    names = [name for name in order if name in table.index]
    others = [name for name in table.columns if name not in (*names, NO_NAME)]
    wanted = [*(n for n in names if n != NOTHING), *others]
    return table.reindex(index=names, columns=[*wanted, NO_NAME], fill_value=0)


@styled()
def confusion(table: pd.DataFrame) -> Drawing:
    """The confusion picture: hidden against first named, as shares of each row."""
    height = 1.6 + 0.26 * len(table)
    figure, axes = new_figure(width=2.6 + 0.3 * len(table.columns), height=height)
    axis = axes[0, 0]
    total = table.sum(axis=1).to_numpy()[:, None]
    axis.imshow(
        table.to_numpy() / np.maximum(total, 1), cmap="Blues", vmin=0, vmax=1, aspect="auto"
    )
    for i, row in enumerate(table.to_numpy()):
        for j, sets in enumerate(row):
            if sets:
                colour = "white" if sets > 0.5 * total[i, 0] else "black"
                place = {"ha": "center", "va": "center", "fontsize": 7}
                axis.text(j, i, str(sets), color=colour, **place)
    axis.set_xticks(range(len(table.columns)), table.columns, rotation=60, ha="right", fontsize=7)
    axis.set_yticks(range(len(table)), table.index, fontsize=7)
    axis.set(xlabel="named first", ylabel="hidden")
    axis.grid(visible=False)
    return figure


def write_report(
    results: Sequence[Mapping[str, Any]], output: Path, config: Mapping[str, Any]
) -> str:
    """Write sets.csv, cells.csv, rivals.csv, the confusion picture and report.html.

    Returns:
        A few lines for the terminal.
    """
    data = tidy(results)
    short = compared = rivals(data)
    output.mkdir(parents=True, exist_ok=True)
    atomic_write_text(output / "sets.csv", data.to_csv(index=False))
    sections: list[Section] = [
        Prose(
            f"{data['seed'].nunique()} sets of logs. A share is followed by its count and its "
            "exact 95 % interval. Near-twins are delay and lag, and Coulomb and Stribeck "
            "friction; effects with the same motion (mass and length, load and bias) count as "
            "one. The gap after is the residual on held-out windows over the noise. Confident "
            "names are those that were confirmed.",
        )
    ]
    if (data["method"] == "find_gap").any():
        table = cells(data)
        atomic_write_text(output / "cells.csv", table.to_csv(index=False))
        short = headlines(data)
        sections.append(Table.of(short, "In short", ""))
        counts = confusion_counts(data)
        if counts.size:
            drawn = confusion(counts)
            save_figure(drawn, output / "confusion.png", counts.reset_index())
            alt = "Hidden effects against the name given first; the diagonal is right."
            caption = "Counts of sets; rows of effects hidden alone."
            sections.append(Figure(drawn, alt, caption, heading="What is taken for what"))
        caption = (
            f"Counts. Closed: the gap after is at most {CLOSED}; wrong: a confident name that "
            "means nothing hidden. Logs: excitation, noise, number of trajectories."
        )
        sections.append(Table.of(table, "Every cell", caption))
    atomic_write_text(output / "rivals.csv", compared.to_csv(index=False))
    caption = (
        "Near-twins count as right. pysindy differentiates over 50 ms, across the jumps of a held "
        "input, which it was not made for."
    )
    sections.append(Table.of(compared, "Beside other methods", caption))
    sections.append(Code(yaml.safe_dump(dict(config), sort_keys=False), summary="settings"))
    found = ", ".join(f"{name} {version}" for name, version in versions().items())
    Report("Hidden effects", "What find_gap names, known what was hidden.", sections, found).write(
        output / "report.html"
    )
    return short.to_string(index=False)
