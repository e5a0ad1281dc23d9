import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.replay import Replay


def fill(replay, count, start=0):
    """Transition k carries k in every column."""
    for k in range(start, start + count):
        replay.add(np.full(2, k), [k], k, np.full(2, k + 0.5), k % 3 == 0)


@given(st.integers(1, 30), st.integers(1, 100))
def test_the_last_transitions_are_kept_whole(capacity, count):
    replay = Replay(capacity, 2, 1)
    fill(replay, count)
    assert len(replay) == min(capacity, count)
    batch = replay.sample(2000, np.random.default_rng(0))
    seen = batch.rewards[:, 0]
    assert set(seen) == set(range(max(0, count - capacity), count))
    np.testing.assert_array_equal(batch.observations, np.stack([seen, seen], 1))
    np.testing.assert_array_equal(batch.actions[:, 0], seen)
    np.testing.assert_array_equal(batch.next_observations, np.stack([seen, seen], 1) + 0.5)
    np.testing.assert_array_equal(batch.alive[:, 0], seen % 3 != 0)


def test_sampling_is_uniform():
    replay = Replay(10, 2, 1)
    fill(replay, 13)
    seen = replay.sample(50_000, np.random.default_rng(0)).rewards[:, 0]
    counts = np.unique(seen, return_counts=True)[1]
    np.testing.assert_allclose(counts, 5000, rtol=0.06)


@pytest.mark.parametrize("count", [4, 13])
def test_restored_replay_goes_on_the_same(count):
    replay, other = Replay(10, 2, 1), Replay(10, 2, 1)
    fill(replay, count)
    other.restore(replay.stored().copy(), replay.position)
    for one in (replay, other):
        fill(one, 3, start=count)
    np.testing.assert_array_equal(replay.stored(), other.stored())


def test_errors_say_what_is_wrong():
    with pytest.raises(ValueError, match="empty"):
        Replay(3, 1, 1).sample(1, np.random.default_rng(0))
    with pytest.raises(ValueError, match="capacity is 0"):
        Replay(0, 1, 1)
    fill(full := Replay(5, 2, 1), 5)
    for other, expected in ((Replay(3, 2, 1), "3 rows of 7"), (Replay(5, 1, 1), "5 rows of 5")):
        with pytest.raises(ValueError, match=expected):
            other.restore(full.stored(), 0)
