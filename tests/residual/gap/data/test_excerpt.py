"""Long records are searched in stretches that lie all over them; others as they are."""

import numpy as np
import pytest

from residual.gap.data.excerpt import STRETCH, excerpt
from residual.trajectories import Trajectory


def run(steps, name="a"):
    times = 0.1 * np.arange(steps + 1)
    return Trajectory(name, times, np.column_stack([times, -times]), 2 * times[:-1, None])


def test_short_records_are_taken_as_they_are():
    runs = [run(5000), run(3)]
    kept, says = excerpt(runs, 1, most=5003)
    assert list(kept) == runs and not says


@pytest.mark.parametrize("stride", [1, 4])
def test_stretches_lie_all_over_a_long_record_and_are_what_was_recorded(stride):
    steps = 100 * STRETCH * stride + 17
    kept, (says,) = excerpt([run(steps)], stride, most=10 * STRETCH)
    rows = sum(len(piece) for piece in kept)
    assert f"{rows} of {steps} steps" in says
    assert 8 * STRETCH < rows / stride < 12 * STRETCH
    assert kept[0].times[0] == 0 and kept[-1].times[-1] == pytest.approx(0.1 * steps)
    starts = [piece.times[0] for piece in kept]
    assert np.ptp(np.diff(starts)) < 0.3 * np.median(np.diff(starts))
    for piece in kept:
        assert len(piece.times) == len(piece) + 1
        assert np.array_equal(piece.states[:, 0], piece.times)
        assert np.array_equal(piece.actions[:, 0], 2 * piece.times[:-1])
