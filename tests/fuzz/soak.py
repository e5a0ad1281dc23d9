"""Kill, damage and resume studies until they are done, and compare with an undisturbed run.

  python tests/fuzz/soak.py --kills 100
  python tests/fuzz/soak.py --kills 10 --only dask

Every kill is a SIGKILL at a random moment; after half of them a random file is damaged. Two
processes share one folder in every other run.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import signal
import socket
import subprocess
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

from simgap_files import read_sealed
from studies import find_gap
from studies.make_log import main as make_log

GRID = TINY + "grid:\n- seed: [0, 1, 2]\n"
#: Numbers that depend on the clock.
CLOCKED = ("seconds", "fit_seconds", "versions", "processor_seconds", "config")


def begun(run: Callable[[Path], None], folder: Path) -> int:
    """A process of its own that runs a command; it shares what is imported already."""
    child = os.fork()
    if child:
        return child
    os.setsid()
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1), os.dup2(quiet, 2)
    code = 1
    try:
        run(folder)
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


def grid(folder: Path) -> None:
    """Three trials."""
    config = folder.with_suffix(".yaml")
    config.write_text(GRID)
    quick_gap.main(["--config", str(config), "--output", str(folder)])


def gap(folder: Path) -> None:
    """A search for two effects; nothing of it is kept, so it is there whole or not at all."""
    log = sorted((folder.parent / "logs").glob("*.csv"))[0]
    arguments = ["--simulator", "sims.pendulum_equation.PendulumEquation", "--logs", str(log)]
    arguments += ["--effects", "mass", "viscous_friction", "--output", str(folder)]
    find_gap.main(arguments)


STUDIES = {"learn": learn, "grid": grid, "find_gap": gap}


def left(folder: Path) -> dict[str, object]:
    """What a finished run left: results without what the clock makes of them, and all policies."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*.json")):
        if path.name in ("results.json", "gap.json"):
            found[str(path.relative_to(folder))] = _timeless(read_sealed(path))
    for path in sorted(folder.rglob("policies/*.safetensors")):
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
    begin = time.perf_counter()
    assert _wait(begun(run, home / f"{name}-whole")) == 0
    seconds, whole = time.perf_counter() - begin, left(home / f"{name}-whole")
    assert whole
    while counted["kills"] < kills and time.monotonic() < until:
        folder = home / f"{name}-{counted['runs']}"
        two = name != "find_gap" and counted["runs"] % 2
        for again in range(1000):
            children = [begun(run, folder) for _ in range(2 if two else 1)]
            # Later and later, so that every run comes to its end.
            time.sleep(float(rng.uniform(0, seconds * (1 + again / 4))))
            codes = [ended(child) for child in children]
            alive = [c for c, code in zip(children, codes, strict=True) if code is None]
            if not alive:
                assert set(codes) == {0}, codes
                break
            victim = alive[rng.integers(len(alive))]
            kill(victim)
            counted["kills"] += 1
            for child in set(alive) - {victim}:
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


def _wait(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _same(found: dict[str, object], whole: dict[str, object], folder: Path) -> None:
    assert found.keys() == whole.keys(), f"{folder}: {sorted(found.keys() ^ whole.keys())}"
    for name in whole:
        assert found[name] == whole[name], f"{folder / name} differs"


def soak_dask(kills: int, home: Path, rng: np.random.Generator, until: float) -> Counter[str]:
    """Kill workers of a Dask cluster, and now and then the command, until the grid is done."""
    counted: Counter[str] = Counter()
    assert _wait(begun(grid, home / "dask-whole")) == 0
    whole = left(home / "dask-whole")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    places = os.pathsep.join([*sys.path[:2], str(Path(quick_gap.__file__).parent), os.getcwd()])
    options = {
        "env": {**os.environ, "PYTHONPATH": places}, "start_new_session": True,
        "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL,
    }  # fmt: skip
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1",
              "--host", "127.0.0.1", "--no-dashboard", "--no-nanny"]  # fmt: skip
    port = address.rpartition(":")[2]
    running = [subprocess.Popen([*dask, "--port", port, "--no-dashboard"], **options)]
    workers = [subprocess.Popen(worker, **options) for _ in range(2)]
    try:
        while counted["kills"] < kills and time.monotonic() < until:
            folder = home / f"dask-{counted['runs']}"
            config = folder.with_suffix(".yaml")
            config.write_text(GRID)
            command = [sys.executable, quick_gap.__file__, "--config", str(config), "--output"]
            command += [str(folder), "--backend", "dask", "--scheduler", address]
            for _ in range(50):
                study = subprocess.Popen(command, **options)
                while study.poll() is None and counted["kills"] < kills:
                    time.sleep(float(rng.uniform(2, 12)))
                    if study.poll() is not None:
                        break
                    if rng.random() < 0.3:
                        os.killpg(study.pid, signal.SIGKILL)
                    else:
                        k = int(rng.integers(len(workers)))
                        os.killpg(workers[k].pid, signal.SIGKILL)
                        workers[k].wait()
                        workers[k] = subprocess.Popen(worker, **options)
                    counted["kills"] += 1
                    print(f"\rdask: {counted['kills']} kills", end="", file=sys.stderr, flush=True)
                if study.wait() == 0:
                    break
            _same(left(folder), whole, folder)
            counted["runs"] += 1
    finally:
        for process in (*running, *workers):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
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
    make_log(["--output", str(home / "logs")])
    print("| study | runs | kills | other process went on | files damaged |\n|---|---|---|---|---|")
    for name in (given.only,) if given.only else (*STUDIES, "dask"):
        if name == "dask":
            counted = soak_dask(given.kills, home, rng, until)
        else:
            counted = soak(name, given.kills, home, rng, until)
        numbers = [counted[n] for n in ("runs", "kills", "survivors", "damaged")]
        print(f"| {name} | {' | '.join(map(str, numbers))} |", flush=True)
    shutil.rmtree(home, ignore_errors=True)


if __name__ == "__main__":
    main()
