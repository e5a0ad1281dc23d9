"""A parameter that changes with a state or an input, against SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from sims import Channel, EquationOfMotion, FirstOrderSystem, Parameter
from sims.chosen import chosen_effects
from sims.effects import ParameterChange, ParameterCurve, ParameterSpline, SecondStore
from sims.loading import effect_settings
from sims.pendulum import Pendulum


class Swing(EquationOfMotion):
    dt = 0.02
    substeps = 20
    state_channels = (
        Channel("angle", "rad", "position", scale=1.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=3.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=1.0),)
    parameters = {
        "weight": Parameter(4.0, "N m", "of the bob"),
        "damping": Parameter(0.2, "N m s/rad", "of the bearing", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        pull = p.weight * np.sin(q[:, 0]) + p.damping * v[:, 0]
        return (u[:, 0] + force[:, 0] - pull)[:, None]


class Room(FirstOrderSystem):
    dt = 60.0
    substeps = 10
    state_channels = (
        Channel("warmth", "K", "other", scale=20.0),
        Channel("wall", "K", "other", scale=20.0),
    )
    action_channels = (Channel("fan", "1", "input", scale=1.0),)
    parameters = {"loss": Parameter(1e-3, "1/s", "to the outside", low=1e-4)}

    def derivative(self, x, u, p):
        between = 2e-4 * (x[:, 0] - x[:, 1])
        return np.stack([-p.loss * x[:, 0] - between, between], axis=1)


def parabola(x, low, high, values):
    """Through three points at equal distances, level beyond."""
    within = np.clip(x, low, high)
    return np.polyval(np.polyfit([low, (low + high) / 2, high], values, 2), within)


POINTS = {"first": -0.1, "second": 0.05, "third": 0.6}


@pytest.mark.parametrize(("over", "size"), [("angle", False), ("rate", True), ("torque", False)])
def test_a_damper_that_follows_a_position_a_speed_or_an_input(over, size):
    curve = ParameterCurve("damping", over, **POINTS, low=0.0 if size else -1.5, high=1.5)
    swing = Swing(effects=[type(curve)(**{**vars(curve), "of_size": size})])
    torque = 0.7

    def rates(_, x):
        level = {"angle": x[0], "rate": abs(x[1]), "torque": torque}[over]
        damping = 0.2 + parabola(level, 0.0 if size else -1.5, 1.5, list(POINTS.values()))
        return [x[1], torque - 4.0 * np.sin(x[0]) - damping * x[1]]

    start = [1.3, -0.5]
    true = solve_ivp(rates, (0, 1.0), start, rtol=1e-10, atol=1e-12).y[:, -1]
    path = swing.rollout(np.array(start), np.full((50, 1), torque))
    np.testing.assert_allclose(path[-1], true, atol=2e-5)


def test_a_loss_that_follows_a_state_beside_a_store_stays_within_its_bounds():
    values = [-3e-3, 1e-3, 4e-3]  # below the least loss at first
    curve = ParameterCurve("loss", "wall", *values, low=0.0, high=20.0)
    store = SecondStore("warmth", rate=5e-4, time=900.0)
    room = Room(effects=[curve, store])

    def rates(_, x):
        loss = max(1e-3 + parabola(x[1], 0.0, 20.0, values), 1e-4)
        between, aside = 2e-4 * (x[0] - x[1]), x[2] - x[0]
        return [-loss * x[0] - between + 5e-4 * aside, between, -aside / 900.0]

    start = [20.0, 2.0, 20.0]
    true = solve_ivp(rates, (0, 1800.0), start, rtol=1e-10, atol=1e-12, max_step=5.0).y[:, -1]
    path = room.rollout(np.array(start), np.zeros((30, 1)))
    np.testing.assert_allclose(path[-1], true, rtol=1e-5)


def test_one_through_five_points_follows_the_cubic_spline_through_them():
    values = [0.3, -0.1, 0.4, 1.2, 0.2]
    knots = np.linspace(-1.5, 1.5, 5)
    curve = ParameterSpline("damping", "angle", *values[:3], low=-1.5, high=1.5,
                            fourth=values[3], fifth=values[4])  # fmt: skip
    assert [curve.point_of(field)[0] for field in curve.strengths()] == knots.tolist()
    between = CubicSpline(knots, values)

    def rates(_, x):
        damping = 0.2 + between(np.clip(x[0], -1.5, 1.5))
        return [x[1], -4.0 * np.sin(x[0]) - damping * x[1]]

    start = [1.9, -0.5]
    true = solve_ivp(rates, (0, 1.0), start, rtol=1e-10, atol=1e-12, max_step=0.01).y[:, -1]
    path = Swing(effects=[curve]).rollout(np.array(start), np.zeros((50, 1)))
    np.testing.assert_allclose(path[-1], true, atol=2e-5)


def test_one_through_five_points_has_those_of_fewer_as_a_case():
    spline, curve = ParameterSpline("damping", "rate"), ParameterCurve("damping", "rate")
    assert spline.contains(curve) and spline.contains(ParameterChange("damping"))
    assert not curve.contains(spline)
    assert not spline.contains(ParameterCurve("damping", "rate", of_size=True))


def test_rows_have_their_own_numbers_and_zeros_change_no_bit():
    rng = np.random.default_rng(0)
    states, actions = rng.normal(size=(4, 2)), rng.normal(size=(4, 1))
    plain = Swing().step(states, actions)
    sizes = np.array([0.0, 0.1, 0.0, 0.3])
    curve = ParameterCurve("damping", "angle", sizes, sizes, sizes)
    found = Swing(effects=[curve]).step(states, actions)
    for row, size in enumerate(sizes):
        alone = Swing(effects=[ParameterChange("damping", float(size))])
        expected = alone.step(states[row : row + 1], actions[row : row + 1])[0]
        np.testing.assert_allclose(found[row], expected, rtol=1e-13)
    absent = Swing(effects=[ParameterCurve("damping", "angle")])
    np.testing.assert_array_equal(absent.step(states, actions), plain)


def test_it_is_named_by_parameter_and_channel_and_kept_in_a_file():
    curve = ParameterCurve("damping", "rate", **POINTS, low=0.0, high=2.0, of_size=True)
    assert str(curve) == "parameter_curve@damping over |rate|"
    assert curve.contains(ParameterChange("damping")) and not curve.contains(
        ParameterChange("weight")
    )
    settings = effect_settings(curve)
    assert settings["class_path"] == "sims.effects.ParameterCurve"
    assert ParameterCurve(**settings["init_args"]) == curve


def test_it_is_asked_for_by_parameter_and_channel():
    swing = Swing()
    (curve,) = chosen_effects(swing, ["parameter_curve@damping over |rate|"])
    assert curve == ParameterCurve("damping", "rate", of_size=True)
    (spline,) = chosen_effects(swing, ["parameter_spline@damping over angle"])
    assert spline == ParameterSpline("damping", "angle")
    for wanted, says in (
        ("parameter_spline", "write parameter_spline@PARAMETER over CHANNEL"),
        ("parameter_curve", "write parameter_curve@PARAMETER over CHANNEL"),
        ("parameter_curve@damping", "write parameter_curve@PARAMETER over CHANNEL"),
        ("parameter_curve@mass over rate", "no parameter 'mass'"),
        ("parameter_curve@damping over heat", "no channel 'heat'"),
        ("sims.effects.ParameterCurve@damping", "cannot act in Swing"),
    ):
        with pytest.raises(ValueError, match=says):
            chosen_effects(swing, [wanted])


def test_what_it_needs_is_said():
    with pytest.raises(ValueError, match="needs a system that is written as equations"):
        Pendulum(effects=[ParameterCurve("mass", "angle")])
    with pytest.raises(ValueError, match=r"no channel 'heat' .*angle, rate, torque"):
        Swing(effects=[ParameterCurve("damping", "heat")])
    with pytest.raises(ValueError, match=r"no parameter 'mass' .*weight, damping"):
        Swing(effects=[ParameterCurve("mass", "angle")])
