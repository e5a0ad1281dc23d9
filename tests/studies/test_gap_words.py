"""What find_gap says: numbers and shares in words, and signs of life."""

import re
import time

import pytest

from residual.gap.result import Number
from residual.trajectories import duration_text
from studies.gap import progress
from studies.gap.words import (
    by_place,
    effect_name,
    number_text,
    percent,
    quantity_text,
    rounded,
    six_digits,
    told,
    unit_text,
)


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [(0.0349736, 2.7e-5, "0.034974"), (14.23, 0.4, "14.23"), (6.2181, 0.0061, "6.2181"),
     (1234.5, 60, "1234"), (0.0, 1.0, "0")],
)  # fmt: skip
def test_numbers_show_two_digits_of_their_uncertainty(value, half, text):
    assert rounded(value, half) == text


def test_an_interval_is_written_with_its_unit():
    assert number_text(Number(-0.5, -0.6, -0.4, "1")) == "−0.50 (−0.60 to −0.40)"
    # Of a lopsided interval the near side tells how well the value is known.
    assert number_text(Number(-0.3, -32.7, 1.3, "%")) == "−0.3 % (−32.7 to 1.3)"
    assert number_text(Number(-0.34, -0.84, -0.001, "1")) == "−0.34 (−0.84 to 0.00)"
    assert number_text(Number(5.6e-5, 0.0, 22.36, "s")) == "0.000056 s (0 to 22.4)"
    assert number_text(Number(2.0, -300.0, 2.02, "V")) == "2.000 V (−300 to 2.020)"
    assert number_text(Number(0.35, 0.0, 6.8e142, "N m")) == "0.35 N m (nothing tells how large)"
    assert number_text(Number(2.0, 1.9, 2.1, "kg"), sign=True) == "+2.00 kg (1.90 to 2.10)"


def test_a_number_at_its_bound_has_no_interval():
    assert number_text(Number(0.75, 0.75, 0.75, "N m", True)) == "0.75 N m (at its bound)"


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.4567, "46 %"), (0.0123, "1.2 %"), (0.9951, "99.5 %"), (0.99999, "more than 99.9 %"),
     (1.0, "100 %"), (0.0002, "less than 0.1 %"), (-0.1, "0 %"), (0.99, "99 %")],
)  # fmt: skip
def test_a_share_is_rounded_where_that_hides_nothing(share, text):
    assert percent(share) == text


def test_a_sign_of_life_comes_while_nothing_is_said(monkeypatch, capsys):
    monkeypatch.setattr(progress, "QUIET", 0.04)
    lines = []
    with progress.Heartbeat() as tell:
        tell("reading")
        tell.until(60)
        tell("mass: 3 % of the error")
        end = time.monotonic() + 10
        while len(lines) < 3 and time.monotonic() < end:
            time.sleep(0.01)
            lines += capsys.readouterr().err.splitlines()
    assert len(lines) >= 3
    assert re.match(r" *\d+\.\d s  reading", lines[0])
    assert all(re.match(r" *\d+\.\d s, \d+ s left  ", line) for line in lines[1:])
    assert lines[-1].endswith("still working; last: mass: 3 % of the error")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.005, "m", "5 mm"),
        (0.005, "m/s^2", "5 mm/s\u00b2"),
        (0.005, "mm", "0.005 mm"),
        (0.005, "m^2", "0.005 m\u00b2"),
        (0.005, "rpm", "0.005 rpm"),
        (0.05, "rad", "0.05 rad"),
        (0.005, "1", "0.005"),
    ],
)
def test_thousandths_have_a_name_only_of_a_plain_unit(value, unit, text):
    assert quantity_text(value, unit) == text


def test_powers_are_raised():
    assert unit_text("N m s^2/rad^2") == " N m s\u00b2/rad\u00b2"
    assert unit_text("s^-1") == " s\u207b\u00b9"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.4, "0.4 s"), (697.0, "697 s"), (55_100.0, "15.3 h"), (187_000.0, "2.16 d")],
)
def test_long_times_are_told_in_hours_and_days(seconds, text):
    assert duration_text(seconds) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.055, "0.055"), (1.38889e-5, "0.0000138889"), (3.2e-9, "3.2e-09")]
)
def test_a_nominal_value_is_written_like_what_replaces_it(value, text):
    assert six_digits(value) == text


@pytest.mark.parametrize(("labels", "text"), [
    (["viscous_friction@arm_1", "viscous_friction@arm_2"], "viscous friction at arm 1 and arm 2"),
    (["exchange@T1 and T2"], "exchange between T1 and T2"),
    (["mass"], "mass"),
])  # fmt: skip
def test_effects_are_said_with_their_places(labels, text):
    assert by_place([effect_name(label) for label in labels]) == [text]


def test_what_is_left_of_a_number_is_no_zero():
    assert told(10.0, 3500.0) == "10"
    assert told(9010.0, 3500.0) == rounded(9010.0, 3500.0)
    assert told(0.0, 1.0) == "0"
