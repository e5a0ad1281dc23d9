"""What a fit costs as the data grows: a table, a figure on log axes, and what is wanted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from studies.reporting.figures import draw_lines, new_figure, save_figure, styled

TEST = "test_fit_at_scale"
# Most seconds for 100 000 rows.
MOST_SECONDS = {"Linear": 5.0, "GaussianProcess": 120.0, "DropoutNet": 180.0}
LARGE, MIDDLE = 100_000, 10_000

_COLUMNS = {
    "fit_seconds": "s",
    "processor_seconds": "processor s",
    "peak_megabytes": "peak memory, MB",
    "held_out_error": "held-out error",
}


def fits(records: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """The benchmark's records as a table: ``estimator``, ``points`` and what was measured."""
    found = [record for record in records if record["test"] == TEST]
    return pd.DataFrame(found, columns=["estimator", "points", *_COLUMNS])


def table_rows(records: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of a Markdown table, by estimator and size."""
    rows = [
        [
            row["estimator"],
            f"{row['points']}",
            f"{row['fit_seconds']:.3g}",
            f"{row['processor_seconds']:.3g}",
            f"{row['peak_megabytes']:.0f}",
            f"{row['held_out_error']:.3g}",
        ]
        for row in fits(records).to_dict("records")
    ]
    return ["estimator", "points", *_COLUMNS.values()], rows


def targets(records: Sequence[Mapping[str, Any]]) -> Iterable[tuple[str, float, str, float]]:
    """What, measured, format and the most that is wanted: time, and error against fewer rows."""
    table = fits(records).set_index(["estimator", "points"])
    for name, most in MOST_SECONDS.items():
        if (name, LARGE) not in table.index:
            continue
        large: Any = table.loc[(name, LARGE)]
        yield f"{name}: fit of {LARGE} Leo-sized points, s", large["fit_seconds"], ".1f", most
        if (name, MIDDLE) in table.index:
            middle: Any = table.loc[(name, MIDDLE)]
            what = f"the same: held-out error, against that at {MIDDLE}"
            yield what, large["held_out_error"], ".3g", middle["held_out_error"]


@styled()
def write_figure(records: Sequence[Mapping[str, Any]], path: Path) -> Figure | None:
    """Seconds, peak memory and held-out error against the number of rows, all on log axes.

    Args:
        records: Of all benchmarks.
        path: PNG to write; the numbers go into a CSV beside it.

    Returns:
        The figure, or nothing if no fit was measured.
    """
    table = fits(records)
    if table.empty:
        return None
    figure, axes = new_figure(3, 1, height=7.0, share_x=True)
    for axis, column in zip(
        axes[:, 0], ("fit_seconds", "peak_megabytes", "held_out_error"), strict=True
    ):
        draw_lines(
            axis,
            {
                str(name): (part["points"], part[column])
                for name, part in table.groupby("estimator", sort=False)
            },
        )
        axis.set(xscale="log", yscale="log", ylabel=_COLUMNS[column])
    axes[2, 0].set_xlabel("points")
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3, handlelength=1.4
    )
    save_figure(figure, path, table)
    return figure
