"""What goes by the angle, and is no force: a cam's inertia, a crank's, an encoder off its axis."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, INERTIA, DAMPING = 0.01, 0.02, 0.03


class Wheel(EquationOfMotion):
    dt, substeps = DT, 4
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=0.5),)
    parameters = {
        "inertia": Parameter(INERTIA, "kg m^2", "of the wheel"),
        "damping": Parameter(DAMPING, "N m s/rad", "of the bearing", family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        damping, inertia = (np.reshape(one, (-1, 1)) for one in (p.damping, p.inertia))
        return (u + force - damping * v) / inertia


def logs(inertia, read, seconds=4.0, most=0.6):
    """Records of a wheel of some inertia by the angle, read with noise."""
    rng = np.random.default_rng(5)
    found = []
    for run in range(4):
        rows = round(seconds / DT)
        torques = np.repeat(rng.uniform(-most, most, rows // 40 + 1), 40)[:rows]
        torques += 0.25 * rng.choice([-1, 1])
        x, path = np.array([rng.uniform(0, 6), 0.0]), []

        def rates(_, x, torque):
            slope = (inertia(x[0] + 1e-5) - inertia(x[0] - 1e-5)) / 2e-5
            force = torque - DAMPING * x[1] - 0.5 * slope * x[1] ** 2
            return [x[1], force / inertia(x[0])]

        for torque in torques:
            path.append(x)
            x = solve_ivp(rates, (0, DT), x, rtol=1e-8, atol=1e-10, args=(torque,)).y[:, -1]
        seen = read(np.array([*path, x])) + rng.normal(0, [1e-3, 1e-2], (rows + 1, 2))
        found.append(Trajectory(f"run {run}", DT * np.arange(rows + 1), seen, torques[:, None]))
    return found


def confirmed(result):
    return [verdict.label for verdict in result.verdicts if verdict.kind == "confirmed"]


def test_a_cam_has_an_inertia_by_its_angle():
    runs = logs(lambda q: INERTIA * (1 + 0.4 * np.cos(2 * q + 0.5)), lambda x: x)
    result = find_gap(Wheel(), runs)
    assert confirmed(result) == ["crank_inertia@angle"]
    numbers = result.verdicts[0].parameters
    truth = {"cosine_2": 0.4 * INERTIA * np.cos(0.5), "sine_2": -0.4 * INERTIA * np.sin(0.5)}
    for field, number in numbers.items():
        assert number.low <= truth.get(field, 0.0) <= number.high, field


def test_an_encoder_off_its_axis_errs_once_per_turn():
    def read(x):
        angle, speed = x.T
        error, slope = 0.03 * np.sin(angle - 0.7), 0.03 * np.cos(angle - 0.7)
        return np.stack([angle + error, speed * (1 + slope)], axis=1)

    result = find_gap(Wheel(), logs(lambda q: INERTIA, read))
    assert confirmed(result) == ["encoder_error@angle"]
    numbers = result.verdicts[0].parameters
    assert numbers["sine_1"].value == pytest.approx(0.03 * np.cos(0.7), abs=1e-3)
    assert numbers["cosine_1"].value == pytest.approx(-0.03 * np.sin(0.7), abs=1e-3)


@pytest.mark.long
def test_a_shaft_behind_a_universal_joint_has_no_crank():
    def read(x):
        angle, speed = x.T
        bend = np.cos(0.49)
        turned = angle + np.arctan2(
            (1 - bend) * np.sin(2 * angle), 1 + bend + (1 - bend) * np.cos(2 * angle)
        )
        return np.stack(
            [turned, speed * bend / (bend**2 * np.cos(angle) ** 2 + np.sin(angle) ** 2)], axis=1
        )

    assert confirmed(find_gap(Wheel(), logs(lambda q: INERTIA, read))) == ["encoder_error@angle"]


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.02, 0.0295])
def test_a_slide_on_a_short_rod_is_a_crank_with_three_waves(damping):
    """Where its inertia is all that is missing, forecasts of the usual length hide it."""
    slide, radius, rod = 0.8, 0.08, 0.25

    def inertia(q):
        bend = rod * np.sin(q) * np.cos(q) / np.sqrt(1 - (rod * np.sin(q)) ** 2)
        return 0.0105 + slide * radius**2 * (np.sin(q) + bend) ** 2

    wheel = Wheel().with_parameters(inertia=0.01, damping=damping)
    result = find_gap(wheel, logs(inertia, lambda x: x, seconds=8.0))
    assert "crank_inertia@angle" in confirmed(result)
    (crank,) = [v for v in result.verdicts if v.label == "crank_inertia@angle"]
    mean = 0.5 * slide * radius**2
    assert crank.parameters["cosine_2"].value == pytest.approx(-mean, rel=0.05)
    assert crank.parameters["cosine_1"].value == pytest.approx(rod * mean, rel=0.1)
