"""Which sets meet again on more windows."""

from toy import Toy

from residual.gap.search.explain import Explanation
from residual.gap.search.finals import FINALISTS, finalists


def found(toy, key):
    return Explanation(toy, type("Choice", (), {"key": key})(), None, None, None, 0.0)


def test_sets_that_fit_as_well_meet_again_the_best_forecasts_first():
    errors = {(0,): 0.4, (1,): 0.3, (3,): 0.5, (4,): 0.2, (0, 1): 0.1}
    merits = {(): 1e3, (0,): 10.0, (1,): 10.03, (3,): 10.02, (4,): 11.0, (0, 1): 5.0}
    toy = Toy(errors, merits)
    # The tie is 0.05; what has more numbers does not take part.
    assert finalists(found(toy, (0,))) == [(0,), (1,), (3,)]
    toy.fitter.chance = lambda one, other: 2.0
    assert finalists(found(toy, (0,))) == [(0,), (4,), (1,)]
    toy.refused[(4,)] = "absurd"
    assert finalists(found(toy, (0,))) == [(0,), (1,), (3,)]


def test_there_are_few_of_them():
    keys = [(n,) for n in range(6)]
    toy = Toy({key: 0.3 for key in keys}, {(): 1e3, **{key: 10.0 for key in keys}})
    chosen = finalists(found(toy, (5,)))
    assert len(chosen) == FINALISTS and chosen[0] == (5,)
