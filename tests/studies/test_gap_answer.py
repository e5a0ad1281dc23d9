"""The sentences of find_gap: by kind, share and fields, never by other sentences."""

import dataclasses

import numpy as np
import pytest
from told import DELAY, FRICTION, MASS, MINOR, rest, result

from residual.gap.answer.table import BESIDE
from residual.gap.result import (
    ChannelGap,
    Meant,
    Number,
    Rollout,
    Span,
    Step,
    Verdict,
)  # fmt: skip
from sims import Channel
from sims.effects import ActuatorLag, Delay, FrictionCurve, ParameterChange
from studies.gap.answer import headline, notes
from studies.gap.lead import lead
from studies.gap.numbers import times_of
from studies.gap.summary import summary
from studies.gap.verdicts import banners
from studies.gap.words import quantities_text
from studies.reporting.sections import Prose
from studies.reporting.sections import Verdict as Banner


def test_a_gain_is_told_as_a_share_more_and_as_times():
    gain = Verdict(
        "confirmed", "actuator_gain", "voltage", {"gain": Number(0.62, 0.5, 0.7, "1")}, (), "",
        "never parsed", Span(0.9, 0.8, 0.95),
    )  # fmt: skip
    assert headline(gain, result(gain)).endswith(
        "gain 0.62 (0.50 to 0.70), so 1.62 times the command."
    )
    back = dataclasses.replace(gain, parameters={"back": Number(-0.4, -0.5, -0.3, "1")})
    assert times_of(back) == ", so 0.6 times as fast on the way back"


def test_a_parameter_with_a_wide_interval_differs_from_what_the_simulator_has():
    wide = dataclasses.replace(MASS, parameters={"change": Number(0.0054, -0.3, 33.0, "kg")})
    said = headline(wide, result(wide))
    own = float(result(wide).corrected.parameters["mass"].value)
    now, before = said.split(", so ")[1].rstrip(".").split(" kg in place of ")
    assert float(before) == pytest.approx(own)
    assert float(now) == pytest.approx(own + 0.0054, abs=5e-4) != own


def test_other_channels_have_their_errors_below_the_table():
    found = result(MASS)
    table = found.gap.by_channel | {
        "rate": ChannelGap("rad/s", *[Span(x, x, x) for x in (5, 2, 1)])
    }
    both = dataclasses.replace(found, gap=dataclasses.replace(found.gap, by_channel=table))
    assert "rate:" not in summary(both)  # the angle that it is the rate of was measured
    alone = dataclasses.replace(found.gap, channel="volts", by_channel={"rate": table["rate"]})
    says = summary(dataclasses.replace(found, gap=dataclasses.replace(alone, no_better=3)))
    assert "  rate: nominal 5, corrected 2, noise floor 1 rad/s\n" in says
    assert "the corrected simulator forecasts volts no better" in " ".join(says.split())


def test_a_number_at_its_bound_pretends_no_interval_and_says_why_it_is_not_certain():
    found = result(MASS, DELAY)
    assert headline(DELAY, found) == "Delay at voltage: time 0.75 s (at its bound)."
    said = "; ".join(notes(DELAY, found))
    assert "its size lies at its bound" in said
    assert "one of delay at voltage or actuator lag at voltage: these data cannot tell" in said


def test_a_wide_interval_says_how_narrow_it_would_be_for_an_exact_simulator():
    for own, said in (((0.0349, 0.0351), True), ((0.0341, 0.0359), False)):
        change = dataclasses.replace(MASS.parameters["change"], if_exact=own)
        verdict = dataclasses.replace(MASS, parameters={"change": change})
        lines = notes(verdict, result(verdict))
        exact = [line for line in lines if "if all else in the simulator is exact" in line]
        assert exact == (["0.034900 to 0.035100 kg if all else in the simulator is exact"] * said)


def test_a_provisional_answer_says_how_much_more_data_would_do():
    said = "; ".join(notes(DELAY, result(DELAY, blocks=5)))
    assert "there are 5 blocks of data to confirm it, 8 would do (some 3 s more)" in said
    assert "NOT CERTAIN, PROVISIONAL" in summary(result(DELAY, blocks=5))


def test_another_order_of_a_cogging_is_no_other_effect():
    cogging = Verdict(
        "ambiguous", "cogging", "pivot", {"sine": Number(0.01, 0.005, 0.015, "N m")},
        ("cogging@pivot",), "", "never parsed", Span(0.8, 0.7, 0.9), doubts=("rivals",),
    )  # fmt: skip
    assert "perhaps cogging" in lead(result(cogging))
    assert "of another order it would do nearly as well" in notes(cogging, result(cogging))


def test_what_moves_alike_is_told_apart_from_what_these_data_leave_open():
    assert "no motion can tell it from length or gravity" in notes(MASS, result(MASS))
    assert headline(FRICTION, result(MASS, FRICTION)).startswith(
        "Dissipation, form undecided: as Coulomb friction at pivot, level "
    )
    said = notes(FRICTION, result(MASS, FRICTION))
    assert "of the same family, viscous friction at pivot would do as well" in said


@pytest.mark.parametrize(("share", "red"), [(0.01, False), (0.3, True)])
def test_a_small_remainder_is_a_footnote_and_no_red_box(share, red):
    sections = banners(result(MASS, rest(share)), None)
    tones = [section.tone for section in sections if isinstance(section, Banner)]
    assert ("bad" in tones) is red
    text = " ".join(section.text for section in sections if isinstance(section, Prose))
    assert ("has no name" in text) is not red
    assert ("UNEXPLAINED" in summary(result(MASS, rest(share)))) is red


def test_minor_effects_are_listed_small():
    text = summary(result(MASS, MINOR))
    assert line_of(text, "MINOR") == "Cogging at pivot: 0.4 % of the gap, not added."
    kinds = [s.label for s in banners(result(MASS, MINOR), None) if isinstance(s, Banner)]
    assert kinds == ["answer", "confirmed"]


def line_of(text, kind):
    (line,) = [line for line in text.splitlines() if line.startswith(kind)]
    return line.removeprefix(kind).strip()


def test_a_twin_is_told_with_its_size_and_what_it_does_to_the_others():
    heavier = dataclasses.replace(
        MASS, meant=(Meant("length", {"change": (0.0267, "m")}),)
    )  # fmt: skip
    said = notes(heavier, result(heavier))
    assert "no motion can tell it from length (+0.0267 m) or gravity" in said
    rubbing = Verdict(
        "confirmed", "viscous_friction", "pivot",
        {"coefficient": Number(0.016, 0.012, 0.09, "N m s/rad")}, (), "", "", Span(0.5, 0.4, 0.6),
        beside=(Meant("length", {"coefficient": (0.0835, "N m s/rad")}),),
    )  # fmt: skip
    both = result(heavier, rubbing)
    assert "0.0835 N m s/rad if length is meant, not mass" in notes(rubbing, both)


@pytest.mark.parametrize(("blocks", "rows", "told"), [(3, 24, True), (3, 6, False), (2, 24, False)])
def test_a_shorter_horizon_is_advised_where_there_is_one(blocks, rows, told):
    """Six rows are the fewest; one or two blocks may be asked because shorter ones show nothing."""
    found = result(rest(0.6), effects=[], blocks=blocks)
    path = np.zeros((rows, 1))
    forecast = Rollout("run", np.arange(float(rows)), path, path, path)
    said = notes(rest(0.6), dataclasses.replace(found, rollouts=(forecast,)))
    assert any("set a shorter --horizon" in note for note in said) is told
    assert any("are needed: log some" in note for note in said)


@pytest.mark.parametrize("effects", [[], [ParameterChange("mass", 0.001)]])
def test_too_few_blocks_are_no_verdict_on_the_library(effects):
    """Whether or not parameters were moved within their tolerance."""
    moved = Verdict("calibrated", "", "", {}, (), "", "never parsed", Span(0.4, 0.3, 0.5))
    verdicts = [*([moved] if effects else []), rest(0.6)]
    told = notes(rest(0.6), result(*verdicts, effects=effects, blocks=2))
    assert any("nothing is named from 2 blocks of data, 4 are needed" in note for note in told)
    assert not any("of the library" in note for note in told)
    enough = notes(rest(0.6), result(*verdicts, effects=effects, blocks=20))
    assert any("no effect of the library is established" in note for note in enough)


@pytest.mark.parametrize(("hidden", "says"), [
    (("delay@voltage",), "Delay at voltage."),
    (("delay@voltage", "mass"), "Delay at voltage and mass."),
    (("cogging@angle", "cogging@angle", "mass", "cogging@angle"), "Cogging at angle and mass."),
    (("delay@u", "mass", "coulomb_friction@left_hip", "coulomb_friction@left_knee",
      "coulomb_friction@x"),
     "Delay at u; mass; Coulomb friction at left hip, left knee and x."),
])  # fmt: skip
def test_what_the_log_cannot_show_is_told_by_effect(hidden, says):
    blind = Verdict("needs_data", "", "", {}, hidden, "", "never parsed", Span(0.0, 0.0, 0.0))
    assert headline(blind, result(blind)) == says


def test_what_the_library_does_not_hold_is_named_beside_what_moves_alike():
    found = result(dataclasses.replace(DELAY, kind="confirmed"))
    assert "sensors that are late by as much would look the same" in notes(found.verdicts[0], found)


@pytest.mark.parametrize(("inputs", "nearly", "said"), [
    ("voltage", (), "would look the same"), ("other", (), ""),
    ("other", ("delay@voltage",), "nearly"),
])  # fmt: skip
def test_late_sensors_look_like_inputs_that_are_all_late(inputs, nearly, said):
    found = dataclasses.replace(result(DELAY), nearly_late=nearly)
    if inputs == "other":
        two = Channel("other", "V", "input")
        found.corrected.action_channels = (*found.corrected.action_channels, two)
    told = [note for note in notes(DELAY, found) if "sensors that are late" in note]
    assert len(told) == bool(said) and all(said in note for note in told)


@pytest.mark.parametrize(("left", "told"), [(3.4, True), (1.3, False)])
def test_points_of_a_curve_miss_the_law_where_more_than_noise_is_left(left, told):
    points = {name: Number(1.0, 0.9, 1.1, "N m") for name in ("slow", "medium", "fast")}
    share = Span(0.9, 0.8, 1.0)
    curve = Verdict("confirmed", "friction_curve", "pivot", points, (), "", "never parsed", share)
    found = result(curve, effects=[FrictionCurve("pivot", 1.0, 1.0, 1.0, 9.0)])
    gap = dataclasses.replace(found.gap, windows_after=left)
    said = notes(curve, dataclasses.replace(found, adequate=False, gap=gap))
    assert any("the law may depart from these points" in note for note in said) is told


@pytest.mark.parametrize(("values", "texts"), [
    ((-0.0013, -0.014), ["-0.0013 N m", "-0.014 N m"]),
    ((-0.0013, -0.004), ["-1.3 mN m", "-4 mN m"]), ((0.0, 0.5), ["0 N m", "0.5 N m"]),
])  # fmt: skip
def test_numbers_side_by_side_are_in_one_unit(values, texts):
    assert quantities_text(values, "N m") == [text.replace(" ", " ") for text in texts]


def test_two_of_one_family_are_told_by_their_own_names():
    drag = dataclasses.replace(FRICTION, kind="ambiguous", effect="quadratic_drag")
    assert "dissipation" in lead(result(FRICTION)) and "riction" not in lead(result(FRICTION))
    both = lead(result(FRICTION, drag))
    assert "Coulomb friction and perhaps quadratic drag" in both and "dissipation" not in both


@pytest.mark.parametrize("adequate", [False, True])
def test_a_delay_beside_a_lag_may_be_a_second_lag_where_something_is_left(adequate):
    path = [Delay("voltage", 0.02), ActuatorLag("voltage", 0.06)]
    found = dataclasses.replace(result(DELAY, effects=path), adequate=adequate)
    told = any("two lags in a row" in note for note in notes(DELAY, found))
    assert told is not adequate
    alone = dataclasses.replace(result(DELAY, effects=path[:1]), adequate=False)
    assert not any("two lags" in note for note in notes(DELAY, alone))


@pytest.mark.parametrize(("share", "error", "told"), [(0.4, 0.8, True), (-0.1, 1.05, False)])
def test_parameters_that_take_nothing_off_have_no_row_and_fewer_words(share, error, told):
    moved = Verdict("calibrated", "", "", {}, (), "", "never parsed", Span(share, share, share))
    found = result(MASS, moved)
    first, *rest = found.gap.steps
    steps = (first, Step(BESIDE, Span(error, error, error)), *rest)
    says = summary(dataclasses.replace(found, gap=dataclasses.replace(found.gap, steps=steps)))
    assert ("+ parameters within their tolerance" in says) is told
    assert ("alone they take nothing off" in says) is not told
    assert "+ mass" in says
