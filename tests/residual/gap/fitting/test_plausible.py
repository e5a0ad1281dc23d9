"""Numbers that switch a system off are refused, whatever error they take away."""

from types import SimpleNamespace

import numpy as np
import pytest
from oven import Oven, steps

from residual.gap.data.samples import Samples
from residual.gap.fitting import plausible
from residual.gap.fitting.plausible import (
    absurd,
    doubtful_sensor,
    nearly,
    surprises,
    undone,
    unlikely,
)
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.effects import (
    ActuatorBias,
    ActuatorGain,
    DeadZone,
    Delay,
    LinearSpring,
    ParameterChange,
    Saturation,
    SensorOffset,
    SensorScale,
    ViscousFriction,
)
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel


def built(effect, **values):
    """A model with one effect, its numbers, and what was measured."""
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-2, 2, (40, 1)), 5, axis=0)
    states = np.array([np.pi, 0.0]) + rng.standard_normal((201, 2))
    samples = Samples.join([Trajectory("run", 0.05 * np.arange(201.0), states, volts)], 4)
    model = Model(PendulumEquation(), candidates(PendulumEquation(), [effect], samples))
    return model, np.array([values[knob.field] for knob in model.knobs]), samples


def said(effect, **values):
    return absurd(*built(effect, **values))[1]


@pytest.mark.parametrize(
    ("effect", "values", "words"),
    [
        (ActuatorGain("voltage"), {"gain": -0.99}, "voltage would have 0.01 of its strength"),
        (ActuatorGain("voltage"), {"gain": 30.0}, "voltage would have 31 of its strength"),
        (ActuatorGain("voltage"), {"gain": -2.0}, "voltage would act the other way"),
        (Delay("voltage"), {"time": 7.0}, "would come after its record has ended"),
        (DeadZone("voltage"), {"width": 1.95}, "of its strength"),
        (Saturation("voltage"), {"level": 0.05}, "a weaker actuator"),
        (ParameterChange("mass"), {"change": 0.6}, "mass would be 11.9 times its nominal value"),
        (ParameterChange("inertia"), {"change": -1.8e-4}, "inertia would be 0.0576 times"),
        (SensorScale("rate"), {"scale": 30.0}, "rate would be read as 31 times what is there"),
    ],
)
def test_what_switches_the_system_off_is_refused(effect, values, words):
    assert words in said(effect, **values)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (ActuatorGain("voltage"), {"gain": -0.7}),
        (Delay("voltage"), {"time": 3.0}),
        (DeadZone("voltage"), {"width": 0.8}),
        (ParameterChange("mass"), {"change": 0.1}),
        (ViscousFriction("pivot"), {"coefficient": 1.0}),
    ],
)
def test_what_may_be_is_left_to_the_data(effect, values):
    assert said(effect, **values) == ""


def test_a_limit_that_the_input_is_always_beyond_is_a_gain():
    times, states = 0.05 * np.arange(201.0), np.zeros((201, 2))
    for size, refused in ((3.0, True), (np.linspace(0.0, 3.0, 200)[:, None] % 2.5, False)):
        samples = Samples.join([Trajectory("run", times, states, size * np.ones((200, 1)))], 4)
        found = candidates(PendulumEquation(), [Saturation("voltage")], samples)
        _, why = absurd(Model(PendulumEquation(), found), np.array([2.0]), samples)
        assert ("weaker actuator" in why) is refused


@pytest.mark.parametrize(("deviation", "may_be"), [(0.1, True), (0.01, False)])
def test_an_absurd_number_that_is_badly_known_may_be_a_believable_one(
    monkeypatch, deviation, may_be
):
    model, theta, samples = built(ParameterChange("mass"), change=0.6)
    monkeypatch.setattr(plausible, "deviations", lambda fit, blocks: np.array([deviation]))
    fitter = SimpleNamespace(blocks=None, samples=samples)
    assert nearly(SimpleNamespace(model=model, theta=theta), 0, fitter) is may_be


def test_a_limit_that_the_input_reaches_once_is_refused():
    rng = np.random.default_rng(0)
    times = 0.05 * np.arange(201.0)
    states = np.array([np.pi, 0.0]) + rng.standard_normal((201, 2))
    for bumps, refused in ((1, True), (2, False)):
        volts = rng.uniform(-1, 1, (200, 1))
        for k in range(bumps):
            volts[30 + 80 * k : 60 + 80 * k] = 3.0
        samples = Samples.join([Trajectory("run", times, states, volts)], 4)
        model = Model(
            PendulumEquation(), candidates(PendulumEquation(), [Saturation("voltage")], samples)
        )
        number, why = absurd(model, np.array([2.0]), samples)
        assert ("only once" in why) is refused
        assert number == (0 if refused else 1)


def test_what_ends_at_a_bound_surprises():
    """It is no optimum: the bound has stopped it."""
    model, theta, samples = built(LinearSpring("pivot"), stiffness=0.1, rest=0.2)
    rest = [knob.field for knob in model.knobs].index("rest")

    def fit():
        return SimpleNamespace(
            model=model, theta=theta, by_knob=np.ones((1, 5, len(theta))), weights=np.ones(1)
        )

    assert surprises(fit(), samples) == 0
    theta[rest] = model.knobs[rest].low
    assert surprises(fit(), samples) == 1


@pytest.mark.parametrize(
    ("effect", "size", "low", "surprising"),
    [
        (ActuatorBias("duty"), -0.3, 0.0, 1),
        (ActuatorBias("duty"), -0.3, -1.0, 0),  # may be negative
        (ActuatorBias("duty"), 0.3, 0.0, 0),
        (DeadZone("duty"), 0.3, 0.0, 0),
        (Delay("duty"), 3.0, 0.0, 0),
    ],
)
def test_a_heater_that_would_cool_surprises(effect, size, low, surprising):
    """Where all commands are well above zero a bias is a dead zone; below, only one is possible."""

    class Bounded(Oven):
        action_channels = (Channel("duty", "1", "input", scale=0.5, low=low, high=1.0),)

    samples = Samples.join([steps(0, [0.8, 0.1, 0.5, 0.2], 0.4)], 4)
    (candidate,) = candidates(Bounded(), [effect], samples)
    model, theta = Model(Bounded(), [candidate]), np.array([size])
    fit = SimpleNamespace(model=model, theta=theta, by_knob=np.ones((1, 5, 1)), weights=np.ones(1))
    assert surprises(fit, samples) == surprising


@pytest.mark.parametrize(("sizes", "pairs"), [
    ((7.0, -6.0), 1), ((7.0, -4.0), 0), ((7.0, 6.0), 0), ((7.0, -6.0, 6.5), 2),
    ((-6.0, 7.0), 1), ((0.0, 0.0), 0), ((5.0,), 0),
])  # fmt: skip
def test_what_undoes_nearly_all_of_another_is_counted(sizes, pairs):
    """Units of the numbers do not matter, and of two numbers of one effect none is counted."""
    rng = np.random.default_rng(0)
    push, other = rng.normal(size=(2, 3, 40))
    units = np.array([10.0 ** (3 * i) for i in range(len(sizes))])
    moved = push[..., None] / units
    owner = np.arange(len(sizes))
    given = {"theta": np.array(sizes) * units, "weights": np.array([1.0, 0.2, 3.0])}
    model = SimpleNamespace(owner=owner, chosen=[None] * len(sizes))
    assert undone(SimpleNamespace(model=model, by_knob=moved, **given)) == pairs
    across = np.stack([push, other], axis=-1)[..., : len(sizes)] / units[:2]
    if len(sizes) == 2:
        assert undone(SimpleNamespace(model=model, by_knob=across, **given)) == 0
    model = SimpleNamespace(owner=0 * owner, chosen=[None])
    assert undone(SimpleNamespace(model=model, by_knob=moved, **given)) == 0


@pytest.mark.parametrize(("effect", "far"), [
    (SensorOffset("rate", 0.3), False), (SensorOffset("rate", -3.0), True),
    (SensorScale("rate", 0.1), True), (SensorScale("angle", -0.1), True),
    (SensorOffset("angle", 3.0), False),  # of an encoder any zero is likely
    (ActuatorGain("voltage", 2.0), False),
])  # fmt: skip
def test_a_sensor_is_seldom_wrong_in_its_scale_or_by_a_fifth_of_what_it_shows(effect, far):
    samples = built(ActuatorGain("voltage"), gain=0.0)[2]
    assert doubtful_sensor(effect, PendulumEquation(), samples) is far
    owner, simulator = np.zeros(1, int), PendulumEquation()
    model = SimpleNamespace(
        simulator=simulator, owner=owner, chosen=[None], added=lambda _: (effect,)
    )
    fit = SimpleNamespace(
        model=model, theta=np.ones(1), by_knob=np.ones((1, 5, 1)), weights=np.ones(1)
    )
    assert unlikely(fit, samples) == far
