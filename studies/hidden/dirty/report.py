"""Tables of the dirty world: what was asked for, every cell, and every miss in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simgap_files.atomic import atomic_write_text
from studies.hidden.counts import asked, told
from studies.reporting.markdown import frame_markdown

#: Held-out error over the oracle's that is asked for, and room for "never worse than nominal".
RATIO, SAME = 1.3, 1.02
_OF_HIDDEN = ["first", "family", "among", "close", "clear", "covered", "covered_truth", "either"]


def judged(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Settings and scores of every set in one row, with what is counted in columns of its own."""
    rows = [{**result["config"], **result["answers"]["find_gap"]} for result in results]
    known = ["oracle", "covered", "covered_truth"]  # if anything is hidden
    data = pd.DataFrame(rows)
    data = data.reindex(columns=[*data, *(name for name in known if name not in data)])
    # In a file, infinity has become None.
    errors = data[["nominal", "corrected", "oracle"]].astype(float).fillna(np.inf)
    off = [set(names) for names in data["truly_off"]]
    data = data.assign(
        ratio=errors["corrected"] / errors["oracle"],
        worsening=errors["corrected"] / errors["nominal"],
        clear=errors["nominal"] >= 1.5 * errors["oracle"],
        either=data["covered"].where(data["covered"].eq(True), data["covered_truth"]),
        any_name=data["named"].map(bool),
        differ=data["unlike"].map(bool),
        any_sure=data["sure"].map(bool),
        wrong=data["wrong_sure"].map(bool),
        wrong_else=[bool(set(names) - o) for names, o in zip(data["wrong_sure"], off, strict=True)],
    )
    data = data.assign(close=data["ratio"] <= RATIO, worse=data["worsening"] > SAME)
    data[_OF_HIDDEN] = data[_OF_HIDDEN].astype(object).where(data["block"] == "hidden", None)
    return data


def headlines(data: pd.DataFrame) -> pd.DataFrame:
    """What is asked, how often it should be so, and how often it was."""
    hidden, dirt, removed = (
        data[data["block"] == block] for block in ("hidden", "dirt only", "removed")
    )
    known = hidden[hidden["covered"].notna()]
    but_off = "the same, parameters that are truly off left out"
    rows = [
        ("hidden effect first", "", hidden["first"]),
        ("or its family", "95 %", hidden["family"]),
        ("the same, where the oracle takes a third off", "",
         hidden["family"][hidden["clear"].astype(bool)]),
        ("or among the alternatives of the first", "", hidden["among"]),
        ("nothing named", "", ~hidden["any_name"]),
        ("a confirmed wrong name", "at most 2 %", hidden["wrong"]),
        (but_off, "", hidden["wrong_else"]),
        ("held-out error at most 1.3 times the oracle's", "95 %", hidden["close"]),
        ("95 % intervals with the oracle's strength", "85 %", known["covered"]),
        ("with the true strength", "", known["covered_truth"]),
        ("with one of the two", "", known["either"]),
        ("removed from the library: a confirmed wrong name", "at most 2 %", removed["wrong"]),
        (but_off, "", removed["wrong_else"]),
        ("removed: any name", "", removed["any_name"]),
        ("dirt alone: a confirmed wrong name", "at most 2 %", dirt["wrong"]),
        (but_off, "", dirt["wrong_else"]),
        ("dirt alone: any name", "", dirt["any_name"]),
        ("records said to differ, which are alike", "at most 2 %", data["differ"]),
        ("corrected worse than the nominal, held out", "0 %", data["worse"]),
    ]  # fmt: skip
    return asked(rows, data["seconds"], "")


def cells(data: pd.DataFrame) -> pd.DataFrame:
    """One row for each block, system and layout."""
    counted = {
        "first": "first", "or family": "family", "among": "among", "named": "any_name",
        "confirmed": "any_sure", "wrong confirmed": "wrong", "error <= 1.3": "close",
        "cover": "covered", "worse": "worse",
    }  # fmt: skip
    found = []
    for (block, system, layout), part in data.groupby(["block", "system", "layout"]):
        row = {"block": block, "system": system, "records": layout, "sets": len(part)}
        row |= {title: told(part[column]) for title, column in counted.items()}
        row |= {"s": round(part["seconds"].median()), "s most": round(part["seconds"].max())}
        found.append(row)
    return pd.DataFrame(found)


def by_effect(data: pd.DataFrame) -> pd.DataFrame:
    """One row for each hidden effect."""
    found = []
    for (system, label), part in data[data["block"] == "hidden"].groupby(["system", "hidden"]):
        missed = part["named"][~part["family"].astype(bool)]
        found.append(
            {
                "system": system, "hidden": label, "sets": len(part),
                "or family": told(part["family"]), "error <= 1.3": told(part["close"]),
                "called": ", ".join(names[0] if names else "nothing" for names in missed),
            }
        )  # fmt: skip
    return pd.DataFrame(found)


def misses(data: pd.DataFrame) -> list[str]:
    """Every miss in words, one line each."""
    lines = []
    for row in data.to_dict("records"):
        what = f"{row['block']}, {row['system']}, {row['layout']}, seed {row['seed']}"
        what += f": {row['hidden']}" if row["hidden"] else ""
        named = ", ".join(row["named"]) or "nothing"
        if row["family"] is False:
            lines.append(f"{what} was called {named}")
        if row["wrong_sure"]:
            off = row["truly_off"]
            wrong = [f"{n} (truly off)" if n in off else n for n in row["wrong_sure"]]
            lines.append(f"{what}: confirmed {', '.join(wrong)}")
        if row["unlike"]:
            lines.append(f"{what}: records are said to differ in {', '.join(row['unlike'])}")
        if row["close"] is False:
            lines.append(f"{what}: {row['ratio']:.2f} times the oracle's error (named {named})")
        if row["worse"]:
            times = f"{row['worsening']:.2f} times as bad as the nominal"
            lines.append(f"{what}: corrected {times} (named {named})")
    return lines


def write_dirty(results: Sequence[Mapping[str, Any]], output: Path) -> str:
    """Write dirty.md with all tables, and dirty.csv with one row for each set.

    Returns:
        A few lines for the terminal.
    """
    data = judged(results)
    short = headlines(data)
    plain = data.drop(columns=["says", "findings"])
    atomic_write_text(output / "dirty.csv", plain.to_csv(index=False))
    parts = [
        f"# Dirty world: {len(data)} sets\n", frame_markdown(short), "\n## Every cell\n",
        frame_markdown(cells(data)), "\n## By effect\n", frame_markdown(by_effect(data)),
        "\n## Misses\n", "".join(f"- {line}\n" for line in misses(data)) or "none\n",
    ]  # fmt: skip
    atomic_write_text(output / "dirty.md", "\n".join(parts))
    return short.to_string(index=False)
