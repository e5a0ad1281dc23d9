"""Inputs of recorded intervals put together: what a row's motion feels of them stays the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data.merging import EVEN, Merging
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter


def integrals(driven, durations, edges):
    """Integral and first moment of a row's input between times, by many small steps."""
    ends = np.cumsum(durations)
    fine = np.linspace(0.0, ends[-1], 200_001)
    at = 0.5 * (fine[1:] + fine[:-1])
    step = np.minimum(np.searchsorted(ends, at), len(ends) - 1)
    middle = ends - 0.5 * durations
    values = driven[step, 0] + driven[step, 1] * (at - middle[step]) / durations[step]
    place = np.minimum(np.searchsorted(edges, at, "right") - 1, len(edges) - 2)
    small = np.diff(fine)
    count = len(edges) - 1
    area = np.bincount(place, values * small, count)
    return area, np.bincount(place, values * at * small, count)


@given(st.integers(0, 10_000), st.sampled_from([1, 2, 4]), st.floats(0.0, 3.0))
@settings(max_examples=40)
def test_integral_and_first_moment_stay(seed, count, unlike):
    rng = np.random.default_rng(seed)
    driven, durations = rng.standard_normal((8, 2)), np.exp(unlike * rng.standard_normal(8))
    if np.ptp(durations) < EVEN * durations.mean():
        durations = np.ones(8)
    merging = Merging.of(np.arange(8)[None], durations[None], 1, count)
    found, last = merging.rows(driven[None, :, None, None])[0, :, :, 0]
    edges = durations.sum() * np.arange(count + 1) / count
    area, moment = integrals(driven, durations, edges)
    width = edges[1]
    np.testing.assert_allclose(found[:, 0] * width, area, atol=2e-4 * durations.sum())
    middle = 0.5 * (edges[1:] + edges[:-1])
    slant = found[:, 1] * width**2 / 12
    wanted = moment - middle * area
    np.testing.assert_allclose(slant, wanted, atol=2e-4 * durations.sum() ** 2)
    # Whatever comes after the record is as it ended, in sub-steps that are as many times shorter.
    np.testing.assert_allclose(last, np.tile(driven[-1] / [1, 8 // count], (count, 1)))


class Body(FirstOrderSystem):
    """A drug that is given now and then, and leaves."""

    dt = 1.0
    state_channels = (Channel("amount", "mg", "other", scale=10.0),)
    action_channels = (Channel("dose", "mg/s", "input", scale=10.0),)
    parameters = {"leaving": Parameter(0.01, "1/s", "share that leaves", low=0.001)}

    def derivative(self, x, u, p):
        return (u[:, 0] - p.leaving * x[:, 0])[:, None]


def test_short_doses_amid_long_waits_are_no_gap():
    rng, logs = np.random.default_rng(1), []
    for number in range(12):
        durations = np.tile([0.25, 1.75, 3.0, 3.0], 60)
        doses = np.where(np.arange(240) % 4 == 0, rng.uniform(10, 80, 240), 0.0)
        state = [0.0]
        for dose, duration in zip(doses, durations, strict=True):
            level = dose / 0.01
            state.append(level + (state[-1] - level) * np.exp(-0.01 * duration))
        seen = np.array(state)[:, None] + 0.1 * rng.standard_normal((241, 1))
        times = np.concatenate([[0.0], np.cumsum(durations)])
        logs.append(Trajectory(f"{number}", times, seen, doses[:, None]))
    found = find_gap(
        Body(), logs, horizon=200.0, hold="zero", effects=["sensor_scale", "dead_zone", "delay"]
    )
    assert [v.kind for v in found.verdicts if v.kind in ("confirmed", "ambiguous")] == []
    assert found.gap.before.value == pytest.approx(found.gap.noise_floor.value, rel=0.3)
