"""What a fit costs as the data grows: a table, a figure on log axes, and what is wanted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from studies.reporting.figures import draw_lines, legend_above, new_figure, save_figure, styled
from studies.reporting.markdown import filled

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


def fits(records: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The benchmark's records."""
    return [record for record in records if record["test"] == TEST]


def table(records: Sequence[Mapping[str, Any]]) -> str:
    """What fits cost, by estimator and size, in Markdown."""
    forms = dict.fromkeys(_COLUMNS, ".3g") | {"peak_megabytes": ".0f"}
    columns = {title: f"{{{name}:{forms[name]}}}" for name, title in _COLUMNS.items()}
    return filled(fits(records), {"estimator": "{estimator}", "points": "{points}", **columns})


def targets(records: Sequence[Mapping[str, Any]]) -> Iterable[tuple[str, float, str, float]]:
    """What, measured, format and the most that is wanted: time, and error against fewer rows."""
    by_size = {(record["estimator"], record["points"]): record for record in fits(records)}
    for name, most in MOST_SECONDS.items():
        large, middle = (by_size.get((name, size)) for size in (LARGE, MIDDLE))
        if large:
            yield f"{name}: fit of {LARGE} Leo-sized points, s", large["fit_seconds"], ".1f", most
        if large and middle:
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
    table = pd.DataFrame(fits(records), columns=["estimator", "points", *_COLUMNS])
    if table.empty:
        return None
    figure, axes = new_figure(3, 1, height=7.0, share_x=True)
    shown = ("fit_seconds", "peak_megabytes", "held_out_error")
    for axis, column in zip(axes[:, 0], shown, strict=True):
        parts = table.groupby("estimator", sort=False)
        draw_lines(axis, {str(name): (part["points"], part[column]) for name, part in parts})
        axis.set(xscale="log", yscale="log", ylabel=_COLUMNS[column])
    axes[2, 0].set_xlabel("points")
    legend_above(figure, axes[0, 0], 3)
    save_figure(figure, path, table)
    return figure
