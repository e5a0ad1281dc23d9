"""``find_gap`` for Python and notebooks: it shows progress, and its answer shows itself."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from residual import gap
from residual.gap.clock import usual_minutes
from residual.gap.find import hosting
from residual.logs import LogData
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.host import HostSimulator
from studies.running.progress import Bars

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True, repr=False)
class FoundGap(gap.GapResult):
    """What ``find_gap`` found, with everything that a notebook shows of it."""

    def to_dataframe(self) -> pd.DataFrame:
        """One row per number of every verdict: its value, 95 % interval and unit."""
        import pandas as pd

        rows: list[dict[str, Any]] = []
        for verdict in self.verdicts:
            row = {"kind": verdict.kind, "effect": verdict.label,
                   "share": verdict.share.value}  # fmt: skip
            numbers = [
                {"parameter": name, **dataclasses.asdict(number)}
                for name, number in verdict.parameters.items()
            ]
            rows += [row | number for number in numbers or [{}]]
        columns = ["kind", "effect", "share", "parameter", "value", "low", "high", "unit"]
        return pd.DataFrame(rows, columns=columns)

    def plot(self) -> Figure:
        """The forecast error, from the nominal simulator to the noise floor."""
        from studies.gap.figures import shrinking

        return shrinking(self)

    def report(self, path: str | Path) -> Path:
        """Write one HTML page (and figures beside it) and return its path."""
        from studies.gap.files import gap_record, write_report

        path = Path(path)
        logs = list(dict.fromkeys(shown.run for shown in self.rollouts))
        config = {"simulator": self.corrected.name, "logs": logs}
        return write_report(self, gap_record(self, config), path.parent, path.name)

    def __str__(self) -> str:
        from studies.gap.summary import summary

        return summary(self)

    def _repr_html_(self) -> str:
        from html import escape

        from studies.gap.lead import lead

        table = self.to_dataframe().to_html(index=False, float_format="{:.4g}".format, na_rep="")
        return f"<p>{escape(lead(self))}</p>{table}"


def find_gap(
    simulator: HostSimulator,
    trajectories: Trajectory | Iterable[Trajectory] | LogData,
    *,
    effects: Iterable[Effect | str | Mapping[str, Any]] | None = None,
    minutes: float | None = None,
    progress: Callable[[str], None] | None = None,
    **options: Any,
) -> FoundGap:
    """Find where a simulator and measured logs disagree, and name what is missing.

    Args:
        simulator: The nominal simulator.
        trajectories: Measured runs, or what ``read_logs`` returned.
        effects: What may be missing, as objects or as on the command line: ``"library"``,
            ``"viscous_friction"``, ``"delay@voltage"``, ``"mass"``, the import path of a class of
            your own; by default all that the simulator can host.
        minutes: Budget of processor time, by default 2, and 6 for what strikes the ground.
        progress: Called with a line of text now and then; by default a bar on stderr or in the
            notebook shows them.
        options: ``held_out`` and more, see ``residual.gap.find_gap``; errors as there.

    Returns:
        The verdicts and everything behind them.
    """
    options |= {"effects": effects, "minutes": minutes}
    if progress is not None:
        found = gap.find_gap(simulator, trajectories, progress=progress, **options)
    else:
        budget = round(60 * (minutes or usual_minutes(hosting(simulator))))
        begin = time.process_time()
        with Bars().task("find_gap", budget) as tell:

            def show(line: str) -> None:
                tell(min(int(time.process_time() - begin), budget), line.strip()[:60])

            found = gap.find_gap(simulator, trajectories, progress=show, **options)
            tell(budget)
    return FoundGap(**{f.name: getattr(found, f.name) for f in dataclasses.fields(found)})
