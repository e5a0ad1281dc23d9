"""A drive that makes no more than so much, beside SciPy's integration of the same motors."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import ConstantLoad, CoulombFriction, DriveLimit
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter

CONSTANT, OHM, INERTIA, DAMPING = 0.05, 0.8, 5e-4, 2e-4


class Motor(FirstOrderSystem):
    """Its speed, under a voltage."""

    dt = 0.01
    state_channels = (Channel("speed", "rad/s", "rate", scale=100.0),)
    action_channels = (Channel("voltage", "V", "input", scale=6.0, low=-12.0, high=12.0),)
    parameters: ClassVar = {
        "damping": Parameter(DAMPING, "N m s/rad", "damping", low=0.0, family="dissipation")
    }

    def derivative(self, x, u, p):
        current = (u[:, 0] - CONSTANT * x[:, 0]) / OHM
        return ((CONSTANT * current - p.damping * x[:, 0]) / INERTIA)[:, None]


class WithItsRest(Motor):
    """The same, whose damping no family names, and over which it would divide."""

    parameters: ClassVar = {
        "loose": Parameter(1 / DAMPING, "rad/(N m s)", "looseness", low=1.0, family="dissipation")
    }

    def derivative(self, x, u, p):
        current = (u[:, 0] - CONSTANT * x[:, 0]) / OHM
        return ((CONSTANT * current - x[:, 0] / p.loose) / INERTIA)[:, None]


@pytest.mark.parametrize(("motor", "braked"), [(Motor, False), (WithItsRest, True)])
def test_a_motor_s_current_is_limited_and_its_damping_is_not(motor, braked):
    """Where nothing tells the drive from the damping, the limit is of both."""
    volts = np.repeat([12.0, -12.0, 2.0, -4.0], 60)
    path = motor(effects=[DriveLimit("speed", 500.0)]).rollout([0.0], volts[:, None])

    def rates(_, x, volt):
        drive = CONSTANT * (volt - CONSTANT * x) / OHM / INERTIA
        brake = DAMPING * x / INERTIA
        if braked:
            return np.clip(drive - brake, -500, 500)
        return np.clip(drive, -500, 500) - brake

    x = np.zeros(1)
    for k, volt in enumerate(volts):
        found = solve_ivp(rates, (0, 0.01), x, rtol=1e-9, atol=1e-9, args=(volt,), max_step=1e-3)
        x = found.y[:, -1]
        assert path[k + 1] == pytest.approx(x, abs=2e-3)


def test_an_equation_that_tells_its_drive_has_that_limited():
    states, volts = np.array([[0.3, 2.0], [1.0, -9.0]]), np.array([[3.0], [-3.0]])
    limited = PendulumEquation(effects=[DriveLimit("pivot", 0.004)]).step(states, volts)
    plain = PendulumEquation()
    drive = plain.drive_forces(states, volts)[:, 0]
    assert (np.abs(drive) > 0.005).all()  # all through the period
    for row, push in enumerate(drive):
        rest = -plain.parameters["torque_constant"].value * states[row, 1:2]
        # No current of its own, and a constant torque in its place.
        coasting = plain.with_effects([ConstantLoad("pivot", 0.004 * np.sign(push))])
        lifted = coasting.with_parameters(resistance=1e12)
        assert limited[row] == pytest.approx(
            lifted.step(states[row : row + 1], rest[None] * 0)[0], abs=1e-6
        )


def test_every_row_has_its_own_beside_dry_friction():
    rng = np.random.default_rng(3)
    states, volts = 40 * rng.standard_normal((6, 1)), rng.uniform(-12, 12, (6, 1))
    levels = np.array([50.0, 100.0, 300.0, 600.0, 2000.0, np.inf])
    beside = CoulombFriction("speed", 20.0)
    together = Motor(effects=[beside, DriveLimit("speed", levels)]).step(states, volts)
    for i, level in enumerate(levels):
        own = Motor(effects=[beside, DriveLimit("speed", float(level))])
        assert np.array_equal(own.step(states[i : i + 1], volts[i : i + 1])[0], together[i])
    free = Motor(effects=[DriveLimit("speed", np.inf)]).step(states, volts)
    assert np.array_equal(free, Motor().step(states, volts))
    assert "failed" not in repr(check_simulator(Motor(effects=[DriveLimit("speed", 300.0)])))


class Pushed(EquationOfMotion):
    state_channels = (
        Channel("x", "m", "position"),
        Channel("v", "m/s", "rate", rate_of="x", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=5.0),)

    def acceleration(self, q, v, u, force, p):
        return u + force


class Servo(Pushed):
    """Goals, and nothing that tells what its drive makes of them."""

    action_channels = (Channel("goal", "m", "input", scale=5.0),)

    def acceleration(self, q, v, u, force, p):
        return 20 * (u - q) - 3 * v + force


def test_it_is_looked_for_where_an_input_is_no_force_and_the_drive_is_known():
    def limits(host):
        return [str(one) for one in further_in(host) if isinstance(one, DriveLimit)]

    assert limits(Motor()) == ["drive_limit@speed"]
    assert limits(PendulumEquation()) == ["drive_limit@pivot"]
    assert DriveLimit("speed").quantities(Motor())["level"].unit == "rad/s^2"
    assert limits(Pushed()) == limits(Servo()) == []
    with pytest.raises(ValueError, match=r"needs an input that is no force itself; use saturation"):
        Motor.with_effects(_current(), [DriveLimit("speed", 1.0)])
    with pytest.raises(ValueError, match=r"tells its drive_force; Servo does not"):
        Servo().with_effects([DriveLimit("x", 1.0)])


def _current():
    class Torque(Motor):
        action_channels = (Channel("torque", "N m", "input", scale=1.0),)

    return Torque()
