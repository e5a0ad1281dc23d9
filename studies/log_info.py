"""Say what a log holds: its topics or columns, with samples, rate and range.

  python -m studies.log_info run.mcap
  python -m studies.log_info run.csv dataset.hdf5 lerobot_folder

Names are those that a column map takes (docs/logs.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from residual.logs.clocks import Signal
from residual.logs.sources import matching, signals_of
from studies.running.command import Parser
from studies.running.ending import guarded


def build_parser() -> Parser:
    """The command line."""
    parser = Parser(prog="python -m studies.log_info", description=__doc__)
    parser.add_argument("files", type=str, nargs="+", help="Log files or data set folders.")
    return parser


def describe(path: str | Path) -> str:
    """A table of the fields of a log.

    Raises:
        ValueError: It cannot be read.
    """
    signals, others = signals_of(path)
    width = max(map(len, signals), default=5)
    lines = [f"{path}", f"  {'field':<{width}}  {'samples':>8}  {'Hz':>8}  range"]
    lines += [_line(name, signal, width) for name, signal in signals.items()]
    return "\n".join([*lines, *(f"  no numbers: {reason}" for reason in others.values())])


def _line(name: str, signal: Signal, width: int) -> str:
    steps = np.diff(signal.times)
    steps = steps[steps > 0]
    rate = f"{1 / np.median(steps):8.4g}" if len(steps) else " " * 8
    known = signal.values[np.isfinite(signal.values)]
    span = f"{known.min():.4g} to {known.max():.4g}" if len(known) else "no value"
    return f"  {name:<{width}}  {len(known):>8}  {rate}  {span}"


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    given = build_parser().parse_args(arguments)
    print("\n\n".join(describe(path) for path in matching(given.files)))


if __name__ == "__main__":
    main()
