"""Where numbers of effects are looked for follows from what was measured."""

import numpy as np
import pytest

from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.trajectories import Trajectory
from sims.effects import (
    ActuatorLag,
    CubicSpring,
    Delay,
    FlexiblePart,
    ForceCurve,
    FrictionCurve,
    InputCurve,
    LinearSpring,
    Saturation,
    SensorScale,
    StribeckFriction,
)
from sims.pendulum_equation import PendulumEquation


def pool(low, high, volts=3.0):
    """Candidates for angles and volts that were measured between these."""
    states = np.column_stack([np.linspace(low, high, 51), np.zeros(51)])
    run = Trajectory("run", 0.05 * np.arange(51.0), states, volts * np.cos(np.arange(50))[:, None])
    effects = [
        LinearSpring("pivot"), CubicSpring("pivot"), SensorScale("angle"), Saturation("voltage"),
        Delay("voltage"), ActuatorLag("voltage"),
    ]  # fmt: skip
    return {c.name: c for c in candidates(PendulumEquation(), effects, Samples.join([run], 5))}


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (2.5, 3.5), (-40.0, 10.0), (90.0, 100.0)])
def test_a_spring_rests_near_zero_or_what_was_measured(low, high):
    for name in ("linear_spring", "cubic_spring"):
        rest = next(knob for knob in pool(low, high)[name].knobs if knob.field == "rest")
        assert rest.low < min(low, 0) <= max(high, 0) < rest.high
        # Not so far away that its force is the same everywhere.
        assert rest.high - rest.low <= abs(max(high, 0) - min(low, 0)) + 2 * max(high - low, 3.2)


def test_a_scale_far_from_zero_is_one_about_the_middle():
    assert pool(-1.0, 1.0)["sensor_scale"].effect.zero == 0.0
    assert pool(0.5, 1.5)["sensor_scale"].effect.zero == 0.0
    assert pool(290.0, 300.0)["sensor_scale"].effect.zero == pytest.approx(295.0)
    scale = pool(290.0, 300.0)["sensor_scale"].effect.with_values(scale=0.1)
    assert np.allclose(scale.read(np.array([290.0, 295.0, 300.0])), [289.5, 295.0, 300.5])
    assert np.allclose(scale.undo(scale.read(np.arange(9.0))), np.arange(9.0))


def test_a_saturation_is_looked_for_where_inputs_reach():
    for volts in (0.5, 3.0, 20.0):
        (level,) = pool(-1.0, 1.0, volts)["saturation"].knobs
        assert level.high == pytest.approx(volts)


@pytest.mark.parametrize("name", ["delay", "actuator_lag"])
def test_no_command_is_later_than_the_record_lasts(name):
    # A delay of a million samples would need a million places of memory.
    (knob,) = pool(-1.0, 1.0)[name].knobs
    assert knob.high == pytest.approx(2.5, abs=0.06)


def test_nothing_follows_a_position_that_nobody_measured():
    effects = [
        ForceCurve("pivot", low=-8.0, high=0.0),
        FrictionCurve("pivot"),
        LinearSpring("pivot"),
    ]

    def found(missing):
        states = np.column_stack([np.linspace(-1, 1, 51), np.full(51, 0.8)])
        states[:, missing] = np.nan
        run = Trajectory("run", 0.05 * np.arange(51.0), states, np.zeros((50, 1)))
        return {c.name for c in candidates(PendulumEquation(), effects, Samples.join([run], 5))}

    assert found([]) == {"force_curve", "friction_curve", "linear_spring"}
    assert found([0]) == {"friction_curve"}
    assert "force_curve" in found([1])


def test_a_curve_keeps_the_points_that_it_was_given():
    run = Trajectory("run", 0.05 * np.arange(51.0), np.zeros((51, 2)), np.ones((50, 1)))
    given = [InputCurve("voltage", low=0.5, high=1.0), Saturation("voltage")]
    curve, _ = candidates(PendulumEquation(), given, Samples.join([run], 5))
    assert curve.effect.reach == (0.5, 1.0)


def test_no_swing_is_looked_for_that_a_window_holds_next_to_nothing_of():
    states = np.column_stack([np.linspace(-1.0, 1.0, 401), np.zeros(401)])
    run = Trajectory("run", 0.05 * np.arange(401.0), states, np.ones((400, 1)))
    pendulum, samples, low = PendulumEquation(), Samples.join([run], 5), {}
    for seconds in (np.inf, 2.0, 0.5):
        (part,) = candidates(pendulum, [FlexiblePart("pivot")], samples, seconds)
        (swing,) = (knob for knob in part.knobs if knob.field == "frequency")
        column = part.knobs.index(swing)
        assert min(float(trial.values[:, column].min()) for trial in part.trials) >= swing.low
        low[seconds] = swing.low
    assert low[np.inf] == low[2.0] == pytest.approx(3 / 20, rel=0.01)
    assert low[0.5] == 0.25 / 0.5


def test_a_number_that_does_nothing_below_another_knows_that_one():
    states = np.column_stack([np.linspace(-1.0, 1.0, 51), np.zeros(51)])
    run = Trajectory("run", 0.05 * np.arange(51.0), states, np.ones((50, 1)))
    (found,) = candidates(PendulumEquation(), [StribeckFriction("pivot")], Samples.join([run], 5))
    above = {knob.field: knob.above for knob in found.knobs}
    assert above == {"sliding": "", "breakaway": "sliding", "speed": ""}
