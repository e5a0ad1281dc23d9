"""Films of a system, and pictures of them side by side, if its simulator says how it looks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from simgap_files.atomic import atomic_write_bytes
from sims.render import renderer_for
from sims.simulator import Simulator
from studies.learnt.report import read_episodes
from studies.learnt.words import shown
from studies.reporting.figures import new_figure, styled, to_png
from studies.reporting.media import encode_gif

# So much of an episode is filmed, in s, and of a slow system at least so many control periods.
_SECONDS, _LEAST_STEPS = 6.0, 60
_FRAME = 0.05  # s between pictures, if the control period is shorter
#: Pictures beside each other.
_PICTURES = 8
SIDE_BY_SIDE = "side_by_side.png"


def write_films(results: Mapping[str, Any], folder: Path, simulator: Simulator) -> None:
    """``films/<policy>.gif`` of the policies that a report shows, and one picture of them all.

    Nothing without a renderer.
    """
    try:
        renderer_for(simulator)
    except ValueError:  # it does not say how it looks, or this machine cannot draw it
        return
    episodes, seen = read_episodes(results, folder), {}
    for name, title in shown(results).items():
        if name in episodes:
            seen[title] = episodes[name]["states"]
            atomic_write_bytes(folder / "films" / f"{name}.gif", film(simulator, seen[title]))
    if seen:
        picture = to_png(side_by_side(simulator, seen))
        atomic_write_bytes(folder / "films" / SIDE_BY_SIDE, picture)


def film(simulator: Simulator, states: np.ndarray) -> bytes:
    """The first seconds of an episode, shape (T + 1, n_s), or all of a short one, as a GIF."""
    draw = renderer_for(simulator).frame
    stride = max(1, round(_FRAME / simulator.dt))
    steps = _filmed(simulator)
    return encode_gif([draw(state) for state in states[:steps:stride]], stride * simulator.dt)


@styled()
def side_by_side(simulator: Simulator, episodes: Mapping[str, np.ndarray]) -> Figure:
    """The first seconds of episodes, one row of pictures each; one that has ended stands still.

    Args:
        simulator: Says how it looks.
        episodes: States, shape (T + 1, n_s), by name.
    """
    draw = renderer_for(simulator).frame
    rows = np.linspace(0, _filmed(simulator), _PICTURES).round().astype(int)
    figure, axes = new_figure(len(episodes), 1, height=0.4 + 1.05 * len(episodes), share_x=True)
    for axis, (name, states) in zip(axes[:, 0], episodes.items(), strict=True):
        strip = np.hstack([draw(states[min(row, len(states) - 1)]) for row in rows])
        axis.imshow(strip)
        axis.set_title(name)
        axis.set_yticks([])
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        width = strip.shape[1] / _PICTURES
        seconds = [f"{float(f'{row * simulator.dt:.2g}'):g} s" for row in rows]
        axis.set_xticks((np.arange(_PICTURES) + 0.5) * width, seconds)
    return figure


def _filmed(simulator: Simulator) -> int:
    """Control periods that are shown."""
    return max(round(_SECONDS / simulator.dt), _LEAST_STEPS)
