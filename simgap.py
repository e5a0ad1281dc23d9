"""Close the simulation gap: the public names in one import, and the command ``simgap``.

  import simgap
  learnt = simgap.learn_by_difference(nominal, true, task, samples=450, updates=2)

Names are loaded when they are used.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

_HOMES = {
    "sims": (
        "Channel", "EquationOfMotion", "EvaluationProtocol", "FirstOrderSystem", "Leo",
        "Parameter", "Pendulum", "Simulator", "SimulatorEnv", "SwingUp", "System", "Task",
        "Walking", "check_simulator", "load_simulator",
    ),
    "policy": ("Algorithm", "DDPG", "DDPGConfig", "MlpPolicy", "load_policy"),
    "residual": (
        "CorrectedSimulator", "DifferenceModel", "DropoutNet", "Ensemble", "GaussianProcess",
        "Linear", "NamedEffects", "accuracy_along", "load", "save",
    ),
    "residual.trajectories": ("Trajectory", "Transitions"),
    "residual.logs": ("read_logs",),
    "studies.gap.found": ("find_gap",),
    "studies.learning.budget": ("Budget",),
    "studies.learning.loop": ("learn_by_difference",),
    "studies.learning.outcome": ("Learnt",),
}  # fmt: skip
_MODULES = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted(_MODULES)

COMMANDS = {
    "learn": ("studies.learn", "learn to control a system from few samples of it"),
    "find-gap": ("studies.find_gap", "name the physics that a simulator lacks, from logs"),
    "log-info": ("studies.log_info", "what a log file holds, and how to read it"),
    "make-log": ("studies.make_log", "measure a system that hides something, to try find-gap"),
    "report": ("studies.report", "rebuild tables and report of a study's folder"),
    "benchmarks": ("studies.benchmarks", "how fast we are beside our peers"),
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module 'simgap' has no attribute {name!r}")
    check_packages()
    return getattr(importlib.import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_MODULES]


def check_packages() -> None:
    """Raise ``ImportError`` if a package of another project stands in the way of one of ours."""
    home = Path(__file__).resolve().parent
    for name in ("sims", "policy", "residual", "studies"):
        spec = importlib.util.find_spec(name)
        found = list(spec.submodule_search_locations or ()) if spec else []
        if not any(Path(place).resolve().parent == home for place in found):
            where = found[0] if found else spec.origin if spec else "nowhere"
            raise ImportError(
                f"simgap needs its own package {name!r}, but Python finds {where}: rename that "
                "one, or start Python in another folder"
            )


def say_stopped(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """What Python says of an error at the end: a line for Ctrl-C while a command is loaded."""
    if issubclass(kind, KeyboardInterrupt):
        sys.stderr.write("\nstopped; nothing had begun\n")
    else:
        sys.__excepthook__(kind, error, trace)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command ``simgap``: one of the studies by name."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if not given or given[0] not in COMMANDS:
        width = max(map(len, COMMANDS))
        lines = [f"  {name:<{width}}  {words}" for name, (_, words) in COMMANDS.items()]
        usage = "\n".join(["usage: simgap COMMAND [options]", "", *lines, "",
                           "simgap COMMAND --help tells more."])  # fmt: skip
        if given and given[0] in ("-h", "--help"):
            print(usage)
            return
        if given:
            sys.stderr.write(f"error: there is no command {given[0]!r} (see simgap --help)\n")
        else:
            sys.stderr.write(usage + "\n")
        raise SystemExit(2)
    # A user's own classes are named by import path; ours come first.
    sys.path.append(str(Path.cwd()))
    try:
        check_packages()
    except ImportError as error:
        sys.stderr.write(f"error: {error}\n")
        raise SystemExit(2) from None
    sys.excepthook = say_stopped
    study = importlib.import_module(COMMANDS[given[0]][0])
    study.main(given[1:])


if __name__ == "__main__":
    main()
