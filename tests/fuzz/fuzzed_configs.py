"""Damaged settings of every command: one line and exit code 2, or a run with what they say.

Nothing is computed: a run counts as begun when the work itself would.
"""

from __future__ import annotations

import contextlib
import copy
import importlib
import io
import re
import shutil
from pathlib import Path
from unittest import mock

import numpy as np
import yaml
from damage import OTHER, REFUSED, Defect, damaged, places
from one_log import one_log

ROOT = Path(__file__).parents[2]
PLAIN = "sims.pendulum_equation.PendulumEquation"
SIMULATOR = {
    "class_path": "sims.loading.with_effects",
    "init_args": {
        "simulator": {
            "class_path": PLAIN,
            "init_args": {"mass": 0.055},
        },
        "effects": [
            {"class_path": "sims.effects.ParameterChange", "init_args": {"parameter": "mass"}}
        ],
        "hold": {"voltage": "zero"},
    },
}
GAP = {"simulator": SIMULATOR, "minutes": 0.1, "tolerance": 0.01, "hold": "auto",
       "effects": ["library"]}  # fmt: skip
COLUMNS = {
    "time": {"column": "time", "unit": "s"},
    "states": {"angle": {"column": "angle", "scale": 1.0}, "rate": "rate"},
    "actions": {"voltage": {"column": "voltage", "unit": "V"}}, "gap": 5.0,
}  # fmt: skip
LEARN = {
    "estimator": {"class_path": "residual.GaussianProcess", "init_args": {"max_iter": 3}},
    "budget": {"iterations": 1, "true_samples": 40},
    "ddpg": {"hidden": [16, 16], "warm_up": 200}, "seed": 0, "simulator": SIMULATOR,
}  # fmt: skip
CONFIGS = "studies/configs"
COMMANDS = {
    "learn": ("studies.learn", {**LEARN, "system": "studies.systems.pendulum.SYSTEM"}),
    "pendulum_gap": ("studies.pendulum_gap", LEARN),
    "pendulum_gap grid": ("studies.pendulum_gap", f"{CONFIGS}/table2.yaml"),
    "leo_gap grid": ("studies.leo_gap", f"{CONFIGS}/leo_table.yaml"),
    "find_gap": ("studies.find_gap", GAP),
    "find_gap columns": ("studies.find_gap", {**GAP, "simulator": PLAIN, "columns": COLUMNS}),
    "find_gap corrected.yaml": ("studies.find_gap", SIMULATOR),
    "hidden_effects": ("studies.hidden_effects", f"{CONFIGS}/hidden_effects/singles.yaml"),
    "hidden_effects dirty": ("studies.hidden_effects", f"{CONFIGS}/hidden_effects/dirty_fast.yaml"),
}  # fmt: skip
KINDS = tuple(COMMANDS)
WORK = (
    "studies.learning.command.run_trials", "studies.learning.command.run_trial",
    "studies.hidden_effects.run_trials", "studies.find_gap.find_gap",
)  # fmt: skip


class Begun(BaseException):
    """The settings were taken and the work would begin."""


def attempt(kind: str, rng: np.random.Generator, folder: Path) -> str:
    """Damage the settings of a command and give the command; how it ended.

    Raises:
        Defect: In a way that is not promised.
    """
    module, source = COMMANDS[kind]
    settings = yaml.safe_load((ROOT / source).read_text()) if isinstance(source, str) else source
    misnamed = False
    if rng.random() < 0.3:
        text = damaged(yaml.safe_dump(settings).encode(), rng)
    else:
        settings = copy.deepcopy(settings)
        misnamed = _edited(settings, rng)
        text = yaml.safe_dump(settings).encode()
    if rng.random() < 0.08:
        text = _BOMBS[rng.integers(len(_BOMBS))].encode()
    config, trap = folder / "config.yaml", Path("/tmp/simgap-fuzz-trap")
    config.write_bytes(text)
    arguments = ["--config", str(config), "--output", str(folder / "out")]
    if module == "studies.find_gap":
        if kind.endswith("corrected.yaml"):
            arguments[:2] = ["--simulator", str(config)]
        arguments += ["--logs", str(one_log(folder))]
    ended, said = _given(module, arguments)
    if trap.exists():
        trap.unlink()
        raise Defect("a file ran code")
    shutil.rmtree(folder / "out", ignore_errors=True)
    if ended is None:
        if misnamed:
            raise Defect(f"a setting that does not exist was taken: {text.decode()}")
        return OTHER
    if ended != 2 or said.count("\n") != 1 or not said.startswith("error: "):
        raise Defect(f"exit code {ended}, said {said}")
    if re.search(r"Traceback|object at 0x", said):
        raise Defect(f"not for people: {said}")
    return REFUSED


def _given(module: str, arguments: list[str]) -> tuple[int | None, str]:
    """Exit code and what stderr says; None if the work would have begun."""
    command, said = importlib.import_module(module), io.StringIO()
    with contextlib.ExitStack() as stack:
        for name in WORK:
            importlib.import_module(name.rpartition(".")[0])
            stack.enter_context(mock.patch(name, side_effect=Begun))
        # Looks for the size of every gap, which is work too.
        stack.enter_context(mock.patch("studies.hidden.grid.strength", return_value=1.0))
        stack.enter_context(contextlib.redirect_stderr(said))
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        try:
            command.main(arguments)
        except Begun:
            return None, ""
        except SystemExit as ended:
            if ended.code == 2:
                return 2, said.getvalue()
            raise Defect(f"exit code {ended.code}: {said.getvalue()}") from ended.__context__
    raise Defect("ended without work and without an error")


_TRAP = "touch /tmp/simgap-fuzz-trap"
_ODD = (
    None, -1, 0, 3.5, 1e300, float("nan"), float("inf"), "", "x", [], {}, [None], True, 10**30,
    "os.system", {"class_path": "os.system", "init_args": {"command": _TRAP}},
    {"class_path": "subprocess.Popen", "init_args": {"args": _TRAP, "shell": True}},
    {"class_path": "builtins.exec", "init_args": {"source": "import os"}}, "/", "\u0000", "..",
    {"class_path": "sims.Pendulum"}, {"class_path": "no_such_module.X"}, [[1, 2], [3]], "1e5",
    "2024-01-01", {"a": {"b": {"c": 1}}}, "x" * 5000,
)  # fmt: skip
_BOMBS = (
    f"!!python/object/apply:os.system ['{_TRAP}']\n",
    f"simulator: !!python/object/new:os.system ['{_TRAP}']\n",
    "a: &a [x, x]\nb: &b [*a, *a, *a, *a]\nc: &c [*b, *b, *b, *b]\nd: [*c, *c]\n",
    "simulator: &a\n  class_path: sims.Pendulum\n  init_args: *a\n",
    "grid: &a [*a]\n", "[" * 3000, "- a\n- b\n", "just words\n", "\ufeff{}\n", "a: b: c\n",
    "---\n---\n", "? [a, b]\n: c\n", "seed: 0\nseed: 1\n", "1: 2\n", "simulator: |\n  x\n",
    "null\n", "%YAML 9.9\n",
)  # fmt: skip


def _edited(settings: dict, rng: np.random.Generator) -> bool:
    """Another value or key somewhere; whether the key is one that does not exist."""
    everywhere = places(settings)
    node, key = everywhere[rng.integers(len(everywhere))]
    match rng.integers(6):
        case 0 if isinstance(node, dict):
            node[f"{key}_x"] = node.pop(key)
            return True
        case 1:
            del node[key]
        case 2 if isinstance(node[key], str) and len(node[key]) > 2:
            at = int(rng.integers(1, len(node[key])))
            node[key] = node[key][: at - 1] + node[key][at:]
        case _:
            node[key] = copy.deepcopy(_ODD[rng.integers(len(_ODD))])
    return False
