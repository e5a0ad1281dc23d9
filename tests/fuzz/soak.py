"""Kill, damage and resume studies until they are done, and compare with an undisturbed run.

  python tests/fuzz/soak.py --kills 100
  python tests/fuzz/soak.py --kills 10 --only dask

Every kill is a SIGKILL at a random moment; after half of them a random file is damaged. Two
processes share one folder in every other run. The code must not change meanwhile: what is kept
of other code is computed anew, and says so.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import signal
import socket
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import quick_gap
from damage import damaged
from fuzzed_results import TINY
from one_log import one_log

from simgap_files.atomic import read_sealed
from studies import find_gap

GRID = TINY + "grid:\n- seed: [0, 1, 2]\n"
#: Numbers that depend on the clock.
CLOCKED = ("seconds", "fit_seconds", "versions", "processor_seconds", "config")


def begun(run: Callable[..., None], *given: object) -> int:
    """A process of its own that runs a command; it shares what is imported already."""
    child = os.fork()
    if child:
        return child
    os.setsid()
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1), os.dup2(quiet, 2)
    code = 1
    try:
        run(*given)
        code = 0
    except SystemExit as ended:
        code = int(ended.code or 0)
    finally:
        os._exit(code)


def ended(child: int) -> int | None:
    """Exit code of a process, minus the signal that killed it; None while it runs."""
    done, status = os.waitpid(child, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if done else None


def kill(child: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def learn(folder: Path) -> None:
    """One trial, every step of it kept."""
    config = folder.with_suffix(".yaml")
    config.write_text(TINY)
    quick_gap.main(["--config", str(config), "--output", str(folder)])


def grid(folder: Path, *more: str) -> None:
    """Three trials."""
    config = folder.with_suffix(".yaml")
    config.write_text(GRID)
    quick_gap.main(["--config", str(config), "--output", str(folder), *more])


def gap(folder: Path) -> None:
    """A search for two effects; nothing of it is kept, so it is there whole or not at all."""
    arguments = ["--simulator", "sims.pendulum_equation.PendulumEquation", "--logs"]
    arguments += [str(one_log(folder.parent))]
    arguments += ["--effects", "mass", "viscous_friction", "--output", str(folder)]
    find_gap.main(arguments)


STUDIES = {"learn": learn, "grid": grid, "find_gap": gap}


def left(folder: Path) -> dict[str, object]:
    """What a finished run left: results without what the clock makes of them, and all policies."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*.json")):
        if path.name in ("results.json", "gap.json"):
            found[str(path.relative_to(folder))] = _timeless(read_sealed(path))
    for path in sorted(folder.rglob("policies/[!.]*.safetensors")):
        found[str(path.relative_to(folder))] = path.read_bytes()
    return found


def _timeless(node: object) -> object:
    if isinstance(node, dict):
        return {k: _timeless(v) for k, v in node.items() if k not in CLOCKED}
    return [_timeless(item) for item in node] if isinstance(node, list) else node


def hurt(folder: Path, rng: np.random.Generator) -> bool:
    """Damage one file that was kept, if there is one."""
    names = ("stages/*-*/*", "results.json", "*-*/results.json", "*/models/*")
    files = [p for name in names for p in folder.glob(name) if p.is_file()]
    if not files:
        return False
    path = files[rng.integers(len(files))]
    path.write_bytes(damaged(path.read_bytes(), rng))
    return True


def soak(name: str, kills: int, home: Path, rng: np.random.Generator, until: float) -> Counter[str]:
    """Kill a study so many times, over as many runs as that takes.

    Raises:
        AssertionError: A run that was killed and resumed is not the same as one that was not.
    """
    run, counted = STUDIES[name], Counter[str]()
    seconds, whole, steps = undisturbed(run, home, name)
    while counted["kills"] < kills and time.monotonic() < until:
        folder = home / f"{name}-{counted['runs']}"
        for again in range(1000):
            children = [begun(run, folder) for _ in range(1 + counted["runs"] % 2)]
            since = time.perf_counter()
            # Later and later, so that every run comes to its end.
            time.sleep(float(rng.uniform(0, seconds * (1 + again / 4))))
            codes = [ended(child) for child in children]
            alive = [c for c, code in zip(children, codes, strict=True) if code is None]
            assert {code for code in codes if code is not None} <= {0}, codes
            if not alive:
                break
            for victim in rng.permutation(alive)[: rng.integers(1, len(alive) + 1)]:
                counted[moment(time.perf_counter() - since, seconds, folder, steps)] += 1
                kill(int(victim))
                alive.remove(int(victim))
                counted["kills"] += 1
            for child in alive:
                assert _wait(child) == 0, "the other process of the same folder failed"
                counted["survivors"] += 1
            if rng.random() < 0.5 and hurt(folder, rng):
                counted["damaged"] += 1
            print(f"\r{name}: {counted['kills']} kills", end="", file=sys.stderr, flush=True)
        _same(left(folder), whole, folder)
        counted["runs"] += 1
        shutil.rmtree(folder, ignore_errors=True)
    print(file=sys.stderr)
    return counted


def undisturbed(
    run: Callable[..., None], home: Path, name: str, *more: str
) -> tuple[float, dict[str, object], int]:
    """Seconds of a run that nobody kills, what it leaves, and how many steps it keeps."""
    for _ in range(2):  # the second knows what libraries find out once, as the killed ones do
        folder = home / f"{name}-whole"
        shutil.rmtree(folder, ignore_errors=True)
        begin = time.perf_counter()
        assert _wait(begun(run, folder, *more)) == 0
        seconds = time.perf_counter() - begin
    assert left(folder)
    return seconds, left(folder), len(kept(folder))


def kept(folder: Path) -> list[Path]:
    """Records of the steps that are finished."""
    return list(folder.glob("stages/*-*/step.json"))


def moment(elapsed: float, seconds: float, folder: Path, steps: int) -> str:
    """When a process is killed, in words: by the steps that are kept, or by the clock."""
    if not steps:
        return "early" if elapsed < seconds / 3 else "late" if elapsed > seconds / 1.5 else "midway"
    done = len(kept(folder))
    return "early" if not done else "late" if done >= steps else "midway"


def _wait(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _same(found: dict[str, object], whole: dict[str, object], folder: Path) -> None:
    assert found.keys() == whole.keys(), f"{folder}: {sorted(found.keys() ^ whole.keys())}"
    for name in whole:
        assert found[name] == whole[name], f"{folder / name} differs"


def soak_dask(kills: int, home: Path, rng: np.random.Generator, until: float) -> Counter[str]:
    """Kill workers of a Dask cluster, and now and then the command, until the grid is done."""
    from distributed.cli import dask_scheduler, dask_worker

    counted: Counter[str] = Counter()
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address, here = f"tcp://127.0.0.1:{port}", ["--host", "127.0.0.1", "--no-dashboard"]
    joined = [address, *here, "--nthreads", "1", "--no-nanny"]

    def worker() -> int:
        return begun(dask_worker.main, joined)

    on = ("--backend", "dask", "--scheduler", address)
    scheduler = begun(dask_scheduler.main, [*here, "--port", str(port)])
    workers = [worker() for _ in range(2)]
    study = 0
    try:
        seconds, whole, steps = undisturbed(grid, home, "dask", *on)
        _same(whole, undisturbed(grid, home, "no-dask")[1], home)
        while counted["kills"] < kills and time.monotonic() < until:
            folder = home / f"dask-{counted['runs']}"
            code: int | None = 1
            while code != 0:
                study, code, since = begun(grid, folder, *on), None, time.perf_counter()
                while code is None:
                    wait = float(rng.uniform(0, seconds if counted["kills"] < kills else 0.5))
                    time.sleep(wait)
                    code = ended(study)
                    if code is not None or counted["kills"] >= kills:
                        continue
                    counted[moment(time.perf_counter() - since, seconds, folder, steps)] += 1
                    if rng.random() < 0.3:
                        kill(study)
                        code = -9
                    else:
                        k = int(rng.integers(len(workers)))
                        kill(workers[k])
                        workers[k] = worker()
                    counted["kills"] += 1
                    print(f"\rdask: {counted['kills']} kills", end="", file=sys.stderr, flush=True)
                study = 0
            _same(left(folder), whole, folder)
            counted["runs"] += 1
    finally:
        for process in (scheduler, *workers, study):
            if process:
                kill(process)
    print(file=sys.stderr)
    return counted


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=10, help="of every study")
    parser.add_argument("--only", choices=(*STUDIES, "dask"))
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no run after that")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rng, until = np.random.default_rng(given.seed), time.monotonic() + 60 * given.minutes
    home = Path(tempfile.mkdtemp(prefix="simgap-soak-"))
    one_log(home)  # made by one process for all
    columns = ("runs", "kills", "early", "midway", "late", "survivors", "damaged")
    print(f"| study | {' | '.join(columns)} |\n|{'---|' * (1 + len(columns))}")
    for name in (given.only,) if given.only else (*STUDIES, "dask"):
        if name == "dask":
            counted = soak_dask(given.kills, home, rng, until)
        else:
            counted = soak(name, given.kills, home, rng, until)
        print(f"| {name} | {' | '.join(str(counted[c]) for c in columns)} |", flush=True)
    shutil.rmtree(home, ignore_errors=True)


if __name__ == "__main__":
    main()
