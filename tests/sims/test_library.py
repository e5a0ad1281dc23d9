"""The library of effects: units, places, families, exact aliases."""

from typing import ClassVar

import numpy as np
import pytest
from hosts import HOSTS, rows

from sims.effects import (
    CubicSpring,
    Delay,
    LinearSpring,
    ParameterChange,
    SensorOffset,
    StribeckFriction,
    ViscousFriction,
    exact_aliases,
    library,
    typical,
)
from sims.effects.aliases import _columns, _perhaps_dependent
from sims.equations import FirstOrderSystem
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter


def test_units_and_scales_come_from_the_host():
    units = {
        str(effect): {name: q.unit for name, q in effect.quantities(Pendulum()).items()}
        for effect in library(Pendulum())
    }
    assert units["viscous_friction@pivot"]["coefficient"] == "N m s/rad"
    assert units["quadratic_drag@pivot"]["coefficient"] == "N m s^2/rad^2"
    assert units["cubic_spring@pivot"]["stiffness"] == "N m/rad^3"
    assert units["stribeck_friction@pivot"]["speed"] == "rad/s"
    assert units["backlash@pivot"]["width"] == "rad"
    assert units["dead_zone@voltage"]["width"] == "V"
    assert units["delay@voltage"]["time"] == "s"
    assert units["sensor_scale@angle"]["scale"] == "1"
    assert units["mass"]["change"] == "kg"


def test_library_names_every_effect_and_bounds_what_dissipates():
    effects = library(Pendulum())
    assert {effect.name for effect in effects} >= {
        *("viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag"),
        *("linear_spring", "cubic_spring", "constant_load", "cogging", "mass", "inertia"),
        *("length", "actuator_gain", "actuator_bias", "dead_zone", "saturation", "delay"),
        *("actuator_lag", "backlash", "sensor_offset", "sensor_scale", "encoder_scale"),
    }
    for effect in effects:
        assert effect.absent and effect.sentence and effect.needs
        for quantity in effect.quantities(Pendulum()).values():
            assert quantity.scale > 0 and quantity.low < quantity.high
    low = {
        effect.name: effect.quantities(Pendulum())[effect.strengths()[0]].low for effect in effects
    }
    for name in ("viscous_friction", "coulomb_friction", "linear_spring", "delay", "backlash"):
        assert low[name] == 0


@pytest.mark.parametrize("host", HOSTS)
def test_exact_aliases(host):
    found = {frozenset(alias.effects) for alias in exact_aliases(HOSTS[host])}
    assert frozenset({"constant_load@pivot", "actuator_bias@voltage"}) in found
    assert frozenset({"mass", "length", "gravity"}) in found
    assert (
        frozenset({"viscous_friction@pivot", "actuator_gain@voltage", "torque_constant"}) in found
    )
    four = {"viscous_friction@pivot", "actuator_gain@voltage", "mass", "inertia"}
    assert frozenset(four) in found
    following = exact_aliases(PendulumEquation(inertia_follows_mass=True))
    twins = [set(alias.effects) for alias in following if "the same motion" in alias.says]
    assert twins and not any("mass" in names for names in twins)


class Tank(FirstOrderSystem):
    dt = 0.1
    state_channels = (Channel("level", "m", "other"),)
    action_channels = (Channel("flow", "l/s", "input"),)
    parameters: ClassVar = {
        "rise": Parameter(2.0, "m s/l", ""),
        "time": Parameter(3.0, "s", "", low=0.1),
    }

    def derivative(self, x, u, p):
        return (p.rise * u - x) / p.time


def test_what_a_sensor_of_a_first_order_state_does_is_told_from_no_gain_and_no_load():
    twins = [set(alias.effects) for alias in exact_aliases(Tank()) if not alias.combination]
    assert {"actuator_gain@flow", "rise", "sensor_scale@level"} in twins
    assert {"constant_load@level", "actuator_bias@flow", "sensor_offset@level"} in twins


class Boat(FirstOrderSystem):
    """A speed whose scale says how much it varies, and drag that is left alone at low speed."""

    dt = 1.0
    state_channels = (Channel("speed", "m/s", "rate", scale=0.3),)
    action_channels = (Channel("thrust", "N", "input", scale=40.0),)
    parameters: ClassVar = {"drag": Parameter(3.5, "N s^2/m^2", "", low=0.1)}

    def derivative(self, x, u, p):
        return (u - p.drag * np.maximum(x, 2.0) ** 2) / 100.0


def test_what_is_alike_in_random_states_only_is_no_twin_where_the_log_is():
    def twins(**where):
        return [set(alias.effects) for alias in exact_aliases(Boat(), **where)]

    rng = np.random.default_rng(1)
    seen = rng.uniform(2, 4, (96, 1)), rng.uniform(0, 80, (96, 1))
    assert any({"constant_load@speed", "drag"} <= names for names in twins())
    assert not any({"constant_load@speed", "drag"} <= names for names in twins(seen=seen))
    # What is alike everywhere stays so.
    assert any(
        {"constant_load@speed", "actuator_bias@thrust"} <= names for names in twins(seen=seen)
    )


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (ViscousFriction("knee", 1.0), "joint 'knee'.*pivot"),
        (Delay("torque", 1.0), "actuator 'torque'.*voltage"),
        (SensorOffset("speed", 1.0), "channel 'speed'.*angle, rate"),
        (ParameterChange("weight", 1.0), "parameter 'weight'.*mass"),
    ],
)
def test_a_wrong_place_lists_the_right_ones(effect, message):
    with pytest.raises(ValueError, match=message):
        Pendulum().with_effects([effect])


def test_values_for_different_numbers_of_rows_are_refused():
    with pytest.raises(ValueError, match="rows"):
        _ = StribeckFriction("pivot", np.ones(3), np.ones(4)).rows


def test_every_effect_says_which_family_it_belongs_to():
    pendulum = Pendulum()
    families = {str(effect): effect.family_in(pendulum) for effect in library(pendulum)}
    assert {name for name, family in families.items() if family == "dissipation"} == {
        "viscous_friction@pivot",
        "coulomb_friction@pivot",
        "stribeck_friction@pivot",
        "directional_friction@pivot",
        "quadratic_drag@pivot",
        "damping",
    }
    assert families["mass"] == families["actuator_gain@voltage"] == ""
    dry = {effect.name for effect in library(pendulum) if effect.subfamily == "dry friction"}
    assert dry == {"coulomb_friction", "stribeck_friction", "directional_friction"}
    (general,) = [e for e in library(pendulum) if e.name == "directional_friction"]
    states, actions = rows(6)
    for name in general.special_cases:
        (special,) = [typical(e, pendulum) for e in library(pendulum) if e.name == name]
        equal = general.with_values(forward=special.level, backward=special.level)
        one, other = (pendulum.with_effects([e]).step(states, actions) for e in (special, equal))
        assert np.array_equal(one, other)
    before_the_sensor = {e.name for e in library(pendulum) if e.upstream_of_sensor}
    assert before_the_sensor == {"dead_zone", "saturation", "actuator_lag"}


def test_a_spring_may_rest_anywhere_and_is_absent_without_stiffness():
    for kind in (LinearSpring, CubicSpring):
        rest = kind("pivot").quantities(Pendulum())["rest"]
        assert rest.role == "shape" and rest.starts == (-0.5, 0.0, 0.5)
        assert kind("pivot", 0.0, 0.4).absent
        assert not np.any(kind("pivot", np.zeros(3), np.ones(3)).present())
        assert next(e for e in library(Pendulum()) if isinstance(e, kind)) == kind("pivot")


def test_an_effect_that_is_rough_everywhere_hides_no_aliases_of_others():
    rng = np.random.default_rng(0)
    load, drag = rng.standard_normal((2, 96, 2))
    near = {"load": load, "bias": 2 * load, "drag": drag, "lost": 1e-9 * drag}
    far = near | {"lost": 1e-9 * rng.standard_normal((96, 2))}
    columns, _ = _columns(near, far)
    assert set(columns) == {"load", "bias", "drag"}
    assert columns["load"] == pytest.approx(columns["bias"])
    few = {f"effect {i}": rng.standard_normal((2, 2)) for i in range(3)}
    assert _columns(few, few) == ({}, {})


def test_dependent_sets_of_many_effects_are_found_in_a_bounded_time():
    rng = np.random.default_rng(0)
    columns = {f"effect {i}": rng.standard_normal(300) for i in range(90)}
    columns["effect 7"] = columns["effect 3"] - 2 * columns["effect 50"]
    columns = {name: column / np.linalg.norm(column) for name, column in columns.items()}
    blurs = dict.fromkeys(columns, 1e-9)
    sets = _perhaps_dependent(list(columns), 3, columns, blurs)
    assert sets == [("effect 3", "effect 7", "effect 50")]
    assert _perhaps_dependent(list(columns), 4, columns, blurs) == []
