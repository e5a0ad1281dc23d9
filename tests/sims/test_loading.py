"""Simulators and effects by name, and back without losing a bit."""

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from sims.chosen import chosen_effects
from sims.effects import (
    ActuatorLag,
    Backlash,
    Cogging,
    CoulombFriction,
    Delay,
    ParameterChange,
    Saturation,
    SensorOffset,
    StribeckFriction,
    library,
    typical,
)
from sims.loading import corrected_settings, load_simulator, not_found, simulator_settings
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation

PENDULUM = "sims.pendulum.Pendulum"


def written(settings, tmp_path):
    path = tmp_path / "corrected.yaml"
    path.write_text(yaml.safe_dump(settings))
    return path


def states_of(simulator, rows=6):
    rng = np.random.default_rng(0)
    voltages = rng.uniform(-3, 3, (rows, 1))
    return simulator.augment(rng.normal(size=(rows, 2)) * [2, 5], voltages), voltages


@pytest.mark.parametrize("effect", library(Pendulum()), ids=str)
def test_every_effect_comes_back_bit_for_bit(effect, tmp_path):
    effect = typical(effect, Pendulum(), share=1 / 3)
    path = written(corrected_settings(simulator_settings(PENDULUM), [effect]), tmp_path)
    loaded, wanted = load_simulator(path), Pendulum().with_effects([effect])
    assert loaded.effects == wanted.effects
    states, voltages = states_of(wanted)
    np.testing.assert_array_equal(loaded.step(states, voltages), wanted.step(states, voltages))


@settings(max_examples=25)
@given(value=st.floats(-0.05, 1.0, allow_subnormal=False))
def test_no_digit_is_lost(value):
    wanted = [ParameterChange("mass", value), Delay("voltage", abs(value)), Saturation("voltage")]
    text = yaml.safe_dump(corrected_settings(simulator_settings(PENDULUM), wanted))
    assert load_simulator(yaml.safe_load(text)).effects == tuple(wanted)


def test_effects_come_beside_those_that_are_there():
    first = corrected_settings(simulator_settings(PENDULUM), [Delay("voltage", 0.03)])
    both = corrected_settings(first, [ParameterChange("mass", 0.01)])
    assert [str(e) for e in load_simulator(both).effects] == ["delay@voltage", "mass"]


def test_a_class_without_effects_among_its_arguments_gets_them_too():
    plain = {
        "class_path": "studies.real.systems.GearedPendulum",
        "init_args": {"inertia": 0.2, "moment": 0.4},
    }
    effects = [CoulombFriction("angle", 0.3), ActuatorLag("torque", 0.02)]
    loaded = load_simulator(corrected_settings(simulator_settings(plain), effects))
    assert loaded.effects == tuple(effects) and loaded.parameters["inertia"].value == 0.2
    assert corrected_settings(plain, []) == plain


def test_arguments_are_kept():
    settings = simulator_settings({"class_path": PENDULUM, "init_args": {"mass": 0.07}})
    assert settings["init_args"]["mass"] == 0.07 and settings["init_args"]["substeps"] == 8
    assert load_simulator(settings).parameters["mass"].value == 0.07


def test_a_class_that_is_out_of_reach_says_where_to_start(tmp_path):
    path = tmp_path / "corrected.yaml"
    path.write_text(yaml.safe_dump({"class_path": "arm_of_mine.Arm", "init_args": {}}))
    with pytest.raises(ValueError, match=r"no module 'arm_of_mine'.*PYTHONPATH"):
        load_simulator(path, trusted=["arm_of_mine"])


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("sims.pendulum.Nothing", "Nothing"),
        ("no_such_module.Thing", "no_such_module"),
        ("absent.yaml", "absent.yaml"),
        ("sims.effects.Delay", "Simulator"),
        ({"class_path": PENDULUM, "init_args": {"mas": 1.0}}, "mas"),
    ],
)
def test_what_cannot_be_loaded_is_said_in_one_line(source, names):
    with pytest.raises(ValueError, match=names) as caught:
        load_simulator(source)
    assert "\n" not in str(caught.value)


def test_a_module_that_refuses_itself_is_told_in_its_own_words(tmp_path, monkeypatch):
    (tmp_path / "crane_of_mine.py").write_text("raise ValueError('sway is in degrees')")
    monkeypatch.syspath_prepend(str(tmp_path))
    told = not_found("crane_of_mine.Crane")
    assert told.endswith("cannot be imported: sway is in degrees")


def test_effects_are_chosen_by_name():
    pendulum = PendulumEquation()
    assert chosen_effects(pendulum, ["library"]) == library(pendulum)
    chosen = chosen_effects(pendulum, ["mass", "viscous_friction", "delay@voltage"])
    assert [str(e) for e in chosen] == ["mass", "viscous_friction@pivot", "delay@voltage"]
    offsets = chosen_effects(pendulum, ["sensor_offset"])
    assert offsets == (SensorOffset("angle"), SensorOffset("rate"))


def test_effects_are_chosen_by_class():
    pendulum = PendulumEquation()
    (cogging,) = chosen_effects(pendulum, ["sims.effects.Cogging@pivot"])
    assert cogging == Cogging("pivot")
    assert chosen_effects(pendulum, ["sims.effects.Backlash"]) == (Backlash("pivot"),)
    given = {"class_path": "sims.effects.StribeckFriction", "init_args": {"joint": "pivot"}}
    assert chosen_effects(pendulum, [given]) == (StribeckFriction("pivot"),)


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        ("viscous_fricton", "viscous_fricton"),
        ("delay@current", "delay@current"),
        ("sims.effects.Nothing", "Nothing"),
        ("sims.pendulum.Pendulum", "no effect"),
        ("sims.effects.Cogging@voltage", "it has: pivot"),
        ({"class_path": "sims.effects.Delay", "init_args": {"actuator": "u"}}, "it has: voltage"),
        ({"class_path": "sims.effects.Delay", "init_args": {"joint": "u"}}, "joint"),
    ],
)
def test_an_effect_that_cannot_act_is_refused(wanted, names):
    with pytest.raises(ValueError, match=names):
        chosen_effects(PendulumEquation(), [wanted])
