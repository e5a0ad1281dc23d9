"""The truth of studies.robots is one: its integrator leaves no gap that could get a name."""

import numpy as np
import pytest

from studies.robot_gaps import main
from studies.robots.cases import Case, nominal, strengths
from studies.robots.drives import MODELS
from studies.robots.truth import Sensors, Truth


@pytest.mark.parametrize("robot", ["arm2", "arm6"])
def test_what_is_left_of_it_in_a_forecast_is_far_below_the_noise(robot):
    simulator = nominal(robot)
    truth = Truth(MODELS / f"{robot}.xml", {})
    high = truth.model.actuator_ctrlrange[:, 1]

    def drive(t, q, v):
        return 0.1 * high * np.sin(9 * t + np.arange(len(high)))

    rng = np.random.default_rng(0)
    run = truth.run(drive, 1.0, Sensors(noise=0.0, rates=True), rng)
    starts = run.states[:-31:10]
    windows = np.stack([run.actions[a : a + 30] for a in range(0, 10 * len(starts), 10)])
    ends = simulator.rollout(simulator.augment(starts, windows[:, 0]), windows)[:, -1]
    wrong = (ends - run.states[30 : 30 + 10 * len(starts) : 10])[:, : truth.model.nq]
    # What is left is the nominal: stiff servos at 5 ms.
    assert np.sqrt(np.mean(np.square(wrong))) < 0.05 * Sensors().noise


def test_no_link_is_hidden_away():
    (size,) = strengths(Case("arm2", ("mass of body fore",), 3)).values()
    assert abs(size) < 0.3 * nominal("arm2").parameters["mass of body fore"].value


@pytest.mark.parametrize("robot", ["cart_pole", "arm2", "arm6", "hopper"])
def test_all_that_may_be_missing_can_be_hidden(robot):
    plain = Truth(MODELS / f"{robot}.xml", {})
    for effect in nominal(robot).offered_effects():
        hidden = Truth(MODELS / f"{robot}.xml", {str(effect): 0.1})
        assert differs(plain, hidden), effect


def differs(one, other):
    """Whether two truths are not the same."""
    own = [one.loads, one.delay, one.lag, one.bias, one.zone, one.level, one.offset]
    its = [other.loads, other.delay, other.lag, other.bias, other.zone, other.level, other.offset]
    names = [
        "body_mass", "body_ipos", "dof_damping", "dof_dampingpoly", "dof_frictionloss",
        "dof_armature", "jnt_stiffness", "actuator_gainprm", "actuator_biasprm", "geom_friction",
    ]  # fmt: skip
    own += [getattr(one.model, name) for name in names] + [one.model.opt.gravity]
    its += [getattr(other.model, name) for name in names] + [other.model.opt.gravity]
    return not all(np.array_equal(a, b) for a, b in zip(own, its, strict=True))


def test_an_effect_that_a_robot_lacks_is_told_with_the_nearest(capsys, tmp_path):
    with pytest.raises(SystemExit) as ended:
        main(["--robot", "arm2", "--hidden", "damping of elbow", "--output", str(tmp_path / "r")])
    assert ended.value.code == 2
    assert "arm2 has no such effect; nearest: damping of joint elbow" in capsys.readouterr().err
    assert not (tmp_path / "r").exists()
