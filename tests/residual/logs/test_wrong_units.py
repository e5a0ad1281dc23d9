"""Measured logs: units that are wrong by 57.3 are found."""

import numpy as np
import pytest
from swings import ACTIONS, DEG, STATES, error, kinds, read, swing, write

from residual.logs import Column, LogError, read_logs


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("speed", [2.0, 8.0])
def test_wrong_units_are_found_by_kinematics(csv, noise, wrap, speed):
    rng = np.random.default_rng(1)
    clean = swing(speed=speed)
    angle = clean["angle"] + 0.01 * noise * rng.standard_normal(200)
    rate = clean["rate"] + 0.2 * noise * rng.standard_normal(200)
    if wrap:
        angle = (angle + 2.0 + np.pi) % (2 * np.pi) - np.pi
    assert "kinematics" not in kinds(read(csv(angle=angle, rate=rate)))
    degrees = error(csv(angle=DEG * angle, rate=rate))
    assert "column 'angle'" in degrees and "looks like degrees" in degrees
    assert "set unit: deg" in degrees
    assert "'rate' looks like degrees per second" in error(csv(angle=angle, rate=DEG * rate))
    assert "set scale: -1" in error(csv(angle=angle, rate=-rate))
    # Stated as degrees, but it was radians.
    declared = {"angle": Column("angle", "deg"), "rate": "rate"}
    stated = error(csv(angle=angle, rate=rate), states=declared)
    assert "or if that is right set unit: rad for column 'angle'" in stated


def test_a_column_without_a_unit_is_suspected_before_one_with(csv):
    """Both would do: the angle is in degrees as stated, and the rate is, too."""
    log = csv(angle=DEG * swing()["angle"], rate=DEG * swing()["rate"])
    message = error(log, states={"angle": Column("angle", "deg"), "rate": "rate"})
    assert "column 'rate': 'rate' looks like degrees per second: set unit: deg/s" in message
    message = error(log, states={"angle": "angle", "rate": Column("rate", "deg/s")})
    assert "column 'angle': 'angle' looks like degrees: set unit: deg" in message


def test_scale_of_a_sensor_that_no_unit_explains_is_a_finding(csv):
    data = read(csv(rate=swing()["rate"] / 1.3))
    (finding,) = [finding for finding in data.findings if finding.kind == "kinematics"]
    assert finding.numbers["scale"] == pytest.approx(1.3, abs=0.02)


def test_rate_unrelated_to_its_position_is_a_finding(csv):
    (finding,) = [f for f in read(csv(rate=np.sin(swing()["time"]))).findings[:1]]
    assert finding.kind == "kinematics" and "or the wrong columns" in finding.says


def test_noise_alone_is_no_finding_about_kinematics(csv):
    rng = np.random.default_rng(3)
    for _ in range(20):
        angle = 0.01 * rng.standard_normal(200)
        rate = 0.2 * rng.standard_normal(200)
        assert "kinematics" not in kinds(read(csv(angle=angle, rate=rate)))


def test_one_file_in_degrees_among_many_is_found(tmp_path):
    good = [write(tmp_path / f"{n}.csv", swing()) for n in range(5)]
    columns = swing()
    bad = write(tmp_path / "bad.csv", columns | {"angle": DEG * columns["angle"]})
    with pytest.raises(LogError, match=r"bad\.csv: column 'angle'.*5 of 6 files look right"):
        read_logs([*good, bad], STATES, ACTIONS)
    worse = write(tmp_path / "worse.csv", columns | {"angle": DEG * columns["angle"]})
    with pytest.raises(LogError, match=r"bad\.csv: column 'angle'.*5 of 7 files look right"):
        read_logs([*good, bad, worse], STATES, ACTIONS)
    with pytest.raises(LogError) as all_wrong:
        read_logs([bad, worse], STATES, ACTIONS)
    assert "look right" not in str(all_wrong.value)


def test_degrees_without_a_measured_rate_are_found_by_plausibility(csv):
    clean = swing(speed=6.0)
    message = error(csv(angle=DEG * clean["angle"]), states={"angle": "angle"})
    assert "looks like degrees: set unit: deg (or unit: rad if that is right)" in message
    assert "the channel 'angle' turns by up to" in message
    both = error(csv(angle=DEG * clean["angle"], rate=DEG * clean["rate"]))
    assert "looks like degrees" in both
    compass = (DEG * 1.5 * clean["time"]) % 360
    assert "jumps by about 360" in error(csv(angle=compass), states={"angle": "angle"})


def test_what_turns_a_dozen_times_faster_than_usual_is_read(csv):
    quick = {"angle": 12 * swing()["time"], "rate": np.full(200, 12.0)}
    assert "kinematics" not in kinds(read(csv(**quick)))


def test_exchanged_columns_are_refused_as_such(csv):
    columns = swing()
    message = error(csv(angle=columns["rate"], rate=columns["angle"]))
    assert "columns 'angle' and 'rate' look exchanged" in message and "--columns" in message


def test_a_wrong_sign_may_be_that_of_either_column(csv):
    message = error(csv(angle=-swing()["angle"]))
    assert "'rate' has the wrong sign: set scale: -1" in message
    assert "or if that is right set scale: -1 for column 'angle'" in message


def test_stating_the_unit_settles_the_matter(csv):
    fast = {"angle": 250 * swing()["time"], "rate": np.full(200, 250.0)}
    assert "set unit: deg" in error(csv(**fast))
    stated = {"angle": Column("angle", "rad"), "rate": Column("rate", "rad/s")}
    assert len(read(csv(**fast), states=stated).trajectories) == 1


def test_an_angle_cut_at_a_turn_or_late_stamps_are_no_degrees(csv):
    clean = swing()
    step, place = np.diff(clean["time"])[0], np.arange(200)
    spin = (2 * np.pi / 20 * place + np.pi) % (2 * np.pi) - np.pi
    read(csv(angle=spin), states={"angle": "angle"})
    north = (0.1 * np.sin(place)) % (2 * np.pi)  # a compass that hovers about its zero
    read(csv(time=0.2 * step * place, angle=north), states={"angle": "angle"})
    bunches = step * (4 * (place // 4) + 0.01 * (place % 4))
    read(csv(time=bunches, angle=clean["angle"]), states={"angle": "angle"})
