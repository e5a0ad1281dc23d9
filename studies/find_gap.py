"""Find where a simulator and measured logs disagree, and name the effect that is missing.

The command reads the logs, asks whether there is a gap above the noise, looks for the named
physical effects that explain it, and confirms them by forecasts of data that did not fit their
numbers. The answer is printed; gap.json, report.html and corrected.yaml go into the output folder.

  python -m studies.find_gap --simulator sims.pendulum.Pendulum --logs run.csv --output results/gap
  python -m studies.find_gap --simulator my_file.MyArm --logs a.csv b.parquet --output results/gap
  python -m studies.find_gap ... --held-out fast.csv --minutes 5
  python -m studies.find_gap ... --columns columns.yaml --hold "{torque: linear}"
  python -m studies.find_gap ... --effects library my_file.FanTorque --tolerance 0.01

No log at hand? `python -m studies.make_log --output logs` measures a pendulum whose mass the
simulator does not know.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jsonargparse.typing import ClosedUnitInterval, PositiveFloat, PositiveInt

from residual.gap import GapResult, find_gap
from residual.gap.clock import usual_minutes
from residual.gap.data.own_period import own_period
from residual.gap.find import hosting
from residual.logs import LogData, LogFormat, read_logs
from residual.logs.checks import Finding
from residual.logs.sources import matching
from residual.step_check import advice
from sims.chosen import LIBRARY, chosen_effects
from sims.host import HostSimulator
from sims.simulator import Hold, Simulator
from sims.trust import needs_trust
from studies.gap.progress import Heartbeat
from studies.gap.summary import found_in_data, summary
from studies.running.command import Parser
from studies.running.ending import check_output, guarded


@dataclasses.dataclass(frozen=True)
class GapStudy:
    """What the answer depends on.

    Args:
        simulator: The nominal simulator: an import path, a robot's model (.xml, .urdf), or a YAML
            file with class_path and init_args.
        columns: Which column of the logs holds what: settings, or a YAML file of them. By
            default columns are named like the simulator's channels.
        tolerance: Forecast error that does not matter, in the unit of the first measured
            position.
        hold: How inputs run between samples: held ("zero"), as commands are, straight to the next
            ("linear"), as most inputs measured at the actuator are, or whichever the nominal
            simulator fits better ("auto"); for all inputs or by name, {torque: linear}. What
            happens before an input said to be "linear" (dead zone, lag) is no candidate.
        horizon: Forecast length in s that matters to you; by default a third of the usual
            period of the motion.
        parameter_tolerance: How well the parameters of the simulator are known, as a share of
            each: an effect is certain only if they cannot stand in for it within that, and its
            interval allows for them; 0 takes them for exact.
        minutes: Budget of processor time, by default 2, and 6 for what strikes the ground; what has
            not been tried by then is left out.
    """

    simulator: Simulator
    columns: LogFormat = dataclasses.field(default_factory=LogFormat)
    tolerance: PositiveFloat | None = None
    hold: str | dict[str, str] = "auto"
    horizon: PositiveFloat | None = None
    parameter_tolerance: ClosedUnitInterval = 0.03
    minutes: PositiveFloat | None = None


def build_parser() -> Parser:
    """The command line of this study."""
    parser = Parser(prog="python -m studies.find_gap", description=__doc__)
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--logs",
        type=str,
        nargs="+",
        required=True,
        help="Logs: CSV and other text, Parquet, NPZ, MCAP, HDF5, folders of LeRobot or Minari.",
    )
    parser.add_argument(
        "--held-out",
        type=str,
        nargs="+",
        help="Log files set aside: never used to find the answer, only for the last table.",
    )
    parser.add_argument(
        "--output", type=Path, required=True, help="Folder for the report and the numbers."
    )
    parser.add_argument(
        "--effects",
        type=str | dict[str, Any],
        nargs="+",
        default=[LIBRARY],
        help="What may be missing: 'library' for all that the simulator can host, effects by "
        "name (viscous_friction, delay@voltage, mass), or a class of your own by import path.",
    )
    parser.add_argument(
        "--jobs", type=PositiveInt, default=1, help="Processes, for a simulator that is slow."
    )
    parser.add_class_arguments(GapStudy, sub_configs=True)
    return parser


def run(
    settings: Mapping[str, Any],
    output: str | Path,
    jobs: int = 1,
    progress: Callable[[str], None] | None = None,
    budget: Callable[[float], None] = lambda _: None,
) -> GapResult:
    """Read logs, find the gap and write everything into ``output``; as the command does.

    Args:
        settings: As in a config file: ``simulator`` and ``logs``, and whatever else is not to be
            at its default.
        output: Folder for the report and the numbers.
        jobs: Processes, for a simulator that is slow.
        progress: Called with a line of text now and then.
        budget: Called with the seconds of processor time that searching may take.

    Returns:
        What was found.

    Raises:
        ValueError: A log, the simulator or an effect cannot be used; the message is one line.
        SystemExit: A setting is wrong, or the folder cannot be written; one line on stderr says
            which.
    """
    begin = time.perf_counter()
    tell = progress or (lambda _: None)
    parser = build_parser()
    chosen = parser.parse_object({**settings, "output": str(output), "jobs": jobs})
    plain = parser.plain(chosen)
    config = {key: plain[key] for key in (*_FIELDS, "logs", "held_out", "effects")}
    made = parser.instantiate(chosen)
    study = GapStudy(**{name: made[name] for name in _FIELDS})
    simulator = hosting(study.simulator)
    hold = holds(simulator, study.hold)
    effects = chosen_effects(simulator, chosen.effects)
    check_output(output)
    from studies.gap.files import write_gap  # pictures: a second to load, for no wrong word

    logs, held_out = matching(chosen.logs), matching(chosen.held_out or [])
    # A pattern may match other files another day.
    config |= {"logs": logs, "held_out": held_out or plain["held_out"]}
    # In whatever order the files come, not one digit of the answer changes.
    data = read(simulator, sorted(logs), study.columns)
    held = apart(simulator, logs, held_out, study.columns)
    rows = sum(len(run.times) for run in data.trajectories)
    count = len(data.trajectories)
    tell(f"{count} {'trajectory' if count == 1 else 'trajectories'}, {rows} samples")
    aside = [
        dataclasses.replace(one, where=f"records set aside: {one.where}")
        for one in (held.findings if held else ())
    ]
    findings = [*data.findings, *aside]
    for line in found_in_data(findings):
        tell(f"data: {line}")
    tell("checking the integration step")
    steps = advice(simulator, data.trajectories)
    for line in steps:
        tell(line)
    moved = simulator.for_motion([run.states for run in data.trajectories])
    minutes = study.minutes or usual_minutes(moved)
    budget(60 * minutes)
    result = find_gap(
        simulator,
        data,
        held_out=held or (),
        tolerance=study.tolerance,
        effects=effects,
        hold=hold or None,
        # What happens before a measured input is recorded in it already.
        measured_input=[name for name, kind in hold.items() if kind == "linear"],
        horizon=study.horizon,
        parameter_tolerance=study.parameter_tolerance,
        minutes=minutes,
        n_jobs=jobs,
        progress=tell,
    )
    tell("writing the report")
    shows = (Finding("step", "", line, severity="warning") for line in steps)
    result = dataclasses.replace(result, quality=(*shows, *result.quality))
    write_gap(result, output, config, findings, time.perf_counter() - begin)
    grave = found_in_data([found for found in findings if found.severity == "warning"])
    first = tuple(Finding("log", "", line) for line in grave)
    return dataclasses.replace(result, quality=(*first, *result.quality))


def holds(simulator: HostSimulator, hold: str | Mapping[str, str]) -> dict[str, Hold]:
    """What the user says of every input, by name; empty if the data are to decide.

    Raises:
        ValueError: There is no such input, or no such way to run.
    """
    names = [channel.name for channel in simulator.action_channels]
    each = hold if isinstance(hold, Mapping) else dict.fromkeys(names, hold)
    unknown = ", ".join(name for name in each if name not in names)
    if unknown:
        raise ValueError(f"--hold: no input {unknown}; there are {', '.join(names) or 'none'}")
    ways: dict[str, Hold] = {"zero": "zero", "linear": "linear"}
    for name, way in each.items():
        if way not in ways and hold != "auto":
            known = "zero or linear" if isinstance(hold, Mapping) else "zero, linear or auto"
            raise ValueError(f"--hold is {way!r} for {name}, expected {known}")
    return {name: ways[way] for name, way in each.items() if way in ways}


def read(simulator: HostSimulator, logs: Sequence[str], columns: LogFormat) -> LogData:
    """The logs, by the simulator's channels; see ``read_logs``."""
    data = read_logs(logs, simulator.physical_channels, simulator.action_channels, columns)
    period = own_period(simulator, columns.period)
    return dataclasses.replace(data, findings=(*data.findings, *period))


def apart(
    simulator: HostSimulator, logs: Sequence[str], held_out: Sequence[str], columns: LogFormat
) -> LogData | None:
    """The logs that were set aside, if any.

    Raises:
        ValueError: One of them is used to find the answer, too.
    """
    if not held_out:
        return None
    used = {Path(log).resolve() for log in logs}
    both = [log for log in held_out if Path(log).resolve() in used]
    if both:
        raise ValueError(f"{both[0]} is in --logs and in --held-out, expected it in one of them")
    return read(simulator, sorted(held_out), columns)


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = build_parser()
    given = parser.parse_args(arguments)
    settings = parser.plain(given)
    output, jobs = Path(settings.pop("output")), settings.pop("jobs")
    settings.pop("config", None)
    with Heartbeat() as tell:
        result = run(settings, output, jobs, tell, tell.until)
    from studies.gap.files import CORRECTED, REPORT

    print(f"\n{summary(result, settings['tolerance'])}\n\nreport:              {output / REPORT}")
    print(f"corrected simulator: {output / CORRECTED}")
    if strange := needs_trust(settings["simulator"]):
        package = strange.partition(".")[0]
        print(f"  names a class of yours: as --simulator it needs --trust {package}, in Python")
        print(f"  load_simulator({str(output / CORRECTED)!r}, trusted=[{package!r}])")
    for name in result.corrected.own_files():
        print(f"corrected model:     {output / name}")
    for line in result.corrected.not_in_own_files():
        print(f"  only in {CORRECTED}: {line}")


_FIELDS = tuple(field.name for field in dataclasses.fields(GapStudy))


if __name__ == "__main__":
    main()
