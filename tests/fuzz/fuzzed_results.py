"""Damaged results and kept steps: a report says so in one line, a study computes anew what it lost.

Forged: somebody edited the file and took its checksum out, or an earlier release wrote it.
"""

from __future__ import annotations

import contextlib
import functools
import io
import json
import logging
import shutil
import sys
from pathlib import Path

import numpy as np
from damage import OTHER, REFUSED, SAME, TOLD, Defect, damaged, places

from policy import Algorithm, DDPGConfig
from residual import Linear
from studies import report
from studies.learning.budget import Budget
from studies.learning.kept import OnDisk
from studies.learning.loop import run_loop
from studies.learning.steps import Steps
from studies.running.progress import Silent

sys.path.append(str(Path(__file__).parents[1] / "studies"))
import quick_gap

TINY = (
    "budget: {iterations: 1, true_samples: 40, idealised_steps: 1050, difference_steps: 300}\n"
    "ddpg: {hidden: [16, 16], warm_up: 200}\nestimator: {class_path: residual.Linear}\n"
)
REPORTS = (
    "single/results.json", "grid/study.json", "grid/*/results.json", "single/rollouts/*.npz",
    "grid/*/error.txt",
)  # fmt: skip
KINDS = (
    *(f"{name}, damaged" for name in REPORTS),
    *(f"{name}, forged" for name in REPORTS[:3]),
    "kept step, damaged",
)


def attempt(kind: str, rng: np.random.Generator, folder: Path) -> str:
    """Hurt one file of a finished study and use the study; how it ended.

    Raises:
        Defect: In a way that is not promised.
    """
    what, how = kind.split(", ")
    if what == "kept step":
        return _healed(rng, folder)
    whole = finished(folder)
    found = sorted(whole.glob(what))
    path = found[rng.integers(len(found))]
    before = path.read_bytes()
    try:
        path.write_bytes(damaged(before, rng) if how == "damaged" else _forged(before, rng))
        return _reported(whole / what.partition("/")[0])
    finally:
        path.write_bytes(before)


def _reported(folder: Path) -> str:
    said, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(told):
        try:
            report.main([str(folder)])
        except SystemExit as ended:
            text = said.getvalue()
            if ended.code == 2 and text.count("\n") == 1 and str(folder) in text:
                return REFUSED
            raise Defect(f"exit code {ended.code}: {text}") from ended.__context__
    if "failed: " in said.getvalue():
        return TOLD
    return SAME if _numbers(told.getvalue()) == _numbers(_sound(folder)) else OTHER


def _numbers(text: str) -> str:
    return " ".join(text.split())


@functools.cache
def _sound(folder: Path) -> str:
    return (folder / "said.txt").read_text()


def _forged(content: bytes, rng: np.random.Generator) -> bytes:
    """An edited value somewhere, and no checksum."""
    found = json.loads(content)
    found.pop("checksum", None), found.pop("format", None)
    everywhere = places(found)
    node, key = everywhere[rng.integers(len(everywhere))]
    odd = (None, -1, 1e300, "x", "../../etc/passwd", [], {}, [None], True, 10**30, [[1.0]], "os")
    if rng.random() < 0.3 and isinstance(node, dict):
        del node[key]
    else:
        node[key] = odd[rng.integers(len(odd))]
    return json.dumps(found).encode()


@functools.cache
def finished(folder: Path) -> Path:
    """A finished grid of two trials, a failed one, and a single trial."""
    (folder / "grid.yaml").write_text(TINY + "grid:\n- seed: [0, 1]\n")
    (folder / "single.yaml").write_text(TINY)
    with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
        for name in ("grid", "single"):
            config = str(folder / f"{name}.yaml")
            quick_gap.main(["--config", config, "--output", str(folder / name)])
    failed = folder / "grid" / "failed-1"
    failed.mkdir()
    (failed / "error.txt").write_text("Traceback\nRuntimeError: deliberate\n")
    shutil.rmtree(folder / "single" / "films", ignore_errors=True)
    for name in ("grid", "single"):
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            report.main([str(folder / name)])
        (folder / name / "said.txt").write_text(told.getvalue())
    return folder


def _healed(rng: np.random.Generator, folder: Path) -> str:
    """Damage a kept step: the same study has to come to the same numbers."""
    root = folder / "steps"
    whole = _study(root)
    files = sorted(root.glob("*-*/*"))
    path = files[rng.integers(len(files))]
    before = path.read_bytes()
    path.write_bytes(damaged(before, rng))
    unchanged = path.read_bytes() == before
    said = io.StringIO()
    handler = logging.StreamHandler(said)
    logging.getLogger("simgap").addHandler(handler)
    try:
        if _learn(root) != whole:
            raise Defect(f"other numbers after damage to {path}")
    finally:
        logging.getLogger("simgap").removeHandler(handler)
        shutil.rmtree(root / "damaged", ignore_errors=True)
    if not unchanged and path.parent.name not in said.getvalue():
        raise Defect(f"damage to {path} was not seen")
    return SAME if unchanged else TOLD


@functools.cache
def _study(root: Path) -> str:
    return _learn(root)


def _learn(root: Path) -> str:
    budget = Budget(40, 1, 300, 200, 200, 0, 200)
    algorithm = Algorithm(ddpg=DDPGConfig((8, 8), warm_up=100))
    system = quick_gap.system_of(None)
    learnt = run_loop(Steps(system, Linear(), algorithm, 0, OnDisk(root), Silent()), budget)
    records = [*learnt.policies, *learnt.accuracy]
    return json.dumps([{k: v for k, v in r.items() if "seconds" not in k} for r in records])
