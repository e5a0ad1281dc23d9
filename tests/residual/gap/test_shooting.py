"""The right model leaves the noise and nothing else; a fit finds the number that was hidden."""

import numpy as np
import pytest

from residual.gap import noise
from residual.gap.candidates import candidates
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.shooting import fit
from residual.gap.windows import by_growth, carry, fixed
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

NOISE = {"A": [0.01, 0.2], "B": [0.002 / np.sqrt(12)], "C": [0.01]}


def surveyed(truth, excitation, kind, runs=5, seed=3):
    simulator = PendulumEquation()
    samples = Samples.join(make_logs(truth, seed, excitation, kind, runs), simulator.substeps)
    model = Model(simulator)
    path = noise.first_path(model, samples, np.zeros(0))
    scale = noise.variation(samples, path)
    first = noise.local_noise(samples)
    return samples, model, scale, noise.estimate(model, samples, path, np.zeros(0), first, scale)


@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
@pytest.mark.parametrize("kind", ["A", "B", "C"])
def test_true_model_leaves_the_noise(excitation, kind):
    samples, model, scale, floor = surveyed(Truth(), excitation, kind)
    windows = by_growth(samples, floor.slope.by_state, scale, 25)
    sigma = np.array(NOISE[kind])
    found = fit(model, samples, windows, floor.nodes, np.zeros(0), sigma, scale)
    size = np.isfinite(samples.seen[windows.index[windows.inside]]).sum() - 2 * len(windows)
    assert np.sqrt(found.costs.sum() / size) == pytest.approx(1.0, abs=0.05)
    assert found.costs.max() < 8 * np.median(found.costs)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_noise_is_found_although_the_model_is_wrong(kind):
    _, _, _, floor = surveyed(Truth(mass=0.03), "strong", kind)
    assert np.all(np.abs(floor.sigma / NOISE[kind] - 1) < 0.25)


@pytest.mark.parametrize("first", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(
    ("label", "truth", "value"),
    [
        ("dead_zone@voltage", Truth(dead_zone=0.05), 0.05),
        ("actuator_lag@voltage", Truth(actuator_lag=0.007), 0.007),
        ("inertia", Truth(inertia=0.03), 0.03 * 1.91e-4),
    ],
)
def test_fit_does_not_depend_on_its_start(label, truth, value, first):
    samples, _, scale, floor = surveyed(truth, "strong", "A")
    simulator = PendulumEquation()
    pool = {c.label: c for c in candidates(simulator, library(simulator), samples)}
    windows = by_growth(samples, floor.slope.by_state, scale, 25)
    model = Model(simulator, [pool[label]])
    start = np.array([first * value])
    found = fit(model, samples, windows, floor.nodes, start, floor.sigma, scale, 10)
    assert found.theta[0] == pytest.approx(value, rel=0.05)


def test_linear_response_is_that_of_the_simulator():
    samples, model, _, floor = surveyed(Truth(), "weak", "A", runs=1)
    windows = fixed(samples, 10)
    start = np.eye(2)
    response = carry(windows, floor.slope.by_state, start, np.zeros((len(samples), 2, 0)))
    rows = windows.index[:, 0]
    states = floor.nodes[rows]
    moved = states + 1e-5 * np.array([1.0, 0.0])
    theta = np.zeros(0)
    # Nodes do not quite follow each other, hence the tolerance.
    change = model.roll(samples, rows, moved, 5, theta) - model.roll(
        samples, rows, states, 5, theta
    )
    np.testing.assert_allclose(response[:, 5, :, 0], change[:, 5] / 1e-5, rtol=0.1, atol=0.1)


def test_windows_are_disjoint_and_short_where_motion_is_unstable():
    lengths = {}
    for excitation in ("weak", "policy"):
        samples, _, scale, floor = surveyed(Truth(), excitation, "A")
        windows = by_growth(samples, floor.slope.by_state, scale, 25)
        rows = windows.index[windows.inside]
        assert len(np.unique(rows)) == len(rows)
        assert len(rows) > 0.97 * len(samples)
        lengths[excitation] = windows.inside.sum(axis=1).mean()
    assert lengths["policy"] < 0.6 * lengths["weak"]
