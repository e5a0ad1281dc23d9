"""Figures in one style: drawn without global state, saved with the numbers behind them."""

from __future__ import annotations

import functools
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from simgap_files.atomic import atomic_path, atomic_write_text

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

    Returns:
        The figure, and its axes in an array of shape (rows, columns).
    """
    with styled():
        figure = Figure(figsize=(width, height))
        axes = figure.subplots(rows, columns, sharex=share_x, squeeze=False)
    return figure, axes


def draw_lines(axis: Axes, series: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> None:
    """Draw curves into one axis.

    Args:
        axis: Of a figure of ours.
        series: x and y by name, each of shape (n,); a NaN makes a gap.
    """
    for name, (x, y) in series.items():
        x, y = np.asarray(x, float), np.asarray(y, float)
        few = len(x) <= 12
        axis.plot(x, y, label=name, marker="o" if few else None, markersize=4.5)


def legend_above(figure: Figure, axis: Axes, columns: int = 2) -> None:
    """One legend above all axes, of the curves in one of them."""
    curves = axis.get_legend_handles_labels()
    figure.legend(*curves, loc="outside upper left", ncols=columns, handlelength=1.4)


def save_figure(
    figure: Figure, path: str | Path, data: Mapping[str, ArrayLike] | pd.DataFrame
) -> None:
    """Write a figure as PNG and the numbers behind it as CSV of the same name.

    Args:
        figure: To be saved; both files appear whole or not at all.
        path: Of the PNG.
        data: Columns by name; a shorter column is filled up with empty cells.

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
