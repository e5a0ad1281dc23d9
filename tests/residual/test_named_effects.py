"""Effects found in exact rows: named, measured, predicted, saved."""

import numpy as np
import pytest

from residual import CorrectedSimulator, DifferenceModel, NamedEffects, load, save
from residual.gap import rows as rows_of_effects
from residual.gap.rows import SHORTEST
from residual.trajectories import Transitions
from sims import Channel, EquationOfMotion, Parameter
from sims.effects import CoulombFriction, Delay
from sims.leo import Leo, Walking
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation


def rows(true, count=40, seed=0, noise=0.0):
    """Consecutive transitions from rest under random levels of voltage."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-3, 3, (count // 4 + 1, 1)), 4, axis=0)[:count]
    path = true.augment(np.array([[np.pi, 0.0]]))[0]
    path = true.rollout(path, volts)[:, :2]
    path = path + noise * rng.standard_normal(path.shape) * [1, 20]
    return Transitions(path[:-1], volts, path[1:], np.zeros(count, int))


@pytest.fixture(scope="module")
def model():
    return DifferenceModel(NamedEffects(), Pendulum()).fit(rows(Pendulum.true()))


@pytest.fixture(scope="module")
def probe():
    rng = np.random.default_rng(9)
    return rng.uniform([-4, -12], [4, 12], (20, 2)), rng.uniform(-3, 3, (20, 1))


def test_forty_exact_rows_name_the_mass_and_predict_everywhere(model, probe):
    estimator = model.fitted()
    (effect,) = estimator.effects_
    assert effect.name == "mass"
    assert effect.change == pytest.approx(0.035, abs=1e-5)
    assert "mass" in estimator.says_
    wanted = Pendulum.true().step(*probe) - Pendulum().step(*probe)
    np.testing.assert_allclose(model.predict(*probe), wanted, atol=1e-4)


@pytest.mark.parametrize(
    "seed", [pytest.param(0, marks=pytest.mark.long), 1, pytest.param(2, marks=pytest.mark.long)]
)
def test_half_a_second_of_exact_rows_is_enough_for_the_mass(seed):
    model = DifferenceModel(NamedEffects(), Pendulum()).fit(rows(Pendulum.true(), 10, seed))
    (effect,) = model.fitted().effects_
    assert effect.name == "mass"
    assert effect.change == pytest.approx(0.035, rel=0.02)


def test_corrected_it_steps_once_as_simulator_and_difference_do(model, probe):
    direct = CorrectedSimulator(model.simulator, model)
    added = CorrectedSimulator(Pendulum(), model)
    np.testing.assert_allclose(direct.step(*probe), added.step(*probe), atol=1e-12)
    stepped = model.fitted().corrected().step(*probe)
    np.testing.assert_array_equal(
        direct.step(*probe), np.clip(stepped, [-np.inf, -160], [np.inf, 160])
    )


def test_spread_is_small_where_the_name_is_certain(model, probe):
    mean, std = model.predict(*probe, return_std=True)
    assert (std > 0).all()
    assert (std < 0.01 * np.abs(mean).max(axis=0)).all()


def test_a_row_has_the_same_bits_alone_and_in_a_batch(model, probe):
    states, actions = probe
    batch = model.predict(states, actions, return_std=True)
    alone = [model.predict(states[i : i + 1], actions[i : i + 1], return_std=True) for i in (0, 7)]
    for which in (0, 1):
        assert np.array_equal(batch[which][[0, 7]], np.vstack([one[which] for one in alone]))


def test_saved_and_loaded_without_code(model, probe, tmp_path):
    save(model, tmp_path / "model.safetensors")
    with pytest.raises(ValueError, match=r"load\(path, simulator\)"):
        load(tmp_path / "model.safetensors")
    back = load(tmp_path / "model.safetensors", Pendulum())
    assert back.fitted().effects_ == model.fitted().effects_
    assert back.fitted().says_ == model.fitted().says_
    for ours, theirs in zip(
        back.predict(*probe, return_std=True), model.predict(*probe, return_std=True), strict=True
    ):
        assert np.array_equal(ours, theirs)
    with pytest.raises(ValueError, match="damaged"):
        load(tmp_path / "model.safetensors", PendulumWithoutMass())


class PendulumWithoutMass(Pendulum):
    """The same channels, but no parameter to change."""

    def __init__(self):
        super().__init__()
        self.parameters = {}


@pytest.mark.long
def test_two_effects_from_a_few_dozen_rows():
    true = PendulumEquation.true().with_effects([CoulombFriction("pivot", 1e-3)])
    model = DifferenceModel(NamedEffects(), PendulumEquation())
    found = model.fit(rows(true, 36, seed=7)).fitted()
    assert {e.name for e in found.effects_} == {"mass", "coulomb_friction"}


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.long), 0.01])
def test_nothing_is_predicted_where_nothing_is_missing(noise, probe):
    simulator = PendulumEquation()
    model = DifferenceModel(NamedEffects(), simulator).fit(rows(simulator, 200, 3, noise))
    mean, std = model.predict(*probe, return_std=True)
    assert model.fitted().effects_ == ()
    assert "no effect found" in model.fitted().says_
    assert (mean == 0).all()
    # One row differs by the noise of its own state and of the next.
    wanted = np.sqrt(2) * noise * np.array([1, 20])
    assert np.all(np.abs(std - wanted) < 0.8 * wanted + 1e-12)


@pytest.mark.long
def test_noisy_rows_still_tell_the_mass():
    model = DifferenceModel(NamedEffects(), PendulumEquation())
    found = model.fit(rows(PendulumEquation.true(), 80, 4, 0.01)).fitted()
    (effect,) = found.effects_
    half = 1.96 * np.sqrt(found.covariance_[0, 0])
    assert effect.name == "mass"
    assert abs(effect.change - 0.035) < 2 * half < 0.01


def test_what_a_difference_cannot_hold_stays_unexplained():
    simulator = PendulumEquation()
    late = simulator.with_effects([Delay("voltage", 0.02)])
    found = DifferenceModel(NamedEffects(), simulator).fit(rows(late, 100, 5)).fitted()
    assert "unexplained" in found.says_ or not found.effects_
    assert (found.residual_ > 0).all()


@pytest.mark.long
def test_a_search_ends_after_as_many_sets_as_may_be(monkeypatch):
    """By their number: a limit of time would give other machines other answers."""
    counts = []
    explained = rows_of_effects.explain

    def counted(*given):
        found = explained(*given)
        counts.append(len(found.search.tried))
        return found

    monkeypatch.setattr(rows_of_effects, "explain", counted)
    true = Pendulum.true().with_effects([CoulombFriction("pivot", 5e-4)])
    for most in (4, 12):
        monkeypatch.setattr(rows_of_effects, "SETS", most)
        DifferenceModel(NamedEffects(), Pendulum()).fit(rows(true))
    assert counts[0] < counts[1]


def test_shuffled_rows_get_one_clear_error():
    data = rows(PendulumEquation.true())
    order = np.random.default_rng(0).permutation(len(data))
    mixed = Transitions(
        data.states[order], data.actions[order], data.next_states[order], data.episodes
    )
    with pytest.raises(ValueError, match=f"at least {SHORTEST} rows that follow each other"):
        DifferenceModel(NamedEffects(), PendulumEquation()).fit(mixed)


def test_it_says_so_without_a_simulator():
    with pytest.raises(ValueError, match="has no simulator"):
        NamedEffects().fit(np.zeros((20, 3)), np.zeros((20, 2)))


@pytest.mark.long
def test_a_heavier_torso_and_friction_are_found_in_rows_of_a_struggling_leo():
    rng = np.random.default_rng(0)
    true, task = Leo.true(), Walking(start_at="around")
    count, steps = 12, 26
    path = np.array([task.start(rng) for _ in range(count)])
    noise, parts = np.zeros((count, 6)), []
    for _ in range(steps):
        noise += -0.15 * noise + 0.2 * rng.standard_normal(noise.shape)
        volts = 8.6 * np.clip(noise, -1, 1)
        following = true.step(path, volts)
        parts.append((path, volts, following))
        path = following
    # Row by row in time, one struggle after the other.
    columns = (
        np.stack(part, axis=1).reshape(count * steps, -1) for part in zip(*parts, strict=True)
    )
    data = Transitions(*columns, np.repeat(np.arange(count), steps))
    model = DifferenceModel(NamedEffects(), Leo()).fit(data)
    found = {effect.parameter: effect.change for effect in model.fitted().effects_}
    assert found == pytest.approx({"torso_mass": 1.25 - 0.94226, "friction": 0.03}, rel=2e-3)


class Wheel(EquationOfMotion):
    """A wheel that turns by more than half a turn from row to row."""

    dt = 0.1
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=50.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=1.0, low=-1.0, high=1.0),)
    parameters = {
        "inertia": Parameter(0.01, "kg m2", "of the wheel", low=1e-4),
        "damping": Parameter(0.02, "N m s/rad", "of its bearing", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((force[:, 0] + u[:, 0] - p.damping * v[:, 0]) / p.inertia)[:, None]


@pytest.mark.long
def test_what_a_simulator_has_too_much_of_is_found_while_angles_turn_fast():
    true = Wheel().with_parameters(damping=0.005)
    rng = np.random.default_rng(0)
    torques = np.repeat(rng.uniform(-1, 1, (15, 1)), 8, axis=0)
    path = true.rollout(np.zeros(2), torques)
    assert np.abs(path[:, 1]).max() * true.dt > np.pi
    rows = Transitions(path[:-1], torques, path[1:], np.zeros(len(torques), int))
    (effect,) = DifferenceModel(NamedEffects(), Wheel()).fit(rows).fitted().effects_
    assert (effect.name, effect.change) == ("damping", pytest.approx(-0.015, rel=1e-4))


def test_what_explains_rows_as_well_is_told(model):
    assert "these rows have it as well from length, or gravity" in model.fitted().says_
