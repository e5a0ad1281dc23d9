"""What the effects found in rows are called where several do the work of one."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.rows import _in_fewer

LABELS = ("torso_mass", "resistance", "supply", "friction")
SETS = (("resistance", "supply", "friction"),)


def found(merits, key):
    """A choice, of sets with given losses."""
    trial = SimpleNamespace(values=np.array([[1.0]]))
    tried = {key: SimpleNamespace(merit=merits[key])}

    def add(proposals):
        tried.update({k: SimpleNamespace(merit=merits[k]) for k in proposals})

    def merged(key, additions, drop):
        return tuple(sorted({*key, *(n for n, _ in additions)} - set(drop))), np.zeros(0)

    search = SimpleNamespace(
        candidates=[SimpleNamespace(label=label, trials=(trial,)) for label in LABELS],
        tried=tried, add=add, merged=merged, sound=lambda key: True, numbers=len,
    )  # fmt: skip
    return SimpleNamespace(search=search, key=key, adequate=True, needed=100.0)


@pytest.fixture(autouse=True)
def nothing_pruned(monkeypatch):
    monkeypatch.setattr("residual.gap.rows.pruned", lambda search, key, needed: key)


def test_one_effect_is_named_where_several_do_its_work():
    assert _in_fewer(found({(0, 1, 2): 5.0, (0, 3): 60.0}, (0, 1, 2)), SETS) == (0, 3)


@pytest.mark.parametrize("key", [(0, 1, 2), (0, 1), (0, 3), ()])
def test_others_stay(key):
    merits = {key: 5.0, (0, 3): 500.0} | {key: 5.0}
    assert _in_fewer(found(merits, key), SETS) == key
