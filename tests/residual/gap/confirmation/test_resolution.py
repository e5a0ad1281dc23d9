"""Times too short for a log's own clock are not certain, nor zeros below a sensor's steps."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.confirmation.resolution import below_a_step, untimed
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.gap.result import Number
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag, Delay, SensorOffset, ViscousFriction
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize(
    ("effect", "hold", "samples", "changes", "found"),
    [
        (Delay, "zero", 0.4, True, True), (Delay, "zero", 0.6, True, False),
        (ActuatorLag, "linear", 0.6, True, True), (Delay, "linear", 0.9, True, False),
        (Delay, "zero", 5.0, False, True), (ActuatorLag, "zero", 5.0, False, False),
    ],
)  # fmt: skip
def test_a_time_is_told_by_what_the_log_resolves(effect, hold, samples, changes, found):
    """A line half a sample late may be a step, and what never changes may have come on later."""
    simulator = PendulumEquation().with_hold({"voltage": hold})
    inputs = np.ones((49, 1))
    inputs[20:] += changes
    run = Trajectory("run", 0.05 * np.arange(50), np.zeros((50, 2)), inputs)
    table = Samples.join([run], 4)
    tried = candidates(simulator, [effect("voltage")], table)
    search = SimpleNamespace(
        candidates=tried, fitter=SimpleNamespace(samples=table), simulator=simulator
    )
    assert untimed(search, 0, np.array([samples * 0.05])) is found


@pytest.mark.parametrize(("noise", "sure"), [(2e-4, True), (0.6, False)])
def test_an_interval_that_reaches_below_half_a_sample_is_not_certain(noise, sure):
    """A delay of 0.6 samples, as clear as the noise lets it be."""
    rng = np.random.default_rng(0)
    simulator = PendulumEquation(dt=0.02)
    volts = np.repeat(rng.uniform(-2.0, 2.0, (1, 80, 1)), 5, axis=1)
    states = simulator.with_effects([Delay("voltage", 0.012)]).rollout(
        np.array([[np.pi, 0.0, 0.0]]), volts
    )[0, :, :2]
    states += noise * rng.standard_normal(states.shape)
    run = Trajectory("run", 0.02 * np.arange(len(states)), states, volts[0])
    result = find_gap(simulator, run, effects=["delay"], parameter_tolerance=0.01)
    (verdict,) = [v for v in result.verdicts if v.effect == "delay"]
    (number,) = verdict.parameters.values()
    assert (number.low > 0.01) is sure
    assert ("clock" in verdict.doubts) is not sure


@pytest.mark.parametrize(
    ("effect", "low", "step", "found"),
    [
        (SensorOffset("angle", 0.02), 0.003, 0.004, True),
        (SensorOffset("angle", 0.02), 0.005, 0.004, False),
        (SensorOffset("angle", 0.02), 0.003, 0.0, False),
        (ViscousFriction("pivot", 0.02), 0.003, 0.004, False),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_zero_is_told_by_the_steps_of_its_sensor(effect, low, step, found, sign):
    simulator, times = PendulumEquation(), 0.05 * np.arange(200)
    angle = 0.03 * np.sin(1.7 * times) + 0.02 * np.sin(0.4 * times)
    read = np.round(angle / step) * step if step else angle
    run = Trajectory("run", times, np.stack([read, 0 * read], axis=1), np.ones((199, 1)))
    table = Samples.join([run], 4)
    search = SimpleNamespace(
        candidates=candidates(simulator, [effect], table),
        fitter=SimpleNamespace(samples=table), simulator=simulator,
    )  # fmt: skip
    ends = sorted((sign * low, sign * 0.04))
    numbers = {"offset": Number(sign * 0.02, *ends, "rad")}
    assert below_a_step(search, 0, numbers) is found
