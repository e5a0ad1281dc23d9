"""A rig asked and judged: its names by the key, three simulators on the judge part."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import studies
from residual.gap.result import Verdict
from residual.logs import LogFormat
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library
from sims.host import HostSimulator
from sims.loading import load_simulator
from studies import find_gap
from studies.gap.files import CORRECTED
from studies.judging.forecasts import Forecasts, plan, root_mean_squares
from studies.judging.oracle import fit_effects
from studies.real import phone
from studies.real.prepare import local_slope
from studies.real.rigs import Part, Rig


@dataclasses.dataclass(frozen=True)
class Named:
    """Names against a key.

    Attributes:
        right: For each thing that is wanted: ``"confirmed"``, ``"one of ..."`` families, or
            ``"missing"``.
        wrong: Confirmed labels that the key does not support; an exact twin of what it supports,
            which no motion tells from that, is none.
    """

    right: tuple[str, ...]
    wrong: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Everything wanted is confirmed, or one of at most two families."""
        return all(how in ("confirmed", "one of 1", "one of 2") for how in self.right)


def named(rig: Rig, simulator: HostSimulator, verdicts: Sequence[Verdict]) -> Named:
    """Compare verdicts with the key of a rig."""
    family = {str(effect): _family(effect, simulator) for effect in library(simulator)}
    chosen = [v for v in verdicts if v.effect and v.kind in ("confirmed", "ambiguous")]
    right = []
    for accepted in rig.wanted:
        offers = [{v.label, *v.alternatives} for v in chosen]
        families = [{family.get(name, name) for name in some} for some in offers if some & accepted]
        if any(v.kind == "confirmed" and v.label in accepted for v in chosen):
            right.append("confirmed")
        else:
            right.append(f"one of {len(families[0])}" if families else "missing")
    sure = [v for v in verdicts if v.kind == "confirmed" and v.effect]
    wrong = [v.label for v in sure if rig.allowed.isdisjoint((v.label, *v.same_motion))]
    return Named(tuple(right), tuple(wrong))


def _family(effect: Effect, simulator: HostSimulator) -> str:
    """Family and place, so that the friction of two joints is not one thing."""
    family = effect.family_in(simulator)
    return f"{family}@{effect.where}" if family and effect.enters != "parameter" else str(effect)


CONFIGS = Path(studies.__file__).parent / "configs" / "find_gap"


@dataclasses.dataclass(frozen=True)
class Judged:
    """How a rig went.

    Attributes:
        rig: Its name.
        said: Every verdict about an effect, in short.
        named: What the key thinks of the names.
        nominal, corrected, repaired: Errors on the judge part, by group of channels; repaired is
            the nominal with the key's effects, fitted on the fit part by the same forecasts.
        repair: The key's effects as fitted.
        seconds: Processor time of find_gap, with its report.
    """

    rig: str
    said: tuple[str, ...]
    named: Named
    nominal: dict[str, float]
    corrected: dict[str, float]
    repaired: dict[str, float]
    repair: tuple[str, ...]
    seconds: float

    @property
    def ratio(self) -> float:
        """Corrected over repaired error, of the worst group."""
        return max(self.corrected[g] / self.repaired[g] for g in self.corrected)


def files_of(rig: Rig, part: Part, data: Path, scratch: Path) -> list[Path]:
    """The logs of a part, made readable where the rig needs it."""
    found = []
    for name in part.files:
        source = data / rig.folder / name
        if rig.prepare:
            target = scratch / f"{rig.name}-{name}"
            if not target.exists():
                rig.prepare(source, target)
            source = target
        found.append(source)
    return found


class Judge:
    """Judges any simulator of one rig; measured runs are read as find_gap reads them.

    Args:
        rig: Which.
        data: Folder of all rigs.
        scratch: Folder for logs that have to be prepared.
    """

    def __init__(self, rig: Rig, data: Path, scratch: Path) -> None:
        self.rig = rig
        logs = files_of(rig, rig.fit, data, scratch)
        parser = find_gap.build_parser()
        config = str(CONFIGS / f"{rig.name}.yaml")
        given = parser.parse_args(
            ["--config", config, "--logs", *map(str, logs), "--output", "unused"]
        )
        ours = ("output", "jobs", "config")
        self.settings = {k: v for k, v in parser.plain(given).items() if k not in ours}
        made = parser.instantiate(given)
        self.simulator: HostSimulator = made["simulator"]
        if hold := find_gap.holds(self.simulator, made["hold"]):
            self.simulator = self.simulator.with_hold(hold)
        self._format: LogFormat = made["columns"]
        self._fit = self._read(rig.fit, logs)
        self._runs = self._read(rig.judge, files_of(rig, rig.judge, data, scratch))

    def errors(self, simulator: HostSimulator) -> dict[str, float]:
        """Forecast errors on the judge part by group of channels: root of the sum of squares."""
        if self.rig.folder == "phone-drop":
            return {"speed change": phone.speed_change_error(simulator, self._runs)}
        found = root_mean_squares(simulator, self._plan(self._runs))
        return {
            " ".join(group): float(np.sqrt(sum(found[channel] ** 2 for channel in group)))
            for group in self.rig.judged
        }

    def repaired(self) -> HostSimulator:
        """The nominal simulator with the key's effects, fitted on the fit part."""
        if self.rig.folder == "phone-drop":
            return self.simulator.with_effects([phone.fit_drag(self.simulator, self._fit)])
        channels = [channel for group in self.rig.judged for channel in group]
        found = fit_effects(self.simulator, self.rig.key, self._plan(self._fit), channels)
        return self.simulator.with_effects(found)

    def _plan(self, runs: Sequence[Trajectory]) -> list[Forecasts]:
        return plan(self.simulator, runs, self.rig.horizon)

    def _read(self, part: Part, logs: Sequence[Path]) -> list[Trajectory]:
        given = {name: getattr(part, name) for name in ("start", "stop", "only")}
        changed = {name: value for name, value in given.items() if value is not None}
        states = {**self._format.states, **self.rig.derived}
        layout = dataclasses.replace(self._format, states=states, **changed)
        data = find_gap.read(self.simulator, [str(log) for log in logs], layout)
        if self.rig.slopes is None:
            return list(data.trajectories)
        return [self._derived(run, self.rig.slopes) for run in data.trajectories]

    def _derived(self, run: Trajectory, width: float) -> Trajectory:
        """With the rates that were not measured, from the positions around each sample."""
        states = np.array(run.states)
        names = [channel.name for channel in self.simulator.physical_channels]
        for column, channel in enumerate(self.simulator.physical_channels):
            if channel.rate_of and np.isnan(states[:, column]).all():
                position = states[:, names.index(channel.rate_of)]
                states[:, column] = local_slope(run.times, position, width)
        return dataclasses.replace(run, states=states)


def ask(
    rig: Rig, data: Path, output: Path, progress: Callable[[str], None] | None = None
) -> Judged:
    """find_gap with its default options on a rig, and what the key says of the answer.

    Args:
        rig: Which.
        data: Folder of all rigs.
        output: Folder for the answer.
        progress: Called with a line of text now and then.
    """
    output.mkdir(parents=True, exist_ok=True)
    judge = Judge(rig, data, output)
    begin = time.process_time()
    result = find_gap.run(judge.settings, output, 1, progress)
    seconds = time.process_time() - begin
    with contextlib.redirect_stdout(io.StringIO()):
        corrected = load_simulator(output / CORRECTED)
    assert isinstance(corrected, HostSimulator)
    repaired = judge.repaired()
    return Judged(
        rig.name,
        tuple(_short(verdict) for verdict in result.verdicts),
        named(rig, judge.simulator, result.verdicts),
        judge.errors(judge.simulator),
        judge.errors(corrected),
        judge.errors(repaired),
        tuple(_numbers(effect) for effect in repaired.effects),
        seconds,
    )


def _short(verdict: Verdict) -> str:
    if not verdict.effect:
        return verdict.kind
    numbers = ", ".join(f"{n.value:.3g} {n.unit}" for n in verdict.parameters.values())
    others = f" or {', '.join(verdict.alternatives)}" if verdict.alternatives else ""
    return f"{verdict.kind}: {verdict.label} {numbers}{others}"


def _numbers(effect: Effect) -> str:
    values = ", ".join(f"{getattr(effect, name):.4g}" for name in effect.strengths())
    return f"{effect} {values}"
