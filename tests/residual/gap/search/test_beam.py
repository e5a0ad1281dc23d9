"""What a search tries first, and what it grows."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.fitting.screening import Gain
from residual.gap.search.beam import best_of, boldly, improves, partners, plainer, together

LAW, CASE, OTHER = 0, 1, 2


@pytest.mark.parametrize(("gained", "first"), [(0.95, CASE), (0.8, LAW)])
def test_a_special_case_that_gains_as_much_is_tried_in_place_of_its_law(gained, first):
    around = SimpleNamespace(variants=[SimpleNamespace(candidate=n) for n in (LAW, CASE, OTHER)])
    search = SimpleNamespace(contains=lambda one, other: (one, other) == (LAW, CASE))
    ranked = [Gain((n,), value, (np.zeros(1),)) for n, value in ((0, 1.0), (1, gained), (2, 0.5))]
    tried = plainer(search, around, ranked, 2)
    assert [around.variants[gain.variants[0]].candidate for gain in tried] == (
        [CASE] if first == CASE else [LAW, CASE]
    )


def test_sets_with_room_for_more_keep_their_place():
    errors = {(0,): 0.5, (1, 2): 0.2, (2, 3): 0.3, (3,): 0.4}
    search = SimpleNamespace(
        sound=lambda key: True, error=errors.get, numbers=lambda key: 2 * len(key), most_numbers=4,
        tried={key: SimpleNamespace(merit=error) for key, error in errors.items()},
        effort=SimpleNamespace(beam=2),
    )  # fmt: skip
    assert best_of(search, list(errors)) == [(1, 2), (3,), (0,)]


def test_a_set_that_stands_for_an_absurd_one_adds_nothing_for_its_joint():
    key, stand_in, sound = (0, 1), (0, 2, 3), (0, 1, 4)
    errors = {key: (1.0, 1.0), stand_in: (0.1, 1.0), sound: (1.0, 0.1)}
    merged = []
    search = SimpleNamespace(
        currency=SimpleNamespace(groups=((0,), (1,)), by_group=np.array),
        validated={k: SimpleNamespace(squares=error) for k, error in errors.items()},
        tried={
            sound: SimpleNamespace(
                theta=np.array([1.0, 2.0, 3.0]), model=SimpleNamespace(owner=np.array([0, 1, 2]))
            )
        },
        effort=SimpleNamespace(stale=0.05),
        merged=lambda key, additions: (merged.append(list(additions)) or sound, np.zeros(3)),
        fits_in=lambda key: True,
    )
    assert together(search, key, [stand_in, sound]) == []
    assert [number for number, _ in merged[0]] == [4]


def test_every_two_of_the_best_single_effects_meet():
    errors = {(0,): 0.6, (1,): 0.4, (2,): 0.9, (3,): 0.5, (4, 5): 0.1}
    tried = {}

    def add(proposals):
        tried.update(proposals)
        return list(proposals)

    search = SimpleNamespace(
        error=errors.get, effort=SimpleNamespace(partners=3), late=False, fits_in=lambda key: True,
        own=lambda key: np.array([10.0 * key[0]]), add=add, tried=tried, sound=lambda key: True,
        merged=lambda key, more: (
            tuple(sorted((*key, more[0][0]))), np.array([10.0 * key[0], *more[0][1]])
        ),
    )  # fmt: skip
    assert set(partners(search, list(errors))) == {(0, 1), (1, 3), (0, 3)}
    assert tried[1, 3].tolist() == [10.0, 30.0]  # each begins from its own numbers


@pytest.mark.parametrize(("reached", "goes_on"), [(0.2, True), (0.04, False)])
def test_nothing_larger_is_tried_once_the_error_is_small_enough(reached, goes_on):
    effort = SimpleNamespace(stale=0.05, enough=0.05)
    search = SimpleNamespace(error=lambda key: 0.5 * reached, effort=effort)
    assert improves(search, (0, 1), reached) is goes_on


@pytest.mark.parametrize("each", [False, True])
def test_every_parameter_is_fitted_alone_where_the_screen_tells_little(each):
    trial = SimpleNamespace(values=np.array([[2.0]]))
    candidates = [
        SimpleNamespace(effect=SimpleNamespace(enters=enters), bold=bold, trials=(trial,))
        for enters, bold in (("parameter", None), ("joint", None), ("parameter", np.array([5.0])))
    ]
    tried = {}
    search = SimpleNamespace(
        candidates=candidates, screened=3, late=False, fits_in=lambda key: True,
        effort=SimpleNamespace(parameters=each), add=lambda new: tried.update(new) or list(new),
        tried=tried, sound=lambda key: True,
    )  # fmt: skip
    assert boldly(search, parameters=True) == ([(0,), (2,)] if each else [(2,)])
    assert tried[(2,)] == 5.0
    assert boldly(search, parameters=False) == []
