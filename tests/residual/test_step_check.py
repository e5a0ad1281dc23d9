"""An integrator that shows in a log is told from one that does not."""

import pytest

from residual.step_check import check_step, fine_enough
from sims.mujoco import MujocoSimulator
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs
from studies.robots.drives import MODELS, measure


@pytest.fixture(scope="module")
def log():
    return measure("cart_pole", {}, seconds=4.0)


def test_a_first_order_integrator_shows_and_rk4_is_offered(log):
    nominal = MujocoSimulator(str(MODELS / "cart_pole.xml"))
    check = check_step(nominal, log)
    assert check.visible
    assert "shows in this log" in check.says
    assert all(0.3e-3 < noise < 0.8e-3 for noise in check.noise.values())
    option, finer = fine_enough(nominal, log)
    assert option == "--simulator.integrator RK4"
    assert not check_step(finer, log).visible
    assert max(check_step(finer, log).error.values()) < 1e-5


def test_an_equation_of_motion_is_fine_enough():
    logs = make_logs(Truth(), seed=0, runs=2, steps=100)
    assert not check_step(PendulumEquation(), logs).visible
