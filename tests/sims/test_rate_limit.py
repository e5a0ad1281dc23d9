"""Limits of a rate: against closed forms and motion between hard stops of the rate."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from servos import DAMPING, DT, FREQUENCY, SLOW, Servo, SlowServo

from sims.checks import check_simulator
from sims.chosen import chosen_effects
from sims.effects import CoulombFriction, RateLimit, library
from sims.equations import FirstOrderSystem
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

TIMES = DT * np.arange(51)


def test_a_state_ramps_at_the_limit_and_then_settles():
    level, goal = 200.0, 60.0
    path = SlowServo(effects=[RateLimit("angle", level)]).rollout([0.0], np.full((50, 1), goal))
    ends = (goal - level * SLOW) / level
    settling = goal - level * SLOW * np.exp(-(TIMES - ends) / SLOW)
    assert path[:, 0] == pytest.approx(np.where(ends > TIMES, level * TIMES, settling), abs=1e-5)


def hard(level, goal):
    """Angle at ``TIMES``: free, then at the level exactly, then free again."""

    def rates(_, y):
        return [y[1], FREQUENCY**2 * (goal - y[0]) - 2 * DAMPING * FREQUENCY * y[1]]

    def reached(_, y):
        return y[1] - level

    reached.terminal, reached.direction = True, 1
    options = {"rtol": 1e-10, "atol": 1e-12, "dense_output": True}
    first = solve_ivp(rates, (0, 1), [0, 0], events=reached, **options)
    start, angle = first.t[-1], first.y[0, -1]
    leaves = goal - 2 * DAMPING / FREQUENCY * level
    end = start + (leaves - angle) / level
    last = solve_ivp(rates, (end, 2), [leaves, level], **options)
    return np.select(
        [start > TIMES, end > TIMES],
        [first.sol(TIMES)[0], angle + level * (TIMES - start)],
        last.sol(TIMES)[0],
    )


def test_a_joint_runs_at_the_limit_and_leaves_it_where_its_servo_brakes():
    expected = hard(4.0, np.pi / 2)
    actions, off = np.full((50, 1), 90.0), []
    for substeps in (10, 40):
        servo = Servo(substeps=substeps, effects=[RateLimit("angle", 4.0)])
        path = servo.rollout([0.0, 0.0], actions)
        assert path[:, 1].max() <= 4.0 + 1e-9
        off.append(np.abs(path[:, 0] - expected).max())
    assert off[0] < 2e-3 and off[1] < 0.3 * off[0]


def test_a_rate_beyond_the_limit_comes_back_to_it_and_friction_still_holds():
    limit = RateLimit("angle", 4.0)
    assert Servo(effects=[limit]).step([[0.0, 9.0]], [[100.0]])[0, 1] == pytest.approx(4.0, abs=0.1)
    held = Servo(effects=[limit, CoulombFriction("angle", 10.0)])
    path = held.rollout([0.0, 0.0], np.full((100, 1), 90.0))
    assert path[:, 1].max() <= 4.0 + 1e-9 and path[-1, 1] == 0.0
    assert 0 < abs(np.pi / 2 - path[-1, 0]) < 10.0 / FREQUENCY**2


class Room(FirstOrderSystem):
    """It follows the temperature outside, and no limit is in that."""

    state_channels = (Channel("inside", "degC", "other"),)
    action_channels = (Channel("outside", "degC", "input"),)

    def derivative(self, x, u, p):
        return (u - x) / 500.0


@pytest.mark.parametrize("kind", [SlowServo, Servo])
def test_rows_have_limits_of_their_own_and_an_infinite_one_changes_no_bit(kind):
    plain, rng = kind(), np.random.default_rng(0)
    states = rng.normal(0, 1, (6, len(plain.state_channels)))
    actions = rng.uniform(-90, 90, (6, 1))
    levels = np.array([0.5, 1.0, 2.0, 50.0, 1e3, np.inf])
    together = plain.with_effects([RateLimit("angle", levels)]).step(states, actions)
    for i, level in enumerate(levels):
        alone = plain.with_effects([RateLimit("angle", float(level))])
        assert np.array_equal(alone.step(states[[i]], actions[[i]])[0], together[i])
    assert np.array_equal(together[-1], plain.step(states, actions)[-1])
    findings = check_simulator(plain.with_effects([RateLimit("angle", 300.0)]))
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))


class Drive(FirstOrderSystem):
    """A speed that follows its command."""

    name = "drive"
    state_channels = (Channel("speed", "m/s", "other"),)
    action_channels = (Channel("command", "m/s", "input"),)

    def derivative(self, x, u, p):
        return u - x


def test_it_is_looked_for_where_a_place_is_commanded():
    for kind in (SlowServo, Servo):
        assert "rate_limit@angle" in {str(effect) for effect in library(kind())}
    assert not any(effect.name == "rate_limit" for effect in library(Room()))
    assert not any(effect.name == "rate_limit" for effect in library(Drive()))
    (asked,) = chosen_effects(Drive(), ["sims.effects.RateLimit@speed"])
    assert asked == RateLimit("speed")
    assert not any(effect.name == "rate_limit" for effect in library(PendulumEquation()))
    PendulumEquation(effects=[RateLimit("pivot", 3.0)])  # who wants it may have it
    with pytest.raises(ValueError, match="EquationOfMotion"):
        Pendulum(effects=[RateLimit("pivot", 3.0)])
    assert RateLimit("angle").quantities(SlowServo())["level"].unit == "deg/s"
    assert RateLimit("angle").quantities(Servo())["level"].unit == "rad/s"
