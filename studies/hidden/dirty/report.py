"""Tables of the dirty world: what was asked for, every cell, and every miss in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from simgap_files import atomic_write_text
from studies.hidden.dirty.score import finite
from studies.hidden.report import count, share
from studies.reporting.markdown import frame_markdown

#: Held-out error over the oracle's that is asked for, and room for "never worse than nominal".
RATIO, SAME = 1.3, 1.02
Row = Mapping[str, Any]


def rows_of(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Settings and scores of every set in one flat row."""
    return [{**result["config"], **result["answers"]["find_gap"]} for result in results]


def _ratio(row: Row) -> float:
    return finite(row["corrected"]) / finite(row["oracle"])


def _close(row: Row) -> bool:
    return _ratio(row) <= RATIO


def _clear(row: Row) -> bool:
    return finite(row["nominal"]) >= 1.5 * finite(row["oracle"])


def _worse(row: Row) -> bool:
    return finite(row["corrected"]) > SAME * finite(row["nominal"])


def _hits(part: Sequence[Row], test: Callable[[Row], Any]) -> int:
    return sum(bool(test(row)) for row in part)


def _count(part: Sequence[Row], test: Callable[[Row], Any]) -> str:
    return count(_hits(part, test), len(part))


def headlines(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """What is asked, how often it should be so, and how often it was."""
    hidden = [r for r in rows if r["block"] == "hidden"]
    dirt = [r for r in rows if r["block"] == "dirt only"]
    removed = [r for r in rows if r["block"] == "removed"]
    known = [r for r in hidden if r.get("covered") is not None]
    found: list[tuple[str, str, str]] = []

    def add(what: str, wanted: str, part: Sequence[Row], test: Callable[[Row], Any]) -> None:
        if part:
            found.append((what, wanted, share(_hits(part, test), len(part))))

    add("hidden effect first", "", hidden, lambda r: r["first"])
    add("or its family", "95 %", hidden, lambda r: r["family"])
    add("the same, where the oracle takes a third off", "", [r for r in hidden if _clear(r)],
        lambda r: r["family"])  # fmt: skip
    add("or among the alternatives of the first", "", hidden, lambda r: r["among"])
    add("nothing named", "", hidden, lambda r: not r["named"])
    add("a confirmed wrong name", "at most 2 %", hidden, lambda r: r["wrong_sure"])
    add("the same, parameters that are truly off left out", "", hidden,
        lambda r: set(r["wrong_sure"]) - set(r["truly_off"]))  # fmt: skip
    add("held-out error at most 1.3 times the oracle's", "95 %", hidden, _close)
    add("95 % intervals with the oracle's strength", "85 %", known, lambda r: r["covered"])
    add("with the true strength", "", known, lambda r: r.get("covered_truth"))
    add("with one of the two", "", known, lambda r: r["covered"] or r.get("covered_truth"))
    add("removed from the library: a confirmed wrong name", "at most 2 %", removed,
        lambda r: r["wrong_sure"])  # fmt: skip
    add("the same, parameters that are truly off left out", "", removed,
        lambda r: set(r["wrong_sure"]) - set(r["truly_off"]))  # fmt: skip
    add("removed: any name", "", removed, lambda r: r["named"])
    add("dirt alone: a confirmed name", "at most 2 %", dirt, lambda r: r["sure"])
    add("the same, parameters that are truly off left out", "", dirt,
        lambda r: set(r["sure"]) - set(r["truly_off"]))  # fmt: skip
    add("dirt alone: any name", "", dirt, lambda r: r["named"])
    add("corrected worse than the nominal, held out", "0 %", rows, _worse)
    seconds = sorted(float(r["seconds"]) for r in rows)
    if seconds:
        middle, most = seconds[len(seconds) // 2], seconds[-1]
        found.append(("processor s, median and worst", "", f"{middle:.0f} and {most:.0f}"))
    return found


def cells(rows: Sequence[Row]) -> pd.DataFrame:
    """One row for each block, system and layout."""
    found = []
    keys = sorted({(r["block"], r["system"], r["layout"]) for r in rows})
    for block, system, layout in keys:
        cell = (block, system, layout)
        part = [r for r in rows if (r["block"], r["system"], r["layout"]) == cell]
        inside = [r for r in part if r["block"] == "hidden"]
        known = [r for r in inside if r.get("covered") is not None]
        seconds = sorted(float(r["seconds"]) for r in part)
        found.append(
            {
                "block": block, "system": system, "records": layout, "sets": len(part),
                "first": _count(inside, lambda r: r["first"]),
                "or family": _count(inside, lambda r: r["family"]),
                "among": _count(inside, lambda r: r["among"]),
                "named": _count(part, lambda r: r["named"]),
                "confirmed": _count(part, lambda r: r["sure"]),
                "wrong confirmed": _count(part, lambda r: r["wrong_sure"]),
                "error <= 1.3": _count(inside, _close),
                "cover": _count(known, lambda r: r["covered"]),
                "worse": _count(part, _worse),
                "s": round(seconds[len(seconds) // 2]),
                "s most": round(seconds[-1]),
            }
        )  # fmt: skip
    return pd.DataFrame(found)


def by_effect(rows: Sequence[Row]) -> pd.DataFrame:
    """One row for each hidden effect."""
    found = []
    for system, label in sorted({(r["system"], r["hidden"]) for r in rows if r["hidden"]}):
        part = [r for r in rows if (r["system"], r["hidden"]) == (system, label)]
        inside = [r for r in part if r["block"] == "hidden"]
        if not inside:
            continue
        said = [r["named"][0] if r["named"] else "nothing" for r in inside if not r["family"]]
        found.append(
            {
                "system": system, "hidden": label, "sets": len(inside),
                "or family": _count(inside, lambda r: r["family"]),
                "error <= 1.3": _count(inside, _close),
                "called": ", ".join(said),
            }
        )  # fmt: skip
    return pd.DataFrame(found)


def misses(rows: Sequence[Row]) -> list[str]:
    """Every miss in words, one line each."""
    lines = []
    for row in rows:
        what = f"{row['block']}, {row['system']}, {row['layout']}, seed {row['seed']}"
        what += f": {row['hidden']}" if row["hidden"] else ""
        told = ", ".join(row["named"]) or "nothing"
        if row["block"] == "hidden" and not row["family"]:
            lines.append(f"{what} was called {told}")
        if row["wrong_sure"]:
            wrong = [
                f"{name} (truly off)" if name in row["truly_off"] else name
                for name in row["wrong_sure"]
            ]
            lines.append(f"{what}: confirmed {', '.join(wrong)}")
        if row["block"] == "hidden" and not _close(row):
            lines.append(f"{what}: {_ratio(row):.2f} times the oracle's error (named {told})")
        if _worse(row):
            times = finite(row["corrected"]) / finite(row["nominal"])
            lines.append(
                f"{what}: corrected {times:.2f} times as bad as the nominal (named {told})"
            )
    return lines


def summary(results: Sequence[Mapping[str, Any]]) -> str:
    """A few lines for the terminal."""
    table = pd.DataFrame(headlines(rows_of(results)), columns=["what", "wanted", "found"])
    return table.to_string(index=False)


def write_dirty(results: Sequence[Mapping[str, Any]], output: Path) -> None:
    """Write dirty.md with all tables, and dirty.csv with one row for each set."""
    rows = rows_of(results)
    frame = pd.DataFrame(rows).drop(columns=["says", "findings"])
    atomic_write_text(output / "dirty.csv", frame.to_csv(index=False))
    told = pd.DataFrame(headlines(rows), columns=["what", "wanted", "found"])
    parts = [
        f"# Dirty world: {len(rows)} sets\n", frame_markdown(told), "\n## Every cell\n",
        frame_markdown(cells(rows)), "\n## By effect\n", frame_markdown(by_effect(rows)),
        "\n## Misses\n", "".join(f"- {line}\n" for line in misses(rows)) or "none\n",
    ]  # fmt: skip
    atomic_write_text(output / "dirty.md", "\n".join(parts))
