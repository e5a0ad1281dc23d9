"""How sure a chosen effect is, and what is said of it."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from toy import Toy

from residual.gap.answer.verdicts import effect_verdict, minor_verdict, nameable
from residual.gap.confirmation.certainty import (
    Claim,
    in_the_limit,
    needed,
    steady,
    survives,
)
from residual.gap.confirmation.rivals import in_plain_form
from residual.gap.confirmation.widening import vital
from residual.gap.data.samples import Samples
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.intervals import at_bound, bounded, deviations
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.result import Number
from residual.trajectories import Trajectory
from sims.effects import DeadZone
from sims.pendulum_equation import PendulumEquation


def claim(number=0, **changed):
    made = Claim(
        number, {"change": Number(0.01, 0.009, 0.011, "kg")}, (), (), (), (),
        needed=True, steady=True, sound=True, bounded=False, share=(0.9, 0.8, 0.95),
    )  # fmt: skip
    return dataclasses.replace(made, **changed)


def test_an_effect_without_which_nothing_comes_near_is_vital():
    toy = Toy({(0, 1): 0.2, (1,): 0.7, (0,): 0.5})
    gain, friction = claim(0, rivals=("constant_load@pivot",)), claim(1)
    assert vital(toy, (0, 1), gain)
    assert not vital(toy, (0, 1), friction)
    assert not vital(toy, (0, 1), dataclasses.replace(gain, calibration=True))


def test_a_number_that_is_known_beforehand_costs_no_freedom():
    rng = np.random.default_rng(0)
    blocks, rows = 8, 20
    by_knob, projected = rng.standard_normal((blocks, rows, 5)), rng.standard_normal((blocks, rows))

    def fit(count, known):
        knobs = [SimpleNamespace(known=k) for k in (np.inf, *known)]
        return Fit(
            SimpleNamespace(knobs=knobs), np.zeros(count), np.ones(blocks), np.ones(blocks),
            projected, by_knob[..., :count], np.zeros((blocks, rows, 1)), True, None,
        )  # fmt: skip

    windows = type("Few", (), {"block": np.arange(blocks), "__len__": lambda self: blocks})()
    alone = deviations(fit(1, ()), windows)[0]
    pinned = deviations(fit(5, [1e-6] * 4), windows)[0]
    assert pinned == pytest.approx(alone, rel=1e-3)


@pytest.mark.parametrize(
    ("number", "key"),
    [
        (Number(0.1, 0.0, 0.2, "N m"), (2,)),
        (Number(0.1, 0.1, 0.2, "N m", at_bound=True), (2,)),
        (Number(0.1, 0.05, 0.15, "N m"), None),
    ],
    ids=["may be zero", "at a bound", "told"],
)
def test_a_plainer_form_stands_where_a_laws_own_numbers_are_not_told(number, key):
    toy = Toy({(1,): 0.3, (2,): 0.32})
    toy.numbers = lambda key: 3 if key == (1,) else len(key)
    law = claim(1, numbers={"change": number}, form=("coulomb_friction@pivot",))
    assert in_plain_form(toy, (1,), [law]) == key
    assert in_plain_form(toy, (1,), [dataclasses.replace(law, form=())]) is None


@pytest.mark.parametrize(("merit", "key"), [(101.0, (2,)), (150.0, None)])
def test_a_plainer_form_that_forecasts_better_and_fits_as_well_stands_at_once(merit, key):
    """Friction by direction, the same in both, stood where dry friction erred less."""
    toy = Toy({(1,): 0.3, (2,): 0.29}, merits={(): 1e3, (1,): 100.0, (2,): merit})
    toy.fitter.samples.seen, toy.fitter.samples.measured = np.zeros((80, 1)), [0]
    toy.numbers = lambda key: 2 if key == (1,) else len(key)
    numbers = {"change": Number(0.1, 0.05, 0.15, "N m")}
    law = claim(1, numbers=numbers, form=("coulomb_friction@pivot",))
    assert in_plain_form(toy, (1,), [law]) == key


def test_a_plainer_form_that_errs_far_more_does_not():
    """With a load beside it Coulomb friction is friction by direction; alone it is far behind."""
    toy = Toy({(1,): 0.01, (2,): 0.4, (2, 3): 0.01})
    toy.numbers = lambda key: 2 if key == (1,) else len(key)
    law = claim(
        1, numbers={"change": Number(1.0, 0.0, 1.1, "N m")}, form=("coulomb_friction@pivot",)
    )
    assert in_plain_form(toy, (1,), [law]) is None


@pytest.mark.parametrize(("rest", "scatter", "sure"), [(0.9, 0.1, True), (0.33, 0.6, False)])
def test_an_effect_is_needed_if_forecasts_are_clearly_worse_without_it(rest, scatter, sure):
    toy = Toy({(0,): 0.3, (0, 1): 0.3, (1,): rest}, scatter=scatter)
    assert needed(toy, (0, 1), 0, adequate=False) is sure


def test_a_size_has_to_be_about_the_same_in_every_fold():
    toy = Toy({(0,): 0.3})
    toy.tried[(0,)].theta = np.array([1.0])
    for folds, wanted in (([0.6, 1.4], True), ([0.4, 1.0], False), ([1.0, -0.1], False)):
        toy.validated[(0,)].thetas = np.array(folds)[:, None]
        assert steady(toy, (0,), 0) is wanted


def test_a_size_that_halves_with_the_step_ends_at_zero():
    whole, half, other = np.array([0.0063, 0.58]), np.array([0.0033, 0.58]), np.array([0.007, 0.6])
    ends = in_the_limit(whole, [half, other])
    np.testing.assert_allclose(ends, [[0.0003, 0.58], [0.007, 0.6]])
    assert survives(0.0063, 0.002, [half[0], other[0]])
    assert not survives(0.0063, 0.002, [end[0] for end in ends])
    assert survives(0.58, 0.02, [end[1] for end in ends])
    assert in_the_limit(whole, []) == []


def test_a_size_has_to_survive_other_numerics():
    assert survives(1.0, 0.1, [1.4, 0.6])
    assert not survives(1.0, 0.1, [1.0, 1.6])
    assert survives(0.01, 0.1, [0.1])


def test_a_number_at_its_bound_is_said_to_be_there():
    volts = np.linspace(-3, 3, 20)[:, None]
    run = Trajectory("run", 0.05 * np.arange(21.0), np.ones((21, 2)), volts)
    simulator = PendulumEquation()
    pool = candidates(simulator, [DeadZone("voltage")], Samples.join([run], 5))
    model = Model(simulator, pool)
    for value, there in ((0.0, True), (0.2, False)):
        fields = ["model", "theta", "by_knob"]
        fit = dataclasses.make_dataclass("Fit", fields)(
            model, np.array([value]), np.ones((1, 1, 1))
        )
        assert at_bound(fit, 0) is there
        number = bounded(fit, 0, 0.05, [])
        assert number.at_bound is there
        assert model.low[0] <= number.low <= value <= number.high


def test_only_what_leaves_no_doubt_is_confirmed():
    toy = Toy({(0,): 0.3})
    assert effect_verdict(toy, claim(), 20).kind == "confirmed"
    for doubt, changed in {
        "not_needed": {"needed": False},
        "unsteady": {"steady": False},
        "numerics": {"sound": False},
        "at_bound": {"bounded": True},
        "share_may_be_zero": {"share": (0.35, -0.3, 0.7)},
        "calibration": {"calibration": True},
        "within": {"within": True},
        "slight": {"calibration": True, "slight": True},
        "rivals": {"rivals": ("constant_load@pivot",)},
    }.items():
        verdict = effect_verdict(toy, claim(**changed), 20)
        assert (verdict.kind, verdict.doubts) == ("ambiguous", (doubt,))
    alike = effect_verdict(toy, claim(alike=("constant_load@pivot",)), 20)
    assert (alike.kind, alike.alternatives) == ("ambiguous", ("constant_load@pivot",))


@pytest.mark.parametrize(("share", "kind"), [
    ((0.5, -0.02, 0.9), "confirmed"), ((0.5, -0.06, 0.9), "ambiguous"),
    ((0.02, -0.0003, 0.05), "ambiguous"), ((0.02, 0.001, 0.05), "confirmed"),
])  # fmt: skip
def test_what_takes_little_off_has_to_do_so_whichever_blocks_are_drawn(share, kind):
    assert effect_verdict(Toy({(0,): 0.3}), claim(share=share), 20).kind == kind


@pytest.mark.parametrize(("blocks", "left", "kind"), [
    (6, 4.0, "ambiguous"), (6, 1.5, "confirmed"), (20, 4.0, "confirmed"),
])  # fmt: skip
def test_few_blocks_that_leave_much_without_a_name_confirm_nothing(blocks, left, kind):
    verdict = effect_verdict(Toy({(0,): 0.3}), claim(), blocks, left=left)
    assert verdict.kind == kind
    assert verdict.doubts == (("few_blocks",) if kind == "ambiguous" else ())


def test_rivals_of_one_family_leave_the_family_confirmed():
    verdict = effect_verdict(Toy({(1,): 0.3}), claim(1, form=("coulomb_friction@pivot",)), 20)
    assert (verdict.kind, verdict.family) == ("confirmed", "dissipation")
    assert verdict.form == ("coulomb_friction@pivot",)


def test_few_blocks_confirm_families_for_the_time_being_and_fewer_than_four_nothing():
    toy = Toy({(1,): 0.3})
    for blocks, provisional in ((8, False), (7, True), (4, True)):
        verdict = effect_verdict(toy, claim(1), blocks)
        assert (verdict.kind, verdict.provisional) == ("confirmed", provisional)
        assert verdict.family == ("dissipation" if provisional else "")
        assert nameable(toy, claim(1), blocks, True)
    assert effect_verdict(toy, claim(1), 3).kind == "ambiguous"
    assert not nameable(toy, claim(1), 3, True)


@pytest.mark.parametrize(("value", "low", "at_bound", "named"), [
    (0.01, 0.001, False, True), (0.01, -0.001, False, False),
    (0.02, 0.0, True, True), (0.0, 0.0, True, False),  # full size, and none at all
])  # fmt: skip
def test_what_may_have_no_size_has_no_name(value, low, at_bound, named):
    toy = Toy({(0,): 0.3})
    small = claim(numbers={"change": Number(value, low, 0.02, "kg", at_bound)})
    assert nameable(toy, small, 20, True) is named


def test_what_forecasts_need_is_named_whatever_else_it_could_be():
    """Any of many makes a better simulator, and a user is told of which ones it is one."""
    toy = Toy({(0,): 0.3})
    some = ("constant_load@pivot", "viscous_friction@pivot", "coulomb_friction@pivot")
    many = (*some, "actuator_gain@voltage", "delay@voltage", "sensor_offset@angle")
    assert nameable(toy, claim(rivals=many), 20, True)
    verdict = effect_verdict(toy, claim(rivals=many), 20)
    assert verdict.kind == "ambiguous"
    assert set(many) <= set(verdict.alternatives)


def test_what_forecasts_do_not_need_has_to_be_one_of_few():
    toy = Toy({(0,): 0.3})
    some = ("viscous_friction@pivot", "coulomb_friction@pivot", "delay@voltage")
    assert nameable(toy, claim(rivals=some, needed=False), 20, True)  # dissipation counts once
    more = (*some, "actuator_gain@voltage")
    assert not nameable(toy, claim(rivals=more, needed=False), 20, True)


def test_minor_effects_carry_their_share_and_no_number():
    verdict = minor_verdict(Toy({(0,): 0.3}), 3, (0.02, 0.01, 0.03))
    assert (verdict.kind, verdict.effect, verdict.parameters) == ("minor", "constant_load", {})
    assert (verdict.share.low, verdict.share.value, verdict.share.high) == (0.01, 0.02, 0.03)


@pytest.mark.parametrize(
    ("low", "kind"), [(0.004, "confirmed"), (0.0005, "ambiguous"), (-0.001, "ambiguous")]
)
def test_what_may_be_zero_is_not_confirmed(low, kind):
    toy = Toy({(0,): 0.3})
    toy.family = lambda number: ""
    verdict = effect_verdict(toy, claim(numbers={"change": Number(0.01, low, 0.02, "kg")}), 20)
    assert verdict.kind == kind
    assert ("may_be_zero" in verdict.doubts) is (kind == "ambiguous")


@pytest.mark.parametrize(("high", "kind"), [(0.09, "confirmed"), (0.11, "ambiguous")])
def test_what_may_be_ten_times_as_large_is_not_confirmed(high, kind):
    verdict = effect_verdict(
        Toy({(0,): 0.3}), claim(numbers={"change": Number(0.01, 0.008, high, "kg")}), 20
    )
    assert verdict.kind == kind
    assert verdict.doubts == (("size_open",) if kind == "ambiguous" else ())
    wide = Number(0.01, 0.008, 0.5, "kg", if_exact=(0.009, high))  # beside what is not certain
    assert effect_verdict(Toy({(0,): 0.3}), claim(numbers={"change": wide}), 20).kind == kind


@pytest.mark.parametrize(("left", "high", "kind"), [
    (2.0, 0.09, "confirmed"), (12.0, 0.03, "confirmed"), (12.0, 0.09, "ambiguous"),
])  # fmt: skip
def test_beside_much_without_a_name_a_size_is_known_within_a_factor_or_not_certain(
    left, high, kind
):
    size = Number(0.01, 0.008, high, "kg", if_exact=(0.009, 0.011))
    verdict = effect_verdict(Toy({(0,): 0.3}), claim(numbers={"change": size}), 20, left=left)
    assert verdict.kind == kind
