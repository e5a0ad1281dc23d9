"""What differs between records: told with its size in each, and only where records do differ."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from lift import LOADS, Lift, trips
from lift import OFFERED as OFFERED_LIFT

from residual.gap import find_gap
from residual.gap.answer.records import stands_for
from residual.gap.beside import Unlike
from sims.effects import ConstantLoad, CoulombFriction, FrictionCurve, QuadraticActuator
from sims.pendulum_equation import PendulumEquation
from studies.gap.lead import lead
from studies.gap.summary import summary
from studies.hidden.data import Truth, make_logs

#: Not all of the library, so that each takes a few seconds.
OFFERED = ("mass", "constant_load", "viscous_friction", "actuator_gain", "sensor_offset")


#: Shares of the mass.
PAYLOADS = (0.0, 0.15, 0.3, 0.9)


def logs(*truths, seed=3):
    """A record of each truth, a name each."""
    found = []
    for i, truth in enumerate(truths):
        (run,) = make_logs(truth, [seed, i], "strong", "A", runs=1)
        found.append(dataclasses.replace(run, name=f"day {i + 1}"))
    return found


def ask(runs):
    return find_gap(PendulumEquation(), runs, effects=OFFERED, hold="zero")


@pytest.fixture(scope="module")
def payloads():
    """The swinging mass is another one on each of four days, on one of them nearly twice."""
    return ask(logs(*(Truth(mass=share) for share in PAYLOADS)))


@pytest.mark.long
def test_a_payload_of_each_record_is_found_with_its_size(payloads):
    first = payloads.unlike[0]
    assert (first.label, first.field, first.unit) == ("mass", "change", "kg")
    sizes = [first.sizes[f"day {i}"] for i in (1, 2, 3, 4)]
    assert np.allclose(sizes, 0.055 * np.array(PAYLOADS), atol=0.001)
    assert first.share > 0.95 > payloads.gap.share.value + 0.2


def test_the_answer_says_so(payloads):
    assert "The records differ: if mass may have its own size in each of them" in lead(payloads)
    told = " ".join(summary(payloads).split())
    assert "RECORDS DIFFER mass: " in told and "search the records one by one" in told
    days = [told.index(f" in day {i}") for i in (1, 2, 3, 4)]
    assert days == sorted(days)


@pytest.mark.long
def test_what_is_the_same_in_all_records_is_named_beside_what_differs():
    truths = [Truth(viscous_friction=2e-4, constant_load=sign * 1e-3) for sign in (1, -1, 1, -1)]
    found = ask(logs(*truths))
    assert "viscous_friction" in [verdict.effect for verdict in found.verdicts]
    first = found.unlike[0]
    assert first.label == "constant_load@pivot"
    assert np.allclose([first.sizes[f"day {i}"] for i in (1, 2, 3, 4)], [1e-3, -1e-3] * 2, rtol=0.2)


@pytest.mark.parametrize(
    "truth",
    [
        Truth(),
        pytest.param(Truth(mass=0.2), marks=pytest.mark.long),
        pytest.param(Truth(wind=4e-3), marks=pytest.mark.long),
    ],
    ids=["nothing", "mass", "wind"],
)
def test_records_that_agree_are_not_said_to_differ(truth):
    """Also where something has no name: a wind that no library holds."""
    assert ask(logs(*[truth] * 3)).unlike == ()


@pytest.mark.long
def test_loads_of_a_lift_are_told_in_place_of_what_makes_the_best_of_them():
    """One size for all leads to a dead zone and another counterweight."""
    found = find_gap(Lift(), trips(), effects=OFFERED_LIFT, horizon=1.5)
    first = found.unlike[0]
    assert first.label == "cabin" and first.instead
    sizes = [first.sizes[run.name] for run in trips()]
    assert np.allclose(sizes, LOADS, atol=40.0)
    assert not [v.effect for v in found.verdicts if v.kind == "confirmed"]
    assert "records" in found.verdicts[0].doubts
    assert "and nothing else is added, 99.3 % of the gap has a name" in lead(found)


@pytest.mark.long
def test_nothing_is_said_of_a_single_record():
    (run,) = make_logs(Truth(wind=4e-3), 5, "strong", "A", runs=1, steps=300)
    assert ask([run]).unlike == ()


@pytest.mark.parametrize(("effect", "instead", "wanted"), [
    (FrictionCurve("pivot"), False, True), (CoulombFriction("pivot"), False, False),
    (CoulombFriction("pivot"), True, True),
])  # fmt: skip
def test_a_curve_may_stand_for_what_differs_between_records(effect, instead, wanted):
    """Records that reach differently far have points of a curve to themselves."""
    push = SimpleNamespace(effect=ConstantLoad("pivot"), label="constant_load@pivot")
    own = SimpleNamespace(effect=effect, label=str(effect))
    answer = SimpleNamespace(found=SimpleNamespace(search=SimpleNamespace(candidates=[own, push])))
    one = Unlike("constant_load", "pivot", "load", "N m", {}, 0.5, instead=instead)
    assert stands_for(answer, SimpleNamespace(number=0), [one]) is wanted
    assert not stands_for(answer, SimpleNamespace(number=0), [])


def test_a_law_of_an_input_may_stand_for_a_push_that_differs():
    """Records are driven at other levels: these tell the law by what parts the records."""
    effects = [
        QuadraticActuator("voltage", full=5.0),
        ConstantLoad("pivot"),
        CoulombFriction("pivot"),
    ]
    candidates = [SimpleNamespace(effect=e, label=str(e)) for e in effects]
    answer = SimpleNamespace(found=SimpleNamespace(search=SimpleNamespace(candidates=candidates)))

    def asked(effect, where, number):
        differs = Unlike(effect, where, "load", "N m", {}, 0.5)
        return stands_for(answer, SimpleNamespace(number=number), [differs])

    assert asked("constant_load", "pivot", number=0)
    assert not asked("mass", "mass", number=0)
    assert not asked("constant_load", "pivot", number=2)
