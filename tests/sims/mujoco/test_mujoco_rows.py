"""Rows are pure: the same bits alone, in any batch, whatever was stepped before."""

import pickle

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sims.checks import check_simulator
from sims.effects import (
    AsymmetricDamping,
    Cogging,
    ConstantLoad,
    CoulombFriction,
    CubicSpring,
    DirectionalFriction,
    LinearSpring,
    QuadraticDrag,
    StribeckFriction,
    ViscousFriction,
)
from sims.mujoco import AttributeChange
from tests.sims.mujoco.robots import MODELS, NAMES, robot, rows

ROBOTS = {name: robot(name) for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_it_keeps_the_contract_of_a_simulator(name):
    findings = check_simulator(ROBOTS[name])
    # A servo at the limit of its force does not feel its gain in some random rows.
    wrong = [f for f in findings if not f.ok and not ("gain of" in f.check and name == "arm6")]
    assert not wrong, "\n".join(map(str, wrong))


@pytest.mark.parametrize("name", NAMES)
def test_a_step_is_mujocos_own(name):
    simulator = ROBOTS[name]
    states, actions = rows(simulator, 4)
    following = simulator.step(states, actions)
    model = mujoco.MjModel.from_xml_path(str(MODELS / f"{name}.xml"))
    for state, action, after in zip(states, actions, following, strict=True):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = state[: model.nq], state[model.nq :]
        data.ctrl[:] = action
        mujoco.mj_step(model, data, simulator.substeps)
        assert np.allclose(after, np.concatenate([data.qpos, data.qvel]), rtol=1e-9, atol=1e-10)


@settings(max_examples=15)
@given(st.sampled_from(NAMES), st.data())
def test_rows_with_their_own_attributes_do_not_see_each_other(name, data):
    simulator = ROBOTS[name]
    names = sorted(simulator.parameters)
    chosen = data.draw(st.lists(st.sampled_from(names), min_size=1, max_size=5, unique=True))
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    n = data.draw(st.integers(2, 40))
    states, actions = rows(simulator, n, seed=int(rng.integers(1000)))
    changes = {
        key: simulator.parameters[key].scale * rng.choice([0.0, 0.05, 0.2], n) for key in chosen
    }
    together = simulator.with_effects(
        [AttributeChange(key, change) for key, change in changes.items()]
    )
    after = together.step(states, actions)
    simulator.step(states[::-1], actions[::-1])
    for i in rng.permutation(n)[:6]:
        alone = together.take(np.s_[i : i + 1])
        assert np.array_equal(alone.step(states[i : i + 1], actions[i : i + 1])[0], after[i])
        if not any(change[i] for change in changes.values()):
            plain = simulator.step(states[i : i + 1], actions[i : i + 1])
            assert np.array_equal(plain[0], after[i])
    order = rng.permutation(n)
    assert np.array_equal(together.take(order).step(states[order], actions[order]), after[order])


@pytest.mark.parametrize("name", NAMES)
def test_every_attribute_at_its_nominal_value_changes_no_bit(name):
    simulator = ROBOTS[name]
    states, actions = rows(simulator)
    plain = simulator.step(states, actions)
    values = {key: np.full(len(states), p.value) for key, p in simulator.parameters.items()}
    assert np.array_equal(simulator.with_parameters(**values).step(states, actions), plain)
    # A heavier neighbour brings MuJoCo to derive its constants anew in every row.
    for key, known in simulator.parameters.items():
        mixed = np.full(len(states), float(known.value))
        mixed[::2] += 0.1 * known.scale
        after = simulator.with_parameters(**{key: mixed}).step(states, actions)
        assert np.array_equal(after[1::2], plain[1::2]), key


def test_effects_on_joints_at_zero_strength_change_no_bit_beside_rows_that_have_them():
    simulator = ROBOTS["arm2"]
    states, actions = rows(simulator)
    plain = simulator.step(states, actions)
    for kind in (
        ViscousFriction, QuadraticDrag, CoulombFriction, StribeckFriction, DirectionalFriction,
        LinearSpring, CubicSpring, ConstantLoad, Cogging, AsymmetricDamping,
    ):  # fmt: skip
        strengths = {key: np.zeros(len(states)) for key in kind.strengths()}
        for values in strengths.values():
            values[::2] = 0.3
        after = simulator.with_effects([kind("elbow", **strengths)]).step(states, actions)
        assert np.array_equal(after[1::2], plain[1::2]), kind.__name__
        assert not np.array_equal(after[::2], plain[::2]), kind.__name__


def test_more_rows_than_a_batch_holds_and_another_process_give_the_same_bits():
    simulator = ROBOTS["arm2"]
    states, actions = rows(simulator, 8)
    many = simulator.step(np.tile(states, (600, 1)), np.tile(actions, (600, 1)))
    copy = pickle.loads(pickle.dumps(simulator))
    assert np.array_equal(many[-8:], copy.step(states, actions))


def test_a_row_that_diverges_is_not_a_number_and_its_neighbours_are_unharmed(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    simulator = ROBOTS["arm2"]
    states, actions = rows(simulator)
    plain = simulator.step(states, actions)
    states[3, 2], states[5, 0] = 1e14, np.nan
    after = simulator.step(states, actions)
    assert np.isnan(after[[3, 5]]).all()
    others = np.setdiff1d(np.arange(len(states)), [3, 5])
    assert np.array_equal(after[others], plain[others])
    # MuJoCo would print a warning for each, and write a file.
    assert not list(tmp_path.iterdir())
    assert not capfd.readouterr().err


def test_durations_that_differ_by_row_and_rounded_ones_are_told_apart():
    simulator = ROBOTS["arm2"]
    states, actions = rows(simulator, 3)
    inputs = np.repeat(actions[:, None], simulator.substeps, axis=1)
    times = np.array([0.01, 0.01 * (1 + 1e-9), 0.012])
    after = simulator.integrate(states, inputs, times)
    usual = simulator.step(states, actions)
    assert np.array_equal(after[:2], usual[:2])
    slower = robot("arm2", timestep=0.006, dt=0.012)
    assert np.allclose(after[2], slower.step(states[2:], actions[2:])[0], rtol=0, atol=1e-13)
