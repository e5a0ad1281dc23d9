"""Films of a system, if its simulator says how it looks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simgap_files.atomic import atomic_write_bytes
from sims.render import renderer_for
from sims.simulator import Simulator
from studies.learnt.report import read_episodes
from studies.learnt.words import shown
from studies.reporting.media import encode_gif

# So much of an episode is filmed, in s, and of a slow system at least so many control periods.
_SECONDS, _LEAST_STEPS = 6.0, 60
_FRAME = 0.05  # s between pictures, if the control period is shorter


def write_films(results: Mapping[str, Any], folder: Path, simulator: Simulator) -> list[Path]:
    """``films/<policy>.gif`` of the policies that a report shows; none without a renderer."""
    try:
        renderer_for(simulator)
    except ValueError:  # it does not say how it looks, or this machine cannot draw it
        return []
    episodes, paths = read_episodes(results, folder), []
    for name in shown(results):
        if name in episodes:
            paths.append(folder / "films" / f"{name}.gif")
            atomic_write_bytes(paths[-1], film(simulator, episodes[name]["states"]))
    return paths


def film(simulator: Simulator, states: np.ndarray) -> bytes:
    """The first seconds of an episode, shape (T + 1, n_s), or all of a short one, as a GIF."""
    draw = renderer_for(simulator).frame
    stride = max(1, round(_FRAME / simulator.dt))
    steps = max(round(_SECONDS / simulator.dt), _LEAST_STEPS)
    return encode_gif([draw(state) for state in states[:steps:stride]], stride * simulator.dt)
