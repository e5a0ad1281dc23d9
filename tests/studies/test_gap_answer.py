"""The sentences of find_gap: by kind, share and fields, never by other sentences."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.answer.table import BESIDE
from residual.gap.beside import Conventions
from residual.gap.result import (
    ChannelGap,
    Gap,
    GapResult,
    Meant,
    Number,
    Span,
    Step,
    Verdict,
    Where,
)  # fmt: skip
from sims import Channel
from sims.effects import CoulombFriction, ParameterChange
from sims.pendulum_equation import PendulumEquation
from studies.gap.answer import headline, notes
from studies.gap.lead import lead
from studies.gap.summary import summary
from studies.gap.verdicts import banners
from studies.reporting.sections import Prose
from studies.reporting.sections import Verdict as Banner

MASS = Verdict(
    "confirmed", "mass", "mass", {"change": Number(0.035, 0.034, 0.036, "kg")},
    ("length", "gravity"), "", "never parsed", Span(0.95, 0.9, 0.97),
    same_motion=("length", "gravity"),
)  # fmt: skip
FRICTION = Verdict(
    "confirmed", "coulomb_friction", "pivot", {"level": Number(2e-3, 1e-3, 3e-3, "N m")},
    ("viscous_friction@pivot",), "dissipation", "never parsed", Span(0.03, 0.02, 0.04),
    form=("viscous_friction@pivot",),
)  # fmt: skip
DELAY = Verdict(
    "ambiguous", "delay", "voltage", {"time": Number(0.75, 0.75, 0.75, "s", True)},
    ("actuator_lag@voltage",), "", "never parsed", Span(0.01, 0.0, 0.02), True,
    doubts=("at_bound", "rivals"),
)  # fmt: skip


def rest(share):
    return Verdict("unexplained", "", "", {}, (), "", "never parsed", Span(share, share, share))


NO_GAP = Verdict("no_gap", "", "", {}, (), "", "never parsed", Span(0.0, 0.0, 0.0))
MINOR = Verdict("minor", "cogging", "pivot", {}, (), "", "never parsed", Span(0.004, 0.001, 0.007))


def result(*verdicts, share=0.98, effects=None, blocks=20):
    """What find_gap would have returned with these verdicts."""
    errors = [Span(x, 0.9 * x, 1.1 * x) for x in (1.0, 0.1, 0.09)]
    table = Gap(
        "angle", "rad", 1.0, *errors, (Step("", errors[0]), Step("mass", errors[1])),
        {"angle": ChannelGap("rad", *errors)}, 80.0, 1.05, Span(share, share, share), blocks, 5,
    )  # fmt: skip
    there = [ParameterChange("mass", 0.035), CoulombFriction("pivot", 2e-3)]
    effects = there if effects is None else effects
    where = Where({"angle": 80.0}, (), np.zeros(0), {}, {})
    return GapResult(
        verdicts, table, None, where, (), (), tuple(effects),
        PendulumEquation().with_effects(effects), (("angle", "rad"),), {"angle": (0.01, 0.001)},
        (), (), True, {},
    )  # fmt: skip


def test_a_gain_is_told_as_a_share_more_and_as_times():
    gain = Verdict(
        "confirmed", "actuator_gain", "voltage", {"gain": Number(0.62, 0.5, 0.7, "1")}, (), "",
        "never parsed", Span(0.9, 0.8, 0.95),
    )  # fmt: skip
    assert headline(gain, result(gain)).endswith(
        "gain 0.62 (0.50 to 0.70), so 1.62 times the command."
    )


def test_what_the_log_may_count_otherwise_comes_first():
    found = dataclasses.replace(
        result(MASS),
        conventions=Conventions(("`scale: -1` for voltage", "`unit: mV` for voltage"), 19.0),
    )
    first, rest = lead(found).split(" If that is not it: ")
    assert "with `scale: -1` for voltage or `unit: mV` for voltage in the column map" in first
    assert first.endswith("errs 19 times less.")
    assert rest == lead(result(MASS))


@pytest.mark.parametrize(
    ("after", "spread", "worse", "helps"),
    # The last is worse by no more than which records were set aside.
    [(0.9, 1.1, False, True), (0.99, 1.1, False, False), (1.2, 1.1, True, False),
     (1.2, 2.0, False, False)],
)  # fmt: skip
def test_the_first_sentence_says_where_the_corrected_simulator_is_no_better(
    after, spread, worse, helps
):
    found = result(MASS)
    before = Span(1.0, 1 / spread, spread)
    apart = dataclasses.replace(
        found.gap, before=before, after=Span(after, after / spread, after * spread)
    )
    says = lead(dataclasses.replace(found, held_out=apart))
    assert says.startswith("98 % of the gap is mass.")
    assert (
        "does not hold on the records set aside, where the corrected simulator is worse: the 1 s "
        "error of angle is 1.2 rad, the nominal one's 1 rad." in says
    ) is worse
    assert (
        f"does not help on the records set aside, where the 1 s error of angle is {after} rad with "
        "it and 1 rad without." in says
    ) is not (helps or worse)
    assert ("records set aside" in says) is not helps


def boats(*errors):
    """A result about several quantities, each with these errors before and after."""

    names = "abcdefg"[: len(errors)]
    corrected = SimpleNamespace(
        physical_channels=[Channel(name, "m/s", "rate") for name in names], joints=(), parameters={}
    )
    table = {
        name: ChannelGap("m/s", Span(before, 0, 9), Span(after, 0, 9), Span(0.1, 0, 9))
        for name, (before, after) in zip(names, errors, strict=True)
    }
    found = result(MASS, share=0.46)
    gap = dataclasses.replace(found.gap, channel="a", by_channel=table)
    return dataclasses.replace(found, gap=gap, corrected=corrected)


@pytest.mark.parametrize(
    ("errors", "told"),
    [
        ([(1.0, 0.3), (1.0, 1.1)], " (a 91 %, b 0 %)."),
        # Alike; one without a gap to take anything off; many.
        ([(1.0, 0.3), (1.0, 0.4)], "."),
        ([(1.0, 0.3), (0.12, 0.12)], "."),
        ([(1.0, 0.5), (1.0, 0.1), (1.0, 0.9), (1.0, 0.5)], " (between c 19 % and b 99 %)."),
    ],
)
def test_the_first_sentence_tells_channels_apart_where_they_differ(errors, told):
    assert lead(boats(*errors)) == f"46 % of the gap is mass{told}"


@pytest.mark.parametrize(
    ("errors", "says"),
    [
        ([(1.0, 0.3), (1.0, 1.3)], " But on the records set aside it makes b worse: 1.3 m/s with"
         " it, 1 m/s without."),
        # Within the spread between records; of noise alone; the main one, which is told otherwise.
        ([(1.0, 0.3), (1.0, 1.05)], ""),
        ([(1.0, 0.3), (0.1, 0.14)], ""),
        ([(1.0, 0.3), (1.0, 1.2), (1.0, 1.4)], " But on the records set aside it makes c worse: "
         "1.4 m/s with it, 1 m/s without."),
        ([(1.0, 1.3), (1.0, 1.4)], None),
    ],
)  # fmt: skip
def test_the_first_sentence_names_another_channel_that_records_set_aside_show_worse(errors, says):
    used, apart = boats((1.0, 0.3), (1.0, 0.3), (1.0, 0.3)), boats(*errors).gap
    before, after = (Span(x, 0.9 * x, 1.1 * x) for x in errors[0])
    apart = dataclasses.replace(apart, before=before, after=after)
    told = lead(dataclasses.replace(used, held_out=apart))
    if says is None:
        assert "does not hold on the records set aside" in told and "it makes" not in told
    else:
        assert told == f"46 % of the gap is mass.{says}"


@pytest.mark.parametrize(("error", "said"), [(1.2, False), (2.0, True)])
def test_the_first_sentence_says_where_only_records_set_aside_have_a_gap(error, said):
    found = result(NO_GAP, effects=[])
    noise = Span(1.0, 0.9, 1.1)
    before = Span(error, 0.9 * error, 1.1 * error)
    apart = dataclasses.replace(found.gap, before=before, noise_floor=noise)
    says = lead(dataclasses.replace(found, held_out=apart))
    assert says.startswith("No gap above the noise: ")
    assert (
        "But the records set aside have one: there the 1 s error of angle is 2 rad" in says
    ) is said


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


@pytest.mark.parametrize(
    ("verdicts", "first"),
    [
        ([MASS], "98 % of the gap is mass."),
        ([MASS, FRICTION], "98 % of the gap is mass and dissipation."),
        (
            [MASS, dataclasses.replace(FRICTION, family="", form=())],
            "98 % of the gap is mass and Coulomb friction.",
        ),
        ([DELAY], "98 % of the gap is delay at voltage or actuator lag at voltage."),
        (
            [MASS, dataclasses.replace(DELAY, alternatives=(), doubts=("unsteady",))],
            "98 % of the gap is mass and perhaps delay at voltage.",
        ),
        ([rest(1.0)], "The gap has no name: the 1 s error of angle is 1 rad."),
    ],
)
def test_the_first_sentence_is_the_share_that_has_a_name(verdicts, first):
    assert lead(result(*verdicts)) == first
    assert summary(result(*verdicts)).startswith(first)


def test_what_is_certain_and_next_to_nothing_is_told_last():
    mass = dataclasses.replace(MASS, kind="ambiguous", alternatives=(), same_motion=())
    late = dataclasses.replace(DELAY, kind="confirmed", alternatives=(), doubts=())
    found = result(late, mass)
    assert lead(found) == "98 % of the gap is perhaps mass, and delay at voltage, which is certain."


def test_no_gap_and_nothing_that_matters_are_different_answers():
    nothing = result(NO_GAP, effects=[])
    assert lead(nothing).startswith("No gap above the noise: ")
    assert lead(nothing, tolerance=2.0).startswith("Nothing that matters: ")
    assert lead(result(MASS), tolerance=0.5) == lead(result(MASS))


def test_too_few_data_that_err_as_by_noise_may_hold_a_gap_or_none():
    found = result(rest(1.0), effects=[], blocks=2)
    table = dataclasses.replace(found.gap, noise_floor=Span(0.9, 0.8, 1.2))
    few = dataclasses.replace(found, gap=table)
    assert lead(few).startswith("Too few data to tell whether there is a gap: ")
    assert headline(few.verdicts[0], few) == "These data cannot tell whether there is a gap."
    assert "4 are needed" in summary(few)
    assert lead(found).startswith("The gap has no name: ")
    enough = dataclasses.replace(few, gap=dataclasses.replace(table, blocks=20))
    assert lead(enough).startswith("The gap has no name: ")


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


@pytest.mark.parametrize("effects", [[], [ParameterChange("mass", 0.001)]])
def test_too_few_blocks_are_no_verdict_on_the_library(effects):
    """Whether or not parameters were moved within their tolerance."""
    moved = Verdict("calibrated", "", "", {}, (), "", "never parsed", Span(0.4, 0.3, 0.5))
    verdicts = [*([moved] if effects else []), rest(0.6)]
    told = notes(rest(0.6), result(*verdicts, effects=effects, blocks=2))
    assert any("nothing is named from 2 blocks of data, 4 are needed" in note for note in told)
    assert not any("nothing of the library" in note for note in told)
    enough = notes(rest(0.6), result(*verdicts, effects=effects, blocks=20))
    assert any("nothing of the library explains it" in note for note in enough)


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
