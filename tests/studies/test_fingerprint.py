"""What a system is and does: nothing that changes it goes unseen, and nothing else changes it."""

import functools
import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from sklearn.linear_model import Ridge

from sims.effects import CoulombFriction
from sims.pendulum import Pendulum
from sims.system import System
from sims.tasks import SwingUp
from studies import learn
from studies.learning.described import modules_in, settings_of
from studies.learning.fingerprint import fingerprint, unchanged
from studies.learning.trial import build_parser, code_of_trial, resolve

ROOT = Path(__file__).parents[2]
# As in a notebook: its code is in no file.
NOTEBOOK = """
import functools, gymnasium, numpy as np
from sims import Channel, EquationOfMotion, Parameter, System, Task

class Valley(EquationOfMotion):
    dt = 0.1
    state_channels = (Channel("position", "m", "position"),
                      Channel("velocity", "m/s", "rate", rate_of="position"))
    action_channels = (Channel("engine", "1", "input", low=-1.0, high=1.0),)
    parameters = {"power": Parameter(0.002, "1", "engine")}
    def acceleration(self, q, v, u, force, p):
        return 100 * (p.power * u[:, 0] + force[:, 0] - 0.0025 * np.cos(3 * q[:, 0]))[:, None]

W = 1.0
FAR, NAMES = {"a", "b", "c"}, frozenset({"x", "y", "z"})
def cost(n):
    return 2.0 * n[:, 0] ** 2 if "x" in {"x", "y", "z"} and FAR else 0.0
class Base(Task):
    horizon = 60
    def start(self, rng):
        return np.array([rng.uniform(-0.6, -0.4), 0.0])
    def reward(self, s, a, n):
        f = lambda x: 3.0 * x
        return -f(W * cost(n)) - 4.0 * self.w
class Stay(Base):
    w = 5.0
class Scaled(gymnasium.ActionWrapper):
    def __init__(self, env, gain):
        super().__init__(env)
        self.gain = gain
    def action(self, a):
        return (self.gain * a - 6.0).astype(np.float32)
GAIN = 7.0
def make(gain):
    return Scaled(gymnasium.make("MountainCarContinuous-v0", goal_velocity=0.5), gain)
def state_of(env, o):
    return o[0], 10.0 * o[1]
INSTANCE = System("valley", Valley(), make(8.0), Stay(), state_of=state_of)
FACTORY = System("valley", Valley(), lambda: make(GAIN), Stay(), state_of=state_of)
"""
CHANGES = [
    ("Parameter(0.002", "Parameter(0.003", "both"),
    ("W = 1.0", "W = 1.5", "both"),
    ("return 2.0", "return 2.5", "both"),
    ("horizon = 60", "horizon = 50", "both"),
    ("3.0 * x", "3.5 * x", "both"),
    ("4.0 * self.w", "4.5 * self.w", "both"),
    ("w = 5.0", "w = 5.5", "both"),
    ("a - 6.0", "a - 6.5", "both"),
    ("GAIN = 7.0", "GAIN = 7.5", "factory"),
    ("make(8.0)", "make(8.5)", "instance"),
    ("goal_velocity=0.5", "goal_velocity=0.6", "both"),
    ("10.0 * o[1]", "10.5 * o[1]", "both"),
]


def told(system):
    return json.dumps(fingerprint(system), sort_keys=True)


def cells(text):
    space = {"__name__": "__main__"}
    exec(compile(text, "<cell>", "exec"), space)
    return {"instance": told(space["INSTANCE"]), "factory": told(space["FACTORY"])}


@pytest.fixture(scope="module")
def notebook():
    return cells(NOTEBOOK)


@pytest.mark.parametrize(("old", "new", "seen"), CHANGES)
def test_every_change_of_a_notebook_is_another_system(notebook, old, new, seen):
    assert NOTEBOOK.count(old) == 1
    after = cells(NOTEBOOK.replace(old, new))
    changed = {kind for kind in notebook if after[kind] != notebook[kind]}
    assert changed == ({"instance", "factory"} if seen == "both" else {seen})


def test_a_system_is_the_same_in_another_process(notebook, tmp_path):
    text = f"{NOTEBOOK}\nimport json\nfrom studies.learning.fingerprint import fingerprint\n"
    text += "print([json.dumps(fingerprint(s), sort_keys=True) for s in (INSTANCE, FACTORY)])"
    said = set()
    for number in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": number, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-"], input=text, cwd=tmp_path, env=environment,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        said.add(done.stdout)
    assert len(said) == 1 and " at 0x" not in said.pop()


class Counting(gymnasium.Env):
    """It remembers what it did, in every way that one can."""

    action_space = gymnasium.spaces.Box(-3.0, 3.0, (1,), np.float64)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)

    def __init__(self, mass=0.09):
        self.mass, self.episodes, self.seen, self.last = mass, 0, [], {"reward": 0.0}
        self.inner = Pendulum(mass)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.state, self.episodes = np.array([np.pi, 0.0]), self.episodes + 1
        return self.state, {"state": self.state}

    def step(self, action):
        self.state = self.inner.step(self.state[None], action[None])[0]
        self.seen.append(self.state)
        self.last["reward"] += 1.0
        return self.state, 0.0, False, False, {"state": self.state}


def test_what_an_environment_did_is_no_part_of_it():
    env = Counting()
    system = System("counting", Pendulum(), env, SwingUp())
    before = told(system)
    env.reset(seed=3)
    for _ in range(7):
        env.step(np.ones(1))
    assert told(system) == before
    env.mass = 0.1
    assert told(system) != before
    made = System("counting", Pendulum(), Counting, SwingUp())
    assert told(made) == told(made)
    assert told(made) != told(System("counting", Pendulum(), lambda: Counting(0.1), SwingUp()))


CALLS = {"count": 0}
KNOWN = {}


class Remembering(SwingUp):
    """It counts its calls and remembers what it said."""

    def reward(self, states, actions, next_states):
        CALLS["count"] += 1
        for row in next_states:
            KNOWN[tuple(row)] = super().reward(row[None], row[None], row[None])[0]
        return np.array([KNOWN[tuple(row)] for row in next_states])


def test_what_a_simulator_did_is_no_part_of_it():
    used, fresh = (Pendulum(effects=[CoulombFriction("pivot", 1e-3)]) for _ in range(2))
    used.step([[0.0, 0.0]], [[0.0]])
    assert settings_of(used) == settings_of(fresh)


def test_what_a_task_remembers_is_no_part_of_it():
    system = System("remembering", Pendulum(), Pendulum.true(), Remembering())
    before = told(system)
    system.check()
    assert told(system) == before == told(system)


def test_a_librarys_environment_counts_by_its_attributes_and_files(tmp_path):
    env = gymnasium.make("Pendulum-v1", g=10.0)
    before = settings_of(env)
    env.unwrapped.g = 9.0
    assert settings_of(env) != before
    file = tmp_path / "model.xml"
    file.write_text("one")
    one = settings_of({"kwargs": {"xml_file": str(file)}})
    file.write_text("two!")
    assert settings_of({"kwargs": {"xml_file": str(file)}}) != one


SYSTEM_FILE = """
import json
from pathlib import Path
import numpy as np
from sims import Parameter, System, SwingUp
from sims.pendulum_equation import PendulumEquation

import kit.numbers_of_mine
TABLE = np.loadtxt(Path(__file__).parent / f"cost{1}.txt")

class Mine(PendulumEquation):
    def acceleration(self, q, v, u, force, p):
        return super().acceleration(q, v, u, force, p) * kit.numbers_of_mine.P["factor"]

class Up(SwingUp):
    def reward(self, s, a, n):
        return -np.interp(n[:, 0] ** 2, [0.0, 10.0], TABLE)

def true():
    return PendulumEquation(float((Path(__file__).parent / "mass.txt").read_text()))

SYSTEM = System("mine", Mine(), true, Up())
"""


HELPER = """
import json
from pathlib import Path
P = json.loads((Path(__file__).parent / "params.json").read_text())
"""


@pytest.mark.parametrize(
    ("file", "text"),
    [("params.json", '{"factor": 1.5}'), ("cost1.txt", "0 2"), ("mass.txt", "0.1"), ("", "")],
)
def test_data_that_the_system_file_reads_make_another_trial(tmp_path, monkeypatch, file, text):
    for name, content in {
        "system_of_mine.py": SYSTEM_FILE, "params.json": '{"factor": 1.0}', "cost1.txt": "0 1",
        "mass.txt": "0.09",
    }.items():  # fmt: skip
        (tmp_path / name).write_text(content)
    (tmp_path / "kit").mkdir()
    (tmp_path / "kit" / "__init__.py").touch()
    (tmp_path / "kit" / "numbers_of_mine.py").write_text(HELPER.replace("parent", "parents[1]"))
    monkeypatch.syspath_prepend(tmp_path)
    given = build_parser(learn.STUDY).parse_args(["--system", "system_of_mine.SYSTEM"])
    config = json.loads(build_parser(learn.STUDY).dump(given, format="json", skip_unset=False))
    config = resolve(learn.STUDY, {name: config[name] for name in learn.STUDY.settings})
    codes = []
    for name in ("", file):
        if name:
            (tmp_path / name).write_text(text)
        for module in ("system_of_mine", "kit", "kit.numbers_of_mine"):
            sys.modules.pop(module, None)
        codes.append(code_of_trial(learn.STUDY, config))
    assert (codes[0] == codes[1]) is not bool(file)


class Slotted:
    __slots__ = ("x",)

    def __init__(self, x):
        self.x = x


@functools.lru_cache
def remembered(x):
    return 2.0 * x


def test_values_of_every_kind_count_and_no_address_does():
    for one, other in [
        (Slotted(1), Slotted(2)),
        (np.array([Slotted(1)], object), np.array([Slotted(2)], object)),
        (np.cos, np.sin),
        (torch.nn.Parameter(torch.ones(2)), torch.nn.Parameter(torch.zeros(2))),
        (Ridge().fit([[0.0], [1.0]], [0.0, 1.0]), Ridge().fit([[0.0], [1.0]], [0.0, 2.0])),
        (Fraction(1, 3), Fraction(1, 4)),
        (b"a", b"b"),
        ({(1, 2): 3}, {(1, 3): 3}),
        (list(range(1000)), [*range(999), 7]),
        (functools.partial(max, 1), functools.partial(min, 1)),
    ]:
        assert settings_of(one) != settings_of(other)
        assert " at 0x" not in json.dumps(settings_of([one, other]))
    assert "sklearn.linear_model._ridge" in modules_in(settings_of(lambda: Ridge()))
    here = modules_in(settings_of(remembered))
    assert __name__ in here
    around = []
    around.append(around)
    assert settings_of(around)["value"] == ["..."]


def test_only_what_two_descriptions_share_counts():
    one = {"a": 1, "b": [1, 2], "e": [1], "c": {"class": "C", "d": float("nan")}, "f": {"x": 1}}
    other = {"a": 2, "b": [1, 3], "e": [1, 2], "c": {**one["c"], "e": 0}, "f": {"x": 1, "y": 2}}
    left = unchanged(one, other)
    assert left["a"] == left["e"] == left["f"] == "changes" and left["b"] == [1, "changes"]
    assert np.isnan(left["c"]["d"]) and len(left["c"]) == 2
