"""What is left of a set when a member that cannot be named has gone."""

from types import SimpleNamespace

import pytest
from toy import Toy

from residual.gap.answer import answer, confirmed
from residual.gap.answer.evidence import evidence


def test_what_cannot_be_right_without_the_others_goes_too(monkeypatch):
    """A gain that switches its input off where nothing else of the set makes up for that."""

    def claims(search, key, *_):
        return [SimpleNamespace(number=number, needed=True, unasked=False) for number in key]

    monkeypatch.setattr(confirmed, "claims", claims)
    monkeypatch.setattr(confirmed, "nameable", lambda search, claim, *_: claim.number != 2)
    monkeypatch.setattr(confirmed, "allow_for_parameters", lambda search, key, made, *_: made)
    monkeypatch.setattr(confirmed, "_much", lambda *_: False)
    monkeypatch.setattr(confirmed, "with_stand_ins", lambda answer: answer)
    monkeypatch.setattr(confirmed, "other_numerics", lambda *_: [])
    monkeypatch.setattr(confirmed, "in_plain_form", lambda *_: None)
    monkeypatch.setattr(confirmed, "may_vanish", lambda *_: False)
    monkeypatch.setattr(confirmed, "add_exchanged", lambda *_: None)
    fit = SimpleNamespace(merit=1.0)
    search = SimpleNamespace(
        tried=dict.fromkeys([(), (0,), (0, 1), (0, 1, 2)], fit),
        refused={(0, 1): "outdoor would have 0.05 of its strength"},
        candidates=[SimpleNamespace(label=name) for name in ("load", "gain", "loss")],
        fitter=SimpleNamespace(
            blocks=range(8),
            tie=lambda nominal: 0.0,
            profiled=lambda fit: fit,
            left=lambda fit, floor: SimpleNamespace(ratio=2.0),
        ),
        merged=lambda key, _, drop: (tuple(k for k in key if k not in drop), None),
        add=lambda fits: None,
        usable=lambda: [],
        labels=lambda key: (),
    )
    found = SimpleNamespace(search=search, key=(0, 1, 2), adequate=False, floor=None)
    left = confirmed.confirm(found, {})
    assert left.key == (0,)
    assert left.leads == ("gain", "loss")


#: Of three the first was lost; errors over that of the nominal simulator.
THREE = {(): 1.0, (0,): 0.6, (1,): 0.5, (2,): 0.45, (0, 1, 2): 0.10}


@pytest.mark.parametrize(
    ("errors", "asked", "then"),
    [
        ({(1, 2): 0.16, (2, 3): 0.12}, (), (2, 3)),
        ({(1, 2): 0.16, (2, 3): 0.155}, (), (1, 2)),  # no better to speak of
        ({(1, 2): 0.16, (2, 3): 0.12}, [(2, 3)], (1, 2)),  # lost a member itself
        ({(1, 2): 0.16, (0, 1, 3): 0.05}, (), (1, 2)),  # no smaller than what failed
        ({(1, 2): 0.60, (0, 3): 0.70}, (), (2,)),  # two that make it worse than one
    ],
)
def test_the_best_set_of_its_size_is_asked_next(errors, asked, then):
    toy = Toy({**THREE, **errors})
    assert confirmed.likelier(toy, (1, 2), {(0, 1, 2), *asked}) == then


def test_what_cannot_be_right_is_not_asked():
    toy = Toy({**THREE, (1, 2): 0.16, (2, 3): 0.12})
    toy.refused[(2, 3)] = "a mass of minus one"
    assert confirmed.likelier(toy, (1, 2), set()) == (1, 2)


def test_what_takes_most_of_the_gap_is_not_minor():
    """It was one of many that a chosen effect could not be told from, and went with that."""
    toy = Toy({(1,): 0.95, (3,): 0.9, (4,): 0.3})
    found = SimpleNamespace(search=toy, choice=SimpleNamespace(minor=(1, 4)))
    toy.sound = lambda key: True
    assert list(answer.minor(SimpleNamespace(found=found, key=()))) == [1]


def test_reasons_are_those_of_the_set_that_is_left():
    toy = Toy({(0,): 0.6, (0, 3): 0.4, (0, 1): 0.57, (0, 1, 4): 0.5})
    toy.labels = lambda key: tuple("abcde"[n] for n in key)
    found = SimpleNamespace(search=toy, key=(0, 3), choice=SimpleNamespace(reasons={}))
    told = {one.effects: one.reason for one in evidence(found, (0,), ("d",))}
    assert told["a", "d"] == "holds effects that these data do not establish"
    assert told["a", "b"] == "takes only 5 % off what remains"
    assert told["a", "b", "e"] == "takes only 17 % off what remains with 2 effects more"
    assert told["a",] == ""


def test_what_would_take_much_but_may_not_be_named_takes_no_little():
    toy = Toy({(0,): 0.3, (0, 1): 0.02})
    toy.labels = lambda key: tuple("abcde"[n] for n in key)
    found = SimpleNamespace(search=toy, key=(0,), choice=SimpleNamespace(reasons={}))
    told = {one.effects: one.reason for one in evidence(found, (), ())}
    assert told["a", "b"] == "holds effects that these data do not establish"


def test_what_fits_down_to_the_noise_and_forecasts_worse_than_nothing_is_not_named(monkeypatch):
    for name, found in {
        "claims": lambda search, key, *_: [
            SimpleNamespace(number=n, needed=True, unasked=False) for n in key
        ],
        "nameable": lambda *_: True,
        "allow_for_parameters": lambda search, key, made, *_: made,
        "_much": lambda *_: False,
        "other_numerics": lambda *_: [],
        "may_vanish": lambda *_: False,
        "add_exchanged": lambda *_: None,
        "imitated": lambda *_: (),
    }.items():
        monkeypatch.setattr(confirmed, name, found)

    def named(error):
        toy = Toy({(1,): error, (0, 1): error})
        toy.merged = lambda key, _, drop: (tuple(k for k in key if k not in drop), None)
        toy.add = lambda fits: None
        return confirmed.confirm(SimpleNamespace(search=toy, key=(1,), adequate=True), {}).key

    assert named(0.3) == (1,)
    assert named(1.1) == (1,)  # by chance
    assert named(2.9) == ()
