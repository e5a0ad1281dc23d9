"""The first sentence of an answer."""

import dataclasses
from types import SimpleNamespace

import pytest
from told import DELAY, FRICTION, MASS, NO_GAP, rest, result

from residual.gap.beside import Changing, Conventions
from residual.gap.data.stretch import Stretch
from residual.gap.result import (
    ChannelGap,
    Span,
)  # fmt: skip
from residual.logs.checks import Finding
from sims import Channel
from studies.gap.answer import headline
from studies.gap.lead import lead
from studies.gap.summary import summary
from studies.gap.verdicts import banners


def test_what_the_simulator_may_cut_off_by_mistake_comes_first():
    found = dataclasses.replace(result(MASS), cut_off=("torque",))
    first, rest = lead(found).split(" If it is: ")
    assert first.startswith("First see whether the simulator is meant to cut torque off where")
    assert rest == lead(result(MASS))
    assert banners(found, None)[0].tone == "bad"


def test_what_the_log_may_count_otherwise_comes_first():
    found = dataclasses.replace(
        result(MASS),
        conventions=Conventions(("`scale: -1` for voltage", "`unit: mV` for voltage"), 19.0),
    )
    first, rest = lead(found).split(" If that is not it: ")
    assert "with `scale: -1` for voltage or `unit: mV` for voltage in the column map" in first
    assert first.endswith("errs 19 times less.")
    assert rest == lead(result(MASS))


def test_what_takes_more_off_by_its_change_comes_first():
    sags = Changing("actuator_gain@voltage", -1e-5, -0.15, 0.0, "1", 0.999, instead=True)
    found = dataclasses.replace(result(MASS, rest(0.2)), changing=sags)
    first, after = lead(found).split(" If that is not it: ")
    assert first == (
        "It all looks like actuator gain at voltage that changes along the records, from about 0 "
        "to −0.15, which would take 99.9 % of the squared residual off."
    )
    assert after == lead(result(MASS, rest(0.2)))
    certain = dataclasses.replace(result(MASS), changing=sags)
    assert lead(certain) == lead(result(MASS))


def test_an_integration_step_that_shows_comes_first_where_something_was_found():
    shows = Finding("step", "", "the integration step shows in this log", severity="warning")
    found = dataclasses.replace(result(MASS), quality=(shows,))
    first, after = lead(found).split(" If that is not it: ")
    assert first.startswith("First see the simulator's integration step, which shows in this log")
    assert after == lead(result(MASS))
    nothing = dataclasses.replace(result(NO_GAP, effects=()), quality=(shows,))
    assert lead(nothing) == lead(result(NO_GAP, effects=()))


def test_a_gap_without_a_name_that_lies_in_one_stretch_leads_to_it():
    found = dataclasses.replace(result(rest(1.0)), lone=Stretch("run 2", 1.5, 4.0, 0.93, 0.2))
    assert lead(found).endswith("93 % of its square lies in one stretch, run 2 from 1.5 s to 4 s.")


def test_a_law_that_may_be_another_one_leads_to_what_changes():
    """However little is left beside numbers that imitate it."""
    warm = Changing("damping", 2e-3, 1e-3, 1.5e-3, "N m s/rad", 0.8, "rate", -5.0, 5.0, "rad/s")
    doubted = dataclasses.replace(MASS, kind="ambiguous", doubts=("law",))
    for verdict, told in ((doubted, True), (MASS, False)):
        says = lead(dataclasses.replace(result(verdict, rest(0.01)), changing=warm))
        assert says.endswith(" from about 2 mN m s/rad to 1 mN m s/rad.") == told
        assert ("The rest looks like damping that changes with rate," in says) == told
    # That something changes is said already.
    curve = dataclasses.replace(doubted, effect="parameter_curve", where="damping over rate")
    says = lead(dataclasses.replace(result(curve, rest(0.0001)), changing=warm))
    assert "The rest looks like" not in says


@pytest.mark.parametrize(
    ("after", "spread", "worse", "helps"),
    # The last is worse by no more than which records were set aside.
    [(0.9, 1.1, False, True), (0.99, 1.1, False, False), (1.2, 1.1, True, False),
     (1.2, 2.0, False, False)],
)  # fmt: skip
def test_the_first_sentence_says_where_the_corrected_simulator_is_no_better(
    after, spread, worse, helps
):
    doubts = () if helps else ("set_aside",) if worse else ("no_help",)
    found = result(
        dataclasses.replace(MASS, kind="ambiguous" if doubts else MASS.kind, doubts=doubts)
    )
    before = Span(1.0, 1 / spread, spread)
    apart = dataclasses.replace(
        found.gap, before=before, after=Span(after, after / spread, after * spread)
    )
    says = lead(dataclasses.replace(found, held_out=apart))
    assert says.startswith("98 % of the gap is")
    assert (
        "does not hold on the records set aside, where the corrected simulator is worse: the 1 s "
        "error of angle is 1.2 rad, the nominal one's 1 rad." in says
    ) is worse
    assert (
        f"does not help on the records set aside, where the 1 s error of angle is {after} rad with "
        "it and 1 rad without." in says
    ) is not (helps or worse)
    assert ("records set aside" in says) is not helps


def test_what_makes_no_difference_on_records_with_a_gap_of_their_own_is_said_so():
    found = result(MASS)
    assert banners(found, None)[0].tone == "good"
    span = Span(1.0, 0.9, 1.1)
    apart = dataclasses.replace(found.gap, before=span, after=span)
    found = dataclasses.replace(found, held_out=apart)
    assert banners(found, None)[0].tone == "warning"
    says = lead(found)
    assert says.endswith(
        "The records set aside do not show it: they have a gap of their own, beside which what was "
        "found makes little difference: the 1 s error of angle is 1 rad with it and 1 rad without."
    )


def test_records_in_which_nothing_shows_are_not_said_to_speak_against_a_name():
    found = result(MASS)
    noise = Span(1.3, 1.2, 1.4)
    before, after = Span(1.0, 0.9, 1.1), Span(1.02, 0.9, 1.1)
    apart = dataclasses.replace(found.gap, before=before, after=after, noise_floor=noise)
    says = lead(dataclasses.replace(found, held_out=apart))
    assert banners(dataclasses.replace(found, held_out=apart), None)[0].tone == "good"
    assert "The records set aside cannot tell: there noise alone makes 1.3 rad, and" in says
    assert "not help" not in says


OTHER = "The other 54 % cannot be told from noise."


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
    assert lead(boats(*errors)) == f"46 % of the gap is mass{told} {OTHER}"


def test_the_first_sentence_tells_a_rate_that_a_position_s_share_does_not():
    """A rate that reads wrongly keeps its error, whatever explains the angle."""
    swinging = SimpleNamespace(
        physical_channels=[
            Channel("a", "rad", "position"), Channel("b", "rad/s", "rate", rate_of="a"),
        ],
        joints=(), parameters={},
    )  # fmt: skip
    for errors, told in (
        ([(1.0, 0.1), (0.14, 0.14)], " (a 99 %, b 0 %)."),
        ([(1.0, 0.7), (1.0, 0.7)], "."),
    ):
        found = dataclasses.replace(boats(*errors), corrected=swinging)
        assert lead(found) == f"46 % of the gap is mass{told} {OTHER}"


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
        assert told == f"46 % of the gap is mass. {OTHER}{says}"


def test_all_of_the_gap_is_told_of():
    """What has no verdict is noise; a rest that has one is told there."""
    assert OTHER in lead(boats((1.0, 0.7)))
    unexplained = dataclasses.replace(boats((1.0, 0.7)), verdicts=(MASS, rest(0.5)))
    assert OTHER not in lead(unexplained)
    assert OTHER not in lead(result(MASS, share=0.95))


@pytest.mark.parametrize(("error", "said"), [(1.2, False), (2.0, True)])
def test_the_first_sentence_says_where_only_records_set_aside_have_a_gap(error, said):
    found = result(NO_GAP, effects=[])
    noise = Span(1.0, 0.9, 1.1)
    before = Span(error, 0.9 * error, 1.1 * error)
    apart = dataclasses.replace(found.gap, before=before, noise_floor=noise)
    says = lead(dataclasses.replace(found, held_out=apart))
    assert says.startswith("No gap ")
    assert (
        "But the records set aside have one: there the 1 s error of angle is 2 rad" in says
    ) is said


@pytest.mark.parametrize(
    ("verdicts", "first"),
    [
        ([MASS], "98 % of the gap is mass."),
        ([MASS, FRICTION], "98 % of the gap is mass and dissipation."),
        (
            [MASS, dataclasses.replace(FRICTION, family="", form=())],
            "98 % of the gap is mass and Coulomb friction.",
        ),
        ([DELAY], "98 % of the gap is perhaps delay at voltage or actuator lag at voltage."),
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


def test_of_many_names_that_are_not_certain_two_are_told():
    doubtful = [
        dataclasses.replace(MASS, kind="ambiguous", effect=name, where="voltage", family="")
        for name in ("delay", "dead_zone", "saturation", "actuator_gain")
    ]
    told = "98 % of the gap is perhaps {}."
    three = lead(result(*doubtful[:3]))
    assert three == told.format("delay at voltage, dead zone at voltage and saturation at voltage")
    four = lead(result(*doubtful))
    assert four == told.format("delay at voltage, dead zone at voltage and 2 more")


def test_what_is_certain_and_next_to_nothing_is_told_last():
    mass = dataclasses.replace(MASS, kind="ambiguous", alternatives=(), same_motion=())
    late = dataclasses.replace(DELAY, kind="confirmed", alternatives=(), doubts=())
    found = result(late, mass)
    assert lead(found) == "98 % of the gap is perhaps mass, and delay at voltage, which is certain."


def test_no_gap_and_nothing_that_matters_are_different_answers():
    nothing = result(NO_GAP, effects=[])
    near = dataclasses.replace(nothing.gap, noise_floor=Span(0.9, 0.8, 1.0))
    assert lead(dataclasses.replace(nothing, gap=near)).startswith("No gap above the noise: ")
    assert lead(nothing) == (
        "No gap that these data tell from noise: the 1 s error of angle is 1 rad (0.9 rad to "
        "1.1 rad), noise alone makes 0.09 rad."
    )
    assert lead(nothing, tolerance=2.0).startswith("Nothing that matters: ")
    assert lead(result(MASS), tolerance=0.5) == lead(result(MASS))


def test_too_few_data_that_err_as_by_noise_may_hold_a_gap_or_none():
    found = result(rest(1.0), effects=[], blocks=2)
    table = dataclasses.replace(found.gap, noise_floor=Span(0.9, 0.8, 1.2))
    few = dataclasses.replace(found, gap=table)
    assert lead(few).startswith("Too few data to tell whether there is a gap: ")
    rest_and_jump = dataclasses.replace(found.gap, before=Span(1.0, 0.01, 2.0))
    plain = dataclasses.replace(found, gap=rest_and_jump)
    assert lead(plain).startswith("The gap has no name: ")
    assert headline(few.verdicts[0], few) == "These data cannot tell whether there is a gap."
    assert "4 are needed" in summary(few)
    assert lead(found).startswith("The gap has no name: ")
    enough = dataclasses.replace(few, gap=dataclasses.replace(table, blocks=20))
    assert lead(enough).startswith("The gap has no name: ")
