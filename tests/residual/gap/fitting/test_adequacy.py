"""What a remainder is said to look like is something that the log can show."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.fitting.adequacy import generic_forces
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel


@pytest.mark.parametrize("reach", [0.3, 3.0])
def test_waves_that_an_angle_does_not_run_through_have_no_name(reach):
    times = 0.05 * np.arange(200)
    states = np.stack([reach * np.sin(times), reach * np.cos(times)], axis=1)
    volts = np.sign(np.sin(3 * times[:-1]))[:, None]
    samples = Samples.join([Trajectory("run", times, states, volts)], 1)
    forces, names = generic_forces(PendulumEquation(), samples, states, np.ones(2))
    assert forces.shape == (len(samples), len(names))
    assert ("cos(5 angle)" in names) is (2 * 5 * reach > np.pi)
    assert ("cos(1 angle)" in names) is (2 * reach > np.pi)
    assert {"angle", "rate", "voltage"} <= set(names)


def test_the_sign_of_an_input_that_never_changes_it_has_no_name():
    """And all else is offered as for one that does."""
    times = 0.05 * np.arange(200)
    states = np.stack([np.sin(times), np.cos(times)], axis=1)
    offered = {}
    for low in (0.0, -1.5):
        volts = (low + 1 + np.sin(3 * times[:-1]))[:, None]
        samples = Samples.join([Trajectory("run", times, states, volts)], 1)
        forces, offered[low] = generic_forces(PendulumEquation(), samples, states, np.ones(2))
        assert forces.shape == (len(samples), len(offered[low]))
    assert [name if name != "sign of voltage" else "" for name in offered[-1.5]] == offered[0.0]
    assert "sign of voltage" in offered[-1.5]


class Head(FirstOrderSystem):
    """The rates of a camera's two axes, which do not move each other, or so one thinks."""

    dt = 0.02
    state_channels = tuple(Channel(name, "rad/s", "rate", scale=2.0) for name in ("pan", "tilt"))
    action_channels = tuple(Channel(f"to {name}", "N m", "input") for name in ("pan", "tilt"))
    spin = 0.0

    def derivative(self, x, u, p):
        return 8.0 * u - x + self.spin * x[:, ::-1] * np.array([1.0, -1.0])


@pytest.mark.long
def test_a_wheel_that_spins_inside_is_hinted_at_however_far_beyond_noise_it_is():
    true, rng = Head(), np.random.default_rng(0)
    true.spin = 5.0
    torque = np.repeat(rng.uniform(-1, 1, (1, 30, 2)), 10, axis=1)
    path = true.rollout(np.zeros((1, 2)), torque)[0] + rng.normal(0, 1e-4, (301, 2))
    runs = [Trajectory("run", 0.02 * np.arange(301), path, torque[0])]
    result = find_gap(Head(), runs, effects=["delay@to pan", "coulomb_friction@pan"])
    (left,) = (v for v in result.verdicts if v.kind == "unexplained")
    assert left.follows in ("tilt, acting on pan", "pan, acting on tilt")
