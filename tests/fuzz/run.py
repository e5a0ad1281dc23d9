"""Damage thousands of files and see that none does harm; prints a table. See docs/reliability.md.

python tests/fuzz/run.py logs --count 10000
"""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections import Counter
from pathlib import Path

import numpy as np


class Late(BaseException):
    """No end in sight; nothing that is tested may catch it."""


AREAS = ("logs", "models", "results", "configs", "simulators")
#: Nothing may compute so long, or wait ten times as long.
SECONDS = 60


def attempts(area: str, count: int, folder: Path, first: int = 0):
    """Outcomes of so many attempts: number, kind, how it ended."""
    module = importlib.import_module(f"fuzzed_{area}")
    for number in range(first, first + count):
        kind = module.KINDS[number % len(module.KINDS)]
        rng = np.random.default_rng([zlib.crc32(area.encode()), number])
        yield number, kind, lambda kind=kind, rng=rng: module.attempt(kind, rng, folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="number of the first attempt")
    parser.add_argument("--folder", type=Path, help="keep the last files here")
    given = parser.parse_args()
    folder = given.folder or Path(tempfile.mkdtemp(prefix="simgap-fuzz-"))
    folder.mkdir(parents=True, exist_ok=True)

    def late(*_: object) -> None:
        raise Late(f"no end after {SECONDS} s")

    for number in (signal.SIGALRM, signal.SIGPROF):
        signal.signal(number, late)
    ends: dict[str, Counter[str]] = {}
    defects, longest, begin = 0, 0.0, time.process_time()
    warnings.simplefilter("ignore")  # what broken numbers make numpy warn of
    for number, kind, run in attempts(given.area, given.count, folder, given.first):
        since = time.process_time()
        signal.alarm(10 * SECONDS)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            ended = run()
        except (Exception, Late):
            ended = "defect"
            defects += 1
            print(f"--- attempt {number}, {kind}\n{traceback.format_exc()}", file=sys.stderr)
        finally:
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)
        longest = max(longest, time.process_time() - since)
        ends.setdefault(kind, Counter())[ended] += 1
    columns = sorted(set().union(*ends.values()))
    print("| " + " | ".join([given.area, "tried", *columns]) + " |")
    print("|" + "---|" * (2 + len(columns)))
    for kind, counted in ends.items():
        print(
            f"| {kind} | {counted.total()} | " + " | ".join(f"{counted[c]}" for c in columns) + " |"
        )
    seconds = time.process_time() - begin
    print(f"\n{given.count} in {seconds:.0f} s of processor time, longest {longest:.1f} s")
    print(f"{defects} defects")
    raise SystemExit(bool(defects))


if __name__ == "__main__":
    main()
