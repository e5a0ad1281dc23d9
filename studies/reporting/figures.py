"""Figures in one style: drawn without global state, saved with the numbers behind them."""

from __future__ import annotations

import functools
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from simgap_files import atomic_path, atomic_write_text

INK, MUTED, GRID = "#24292f", "#6e7781", "#d8dee4"

# Okabe and Ito's palette for all kinds of colour vision (jfly.uni-koeln.de/color, 2008), the
# yellow left out: it is too faint on white.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
BLUE, ORANGE, GREEN, PINK, SKY, AMBER = PALETTE

# What the darkest colours turn into on a dark page.
_DARK = {INK: "#e6edf3", MUTED: "#9aa4af", GRID: "#30363d", BLUE: "#4ba3e0", GREEN: "#22b88a"}

STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.prop_cycle": cycler(color=PALETTE),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlecolor": INK,
    "figure.dpi": 100,
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "svg.fonttype": "path",
    "svg.hashsalt": "simgap",
    "text.color": INK,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 9.5,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 9.5,
}

#: Decorator (and context) for a function that draws: everything in it is made in our style.
styled = functools.partial(matplotlib.rc_context, STYLE)


def new_figure(
    rows: int = 1,
    columns: int = 1,
    *,
    width: float = 6.4,
    height: float = 3.2,
    share_x: bool = False,
    share_y: bool = False,
) -> tuple[Figure, np.ndarray]:
    """An empty figure in our style, without pyplot and its global list of figures.

    Call it, and draw, in a function decorated with ``@styled()``. Text keeps a readable size on
    a phone up to a width of about 6.4 inches.

    Args:
        rows: Axes below each other.
        columns: Axes side by side.
        width: In inches, of the whole figure.
        height: In inches, of the whole figure.
        share_x: One x axis for all.
        share_y: One y axis for all.

    Returns:
        The figure, and its axes in an array of shape (rows, columns).
    """
    with styled():
        figure = Figure(figsize=(width, height))
        axes = figure.subplots(rows, columns, sharex=share_x, sharey=share_y, squeeze=False)
    return figure, axes


@styled()
def lines(
    series: Mapping[str, tuple[ArrayLike, ArrayLike]],
    x_label: str,
    y_label: str,
    *,
    bands: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
    log_x: bool = False,
    log_y: bool = False,
    title: str = "",
    width: float = 6.4,
    height: float = 3.2,
) -> Figure:
    """Curves with a legend, and a shaded band around those that have one.

    Args:
        series: x and y by name, each of shape (n,); a NaN makes a gap.
        x_label: Name and unit.
        y_label: Name and unit.
        bands: Lower and upper y by name, for some or all of ``series``.
        log_x: Logarithmic x.
        log_y: Logarithmic y.
        title: Above the axes.
        width: In inches.
        height: In inches.
    """
    figure, axes = new_figure(width=width, height=height)
    draw_lines(axes[0, 0], series, bands=bands)
    axis: Axes = axes[0, 0]
    axis.set(xlabel=x_label, ylabel=y_label, title=title)
    if log_x:
        axis.set_xscale("log")
    if log_y:
        axis.set_yscale("log")
    if len(series) > 1:
        figure.legend(loc="outside upper left", ncols=min(len(series), 4), handlelength=1.4)
    return figure


def draw_lines(
    axis: Axes,
    series: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    bands: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
) -> None:
    """Draw the curves of ``lines`` into one axis of a figure of your own."""
    for name, (x, y) in series.items():
        x, y = np.asarray(x, float), np.asarray(y, float)
        few = len(x) <= 12
        (curve,) = axis.plot(x, y, label=name, marker="o" if few else None, markersize=4.5)
        if bands and name in bands:
            low, high = bands[name]
            axis.fill_between(
                x, np.asarray(low, float), np.asarray(high, float),
                color=curve.get_color(), alpha=0.18, linewidth=0,
            )  # fmt: skip


def draw_over_time(
    figure: Figure,
    axes: np.ndarray,
    rows: Mapping[str, Mapping[str, tuple[ArrayLike, ArrayLike]]],
) -> None:
    """Draw curves over time below each other, by their label, with one legend above them."""
    for axis, (label, series) in zip(axes, rows.items(), strict=True):
        draw_lines(axis, series)
        axis.set_ylabel(label)
    axes[-1].set_xlabel("time (s)")
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.4
    )


@styled()
def intervals(
    rows: Mapping[str, tuple[float, float, float]],
    label: str,
    *,
    reference: Mapping[str, float] | None = None,
    log: bool = False,
    title: str = "",
    width: float = 6.4,
) -> Figure:
    """One dot with its interval per row, first row on top: bars without the ink.

    Args:
        rows: Value, low and high by name.
        label: Name and unit of the common axis.
        reference: Values by name, drawn as dashed lines across (a noise floor, the paper's).
        log: Logarithmic axis.
        title: Above the axes.
        width: In inches; the height follows from the number of rows.
    """
    figure, axes = new_figure(width=width, height=1.1 + 0.36 * len(rows))
    axis: Axes = axes[0, 0]
    places = np.arange(len(rows))
    value, low, high = np.asarray(list(rows.values()), float).reshape(-1, 3).T
    axis.hlines(places, low, high, color=BLUE, linewidth=5, alpha=0.3)
    axis.plot(value, places, "o", color=BLUE, markersize=7)
    for number, (name, at) in enumerate((reference or {}).items()):
        colour = PALETTE[1 + number % (len(PALETTE) - 1)]
        axis.axvline(at, color=colour, linestyle=(0, (4, 3)), linewidth=1.4, label=name)
    axis.set_yticks(places, list(rows))
    axis.set_ylim(len(rows) - 0.5, -0.5)
    axis.grid(axis="y", visible=False)
    axis.tick_params(axis="y", length=0)
    axis.set(xlabel=label, title=title)
    if log:
        axis.set_xscale("log")
    elif np.nanmin([*low, *(reference or {}).values()]) >= 0:
        # The length from zero is what the eye compares.
        axis.set_xlim(left=0)
    if reference:
        figure.legend(loc="outside upper right", ncols=3, handlelength=1.6)
    return figure


def save_figure(
    figure: Figure, path: str | Path, data: Mapping[str, ArrayLike] | pd.DataFrame
) -> Path:
    """Write a figure as PNG and the numbers behind it as CSV of the same name.

    Args:
        figure: To be saved; both files appear whole or not at all.
        path: Of the PNG.
        data: Columns by name; a shorter column is filled up with empty cells.

    Returns:
        The path of the PNG.

    Raises:
        ValueError: ``path`` does not end in ``.png``.
    """
    path = Path(path)
    if path.suffix != ".png":
        raise ValueError(f"a figure is saved as PNG: {path} should end in .png")
    if not isinstance(data, pd.DataFrame):
        data = pd.DataFrame({name: pd.Series(np.ravel(column)) for name, column in data.items()})
    with atomic_path(path) as temporary:
        temporary.write_bytes(to_png(figure))
    atomic_write_text(path.with_suffix(".csv"), data.to_csv(index=False, lineterminator="\n"))
    return path


def to_png(figure: Figure) -> bytes:
    """The figure as a PNG on white; the same figure gives the same bytes."""
    return _printed(figure, "png", dpi=180, metadata={"Software": None})


def to_svg(figure: Figure) -> bytes:
    """The figure as an SVG without ground; its ink turns light where the reader's page is dark."""
    svg = _printed(figure, "svg", transparent=True, metadata={"Date": None}).decode("utf-8")
    rules = "".join(
        f'[style*="{what}: {light}"]{{{what}:{dark}!important}}'
        for light, dark in _DARK.items()
        for what in ("fill", "stroke")
    )
    style = f"<style>@media (prefers-color-scheme: dark){{{rules}}}</style>"
    return svg.replace("<defs>", style + "<defs>", 1).encode("utf-8")


@styled()
def _printed(figure: Figure, form: str, **options: Any) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form, **options)
    return buffer.getvalue()


def series_data(series: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> dict[str, Sequence[float]]:
    """The columns of ``lines``, for ``save_figure``: two per curve, ``name x`` and ``name y``."""
    columns: dict[str, Sequence[float]] = {}
    for name, (x, y) in series.items():
        columns[f"{name} x"] = np.asarray(x, float).tolist()
        columns[f"{name} y"] = np.asarray(y, float).tolist()
    return columns
