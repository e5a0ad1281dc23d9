"""First-order systems that a user brings: heaters, tanks, and speeds that rub."""

import numpy as np
import pytest

from sims.checks import check_simulator
from sims.effects import (
    ActuatorLag,
    ConstantLoad,
    CoulombFriction,
    LinearSpring,
    ProportionalLoss,
    ViscousFriction,
    library,
)
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Heater(FirstOrderSystem):
    """A plate that is heated and loses heat to the room."""

    dt = 2.0
    state_channels = (Channel("temperature", "K", "other", scale=20.0),)
    action_channels = (Channel("power", "W", "input", scale=10.0, low=0.0, high=20.0),)
    parameters = {
        "capacity": Parameter(50.0, "J/K", "heat capacity", low=1.0),
        "loss": Parameter(0.5, "W/K", "heat loss", low=0.0),
    }

    def derivative(self, x, u, p):
        return ((u[:, 0] - p.loss * x[:, 0]) / p.capacity)[:, None]


def test_a_state_of_ones_own_is_not_declared_as_what_effects_remember():
    class Walled(Heater):
        state_channels = (*Heater.state_channels, Channel("wall", "K", "memory"))

    with pytest.raises(ValueError, match="channel 'wall' is of kind 'memory', which effects"):
        Walled()


def test_first_order_system_follows_its_closed_form():
    heater = Heater(effects=[ConstantLoad("temperature", 0.1)])
    after = heater.step([[0.0], [30.0]], [[10.0], [0.0]])
    final = (np.array([[10.0], [0.0]]) / 50 + 0.1) * 100
    expected = final + (np.array([[0.0], [30.0]]) - final) * np.exp(-2.0 / 100)
    assert after == pytest.approx(expected, abs=1e-9)


def test_a_loss_in_proportion_decays_and_draws_to_where_a_load_says():
    tank = Heater(effects=[ProportionalLoss("temperature", 0.02)])
    after = tank.step([[0.0], [30.0]], [[0.0], [0.0]])
    assert after == pytest.approx(np.array([[0.0], [30.0]]) * np.exp(-2.0 * 0.03), abs=1e-9)
    drawn = tank.with_effects(
        [ProportionalLoss("temperature", 0.02), ConstantLoad("temperature", 0.3)]
    )
    assert drawn.step([[10.0]], [[0.0]]) == pytest.approx(10.0, abs=1e-9)
    with pytest.raises(ValueError, match="viscous_friction"):
        Wheel(effects=[ProportionalLoss("speed", 0.02)])


def test_first_order_system_keeps_the_contract_and_hosts_what_makes_sense():
    findings = check_simulator(Heater())
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))
    names = {str(effect) for effect in library(Heater())}
    assert {"constant_load@temperature", "delay@power", "sensor_scale@temperature"} <= names
    assert "proportional_loss@temperature" in names
    assert {"capacity", "loss"} <= names
    assert not any("friction" in name or "spring" in name for name in names)
    with pytest.raises(ValueError, match="first-order"):
        Heater(effects=[ViscousFriction("temperature", 1.0)])


class Wheel(FirstOrderSystem):
    """The speed of a motor's wheel, which nothing brakes."""

    dt = 0.1
    state_channels = (Channel("speed", "rad/s", "rate", scale=10.0),)
    action_channels = (Channel("drive", "V", "input", scale=5.0, low=-12.0, high=12.0),)
    parameters = {
        "gain": Parameter(4.0, "rad/s^2/V", "acceleration per volt", low=0.01),
    }

    def derivative(self, x, u, p):
        return (p.gain * u[:, 0])[:, None]


def test_a_speed_hosts_what_rubs_and_nothing_that_needs_a_position():
    findings = check_simulator(Wheel())
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))
    offered = {effect.name: effect for effect in library(Wheel())}
    assert {"viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag"} <= set(
        offered
    )
    assert not {"linear_spring", "cubic_spring", "cogging", "backlash"} & set(offered)
    units = {
        name: {field: known.unit for field, known in offered[name].quantities(Wheel()).items()}
        for name in ("viscous_friction", "coulomb_friction", "quadratic_drag")
    }
    assert units == {
        "viscous_friction": {"coefficient": "1/s"},
        "coulomb_friction": {"level": "rad/s^2"},
        "quadratic_drag": {"coefficient": "1/rad"},
    }
    with pytest.raises(ValueError, match="position"):
        Wheel(effects=[LinearSpring("speed", 1.0)])


@pytest.mark.parametrize("volts", [0.0, 1.0, 3.0, -3.0])
def test_dry_friction_stops_a_speed_and_holds_it(volts):
    # 4 V^-1 of drive against 6 rad/s^2: a volt does not move it, three do.
    wheel = Wheel(effects=[CoulombFriction("speed", 6.0)])
    path = wheel.rollout([2.0], np.full((20, 1), volts))[:, 0]
    times, drive = 0.1 * np.arange(21), 4.0 * volts
    stop = 2.0 / (6.0 - drive) if drive < 6.0 else np.inf
    expected = 2.0 + (drive - 6.0) * np.minimum(times, stop)
    if drive < -6.0:
        expected += (drive + 6.0) * np.maximum(times - stop, 0.0)
    assert path == pytest.approx(expected, abs=1e-9)
    assert (np.diff(path[times > stop + 0.1]) == 0).all() or abs(drive) > 6.0


def test_effects_can_be_given_when_the_system_is_made():
    heater = Heater(effects=[ActuatorLag("power", 5.0)])
    assert [channel.name for channel in heater.state_channels] == ["temperature", "power lagged"]
    assert heater.with_effects([]).state_channels == Heater.state_channels


def test_channels_may_be_those_of_an_object():
    """A class for any number of tanks."""

    class Row(FirstOrderSystem):
        dt = 1.0
        action_channels = ()

        def __init__(self, count):
            self.state_channels = tuple(Channel(f"tank {i}", "m", "other") for i in range(count))
            super().__init__()

        def derivative(self, x, u, p):
            return -0.1 * x

    assert [c.name for c in Row(2).state_channels] == ["tank 0", "tank 1"]
    assert Row(2).step([[1.0, 2.0]], np.zeros((1, 0))) == pytest.approx(
        np.array([[1.0, 2.0]]) * np.exp(-0.1), abs=1e-6
    )
