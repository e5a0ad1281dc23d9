"""Whatever a true environment's functions raise or return, one line says whose it is."""

import gymnasium
import numpy as np
import pytest

from sims import Pendulum, SwingUp, System
from sims.unsound import Unsound
from studies.running.ending import users_code


class Rig(gymnasium.Env):
    """Stays where it is; a test replaces what it does."""

    action_space = gymnasium.spaces.Box(-3.0, 3.0, (1,), np.float64)

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        return np.array([np.pi, 0.0]), {}

    def step(self, action):
        return np.array([np.pi, 0.0]), 0.0, False, False, {}


def checked(state_of=lambda env, observation: observation, true=Rig):
    System("mine", Pendulum(), true, SwingUp(), state_of=state_of).check()


def raised(error):
    def function(*_, **__):
        raise error

    return function


def test_a_rig_without_faults_passes():
    checked()
    checked(lambda env, observation: [3, np.float32(0.0)])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((0.0, [1.0]), r"state_of returned \(0.0, \[1.0\]\), expected one real number for each"),
        ("abcd", "state_of returned 'abcd', expected one real number for each of angle, rate"),
        (("1", "2"), r"state_of returned \('1', '2'\)"),
        ((1j, 0.0), r"state_of returned \(1j, 0.0\)"),
        ({"angle": 0.0}, r"state_of returned \{'angle': 0.0\}"),
        ((0.0, "b"), "state_of returned"),
        (None, r"state has shape \(\)"),
        ((0.0, None), "gave rate = nan rad/s at reset"),
    ],
)
def test_a_state_of_no_numbers_is_refused(given, says):
    with pytest.raises(Unsound, match=f"the true environment.*{says}"):
        checked(lambda env, observation: given)


def test_so_is_one_that_the_environment_reports():
    rig = type("Told", (Rig,), {"reset": lambda self, seed, options: (0, {"state": "abcd"})})
    with pytest.raises(Unsound, match=r"Told: info\['state'\] is 'abcd'"):
        checked(None, rig)
    rig = type("Silent", (Rig,), {"reset": lambda self, seed, options: (0, None)})
    with pytest.raises(Unsound, match="does not report its state"):
        checked(None, rig)


@pytest.mark.parametrize("name", ["reset", "step"])
@pytest.mark.parametrize("error", [KeyError("encoder"), RuntimeError("no link"), OSError("gone")])
def test_what_an_environment_raises_is_told_as_its_own(name, error):
    rig = type("Bad", (Rig,), {name: raised(error)})
    whose = rf"the true environment Bad in {name} raised {type(error).__name__}: "
    with pytest.raises(Unsound, match=whose) as told:
        checked(true=rig)
    assert told.value.__cause__ is error
    assert users_code(told.value).startswith(f"{__file__}, line ")
    assert "Swing" not in str(told.value)


def test_what_other_functions_raise_is_told_as_theirs():
    with pytest.raises(Unsound, match="function state_of for the true environment Rig raised Inde"):
        checked(lambda env, observation: observation[17])
    with pytest.raises(Unsound, match=r"mine: the function true raised KeyError: 'port'"):
        checked(true=raised(KeyError("port")))


def test_a_step_that_returns_nothing_is_refused():
    rig = type("Quiet", (Rig,), {"step": lambda self, action: None})
    with pytest.raises(Unsound, match="Quiet: step returned NoneType, expected Gymnasium's five"):
        checked(true=rig)


def test_a_true_simulator_that_cannot_be_stepped_is_not_the_task():
    class Wrong(Pendulum):
        def step(self, states, actions):
            raise IndexError("gear")

    with pytest.raises(ValueError, match="the true system cannot be stepped: IndexError: gear"):
        checked(None, Wrong())
