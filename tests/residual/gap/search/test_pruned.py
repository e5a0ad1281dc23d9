"""What chance could do goes from a set, unless what stays could not be right."""

from types import SimpleNamespace

import pytest

from residual.gap.search import significance


@pytest.mark.parametrize("refused", [True, False])
def test_no_set_that_cannot_be_right_stands_in_place_of_a_larger_one(monkeypatch, refused):
    """One stood there, and the choice among sets that may be right ended in a fault."""
    merits = {(): 200.0, (0,): 10.5, (1,): 100.0, (0, 1): 10.0}
    sound = [key for key in merits if not (refused and key == (0,))]
    search = SimpleNamespace(
        tried={key: SimpleNamespace(merit=merit) for key, merit in merits.items()},
        simulator=SimpleNamespace(has_contacts=False),
        numbers=len,
        error=merits.get,
        usable=lambda: sound,
        sound=sound.__contains__,
        surprises=lambda key: 0,
    )
    monkeypatch.setattr(significance, "add_without_each", lambda search, key: None)
    monkeypatch.setattr(significance, "size", lambda search: 1)
    monkeypatch.setattr(significance, "tie", lambda search, key, other: 1.0)
    monkeypatch.setattr(significance, "departures", lambda search, key: 0)
    left = (0, 1) if refused else (0,)
    assert significance.pruned(search, (0, 1), 5.0) == left
    assert significance.significant(search, 5.0) == left
