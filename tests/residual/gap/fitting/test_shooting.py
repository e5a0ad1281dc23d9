"""The right model leaves the noise and nothing else; a fit finds the number that was hidden."""

import functools

import numpy as np
import pytest

from residual.gap.data.carrying import carry
from residual.gap.data.windows import cut, fixed
from residual.gap.fitting.shooting import fit
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import smooth_fitter
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

NOISE = {"A": [0.01, 0.2], "B": [0.002 / np.sqrt(12)], "C": [0.01]}


@functools.cache
def surveyed(truth, excitation, kind, runs=5, seed=3):
    logs = make_logs(truth, seed, excitation, kind, runs)
    fitter, floor = smooth_fitter(PendulumEquation(), logs, 0.5)
    return fitter, floor


def windows_of(fitter, floor, seconds=1.25):
    return cut(fitter.samples, floor.slope.by_state, fitter.scale, seconds)


@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
@pytest.mark.parametrize("kind", ["A", pytest.param("B", marks=pytest.mark.long), "C"])
def test_true_model_leaves_the_noise(excitation, kind):
    fitter, floor = surveyed(Truth(), excitation, kind)
    windows, samples = windows_of(fitter, floor), fitter.samples
    model, sigma = Model(PendulumEquation()), np.array(NOISE[kind])
    found = fit(model, samples, windows, floor.nodes, np.zeros(0), sigma, fitter.scale)
    size = np.isfinite(samples.seen[windows.index[windows.inside]]).sum() - 2 * len(windows)
    assert np.sqrt(found.costs.sum() / size) == pytest.approx(1.0, abs=0.05)
    assert found.costs.max() < 8 * np.median(found.costs)


@pytest.mark.parametrize("kind", ["A", pytest.param("B", marks=pytest.mark.long)])
def test_noise_is_found_although_the_model_is_wrong(kind):
    _, floor = surveyed(Truth(mass=0.03), "strong", kind)
    assert np.all(np.abs(floor.sigma / NOISE[kind] - 1) < 0.25)


@pytest.mark.parametrize("kind", ["A", pytest.param("B", marks=pytest.mark.long)])
def test_noise_does_not_depend_on_how_many_windows_are_fitted_at_once(kind, monkeypatch):
    truth = Truth(mass=0.03)
    _, whole = surveyed(truth, "strong", kind, runs=2)
    monkeypatch.setattr("residual.gap.fitting.noise.AT_ONCE", 7)
    _, parts = surveyed.__wrapped__(truth, "strong", kind, runs=2)
    for name in ("sigma", "error", "nodes", "force"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name))


@pytest.mark.parametrize("first", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(
    ("label", "truth", "value"),
    [
        ("dead_zone@voltage", Truth(dead_zone=0.05), 0.05),
        pytest.param(
            "actuator_lag@voltage", Truth(actuator_lag=0.007), 0.007, marks=pytest.mark.long
        ),
        ("inertia", Truth(inertia=0.03), 0.03 * 1.91e-4),
    ],
)
def test_fit_does_not_depend_on_its_start(label, truth, value, first):
    fitter, floor = surveyed(truth, "strong", "A")
    simulator = PendulumEquation()
    pool = {c.label: c for c in candidates(simulator, library(simulator), fitter.samples)}
    found = fit(
        Model(simulator, [pool[label]]), fitter.samples, windows_of(fitter, floor), floor.nodes,
        np.array([first * value]), floor.sigma, fitter.scale, 10,
    )  # fmt: skip
    assert found.theta[0] == pytest.approx(value, rel=0.05)


def test_linear_response_is_that_of_the_simulator():
    fitter, floor = surveyed(Truth(), "weak", "A", runs=1)
    model, samples = Model(PendulumEquation()), fitter.samples
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
        fitter, floor = surveyed(Truth(), excitation, "A")
        windows = windows_of(fitter, floor)
        rows = windows.index[windows.inside]
        assert len(np.unique(rows)) == len(rows)
        assert len(rows) > 0.97 * len(fitter.samples)
        lengths[excitation] = windows.inside.sum(axis=1).mean()
    assert lengths["policy"] < 0.6 * lengths["weak"]
