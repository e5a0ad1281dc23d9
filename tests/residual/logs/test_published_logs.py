"""Logs that others published are read by their configs."""

import os
from pathlib import Path

import jsonargparse
import numpy as np
import pytest
from swings import STATES, kinds

from residual.logs import LogFormat, read_logs
from sims.simulator import Channel

ROOT = Path(__file__).parents[3]
DATA = Path(os.environ.get("SIMGAP_DATA", ROOT.parent / "shared" / "data"))

PENDULUM = (
    STATES,
    (Channel("torque", "N m", "input"),),
)


def drives(names):
    rates = (Channel(f"rate {n}", "rad/s", "rate", rate_of=f"angle {n}") for n in names)
    angles = (Channel(f"angle {n}", "rad", "position", angle=True) for n in names)
    return (*angles, *rates), tuple(Channel(f"torque {n}", "N m", "input") for n in names)


PUBLISHED = {
    "airtrack": (
        ["airtrack/real_linear_h_1.txt"],
        (
            Channel("position", "m", "position"),
            Channel("velocity", "m/s", "rate", rate_of="position"),
        ),
        (),
    ),
    "heater": (
        ["heater/data_step_test.csv"],
        (Channel("temperature", "K", "other"),),
        (Channel("level", "1", "input"),),
    ),
    "phone_drop": (
        ["phone-drop/phone_drop.csv"],
        (Channel("velocity", "m/s", "other"), Channel("acceleration", "m/s2", "other")),
        (),
    ),
    "pendulum_pair": (["pendulum-pair/run_b.csv"], *PENDULUM),
    "pendulum_swingup": (
        ["pendulum-swingup/run_ddp.csv", "pendulum-swingup/run_dircol.csv"],
        *PENDULUM,
    ),
    "arm_three_axes": (["arm-three-axes/run.csv"], *drives("146")),
    "arm_open_loop_torque": (["arm-open-loop-torque/run02.csv"], *drives("156")),
    "small_car_steps": (
        ["small-car-steps/run10.csv", "small-car-steps/run34.csv"],
        tuple(
            Channel(n, u, "other", angle=n == "heading")
            for n, u in {"x": "m", "y": "m", "heading": "rad", "speed": "m/s"}.items()
        ),
        (Channel("steering", "rad", "input"), Channel("speed_command", "m/s", "input")),
    ),
}
# Runs, samples, seconds of the first run, its first value of the last state channel.
FACTS = {
    "airtrack": (1, 434, 14.453, 37.178),
    "heater": (1, 401, 401.49, 299.53),
    "phone_drop": (38, 4994, 0.578918, -0.105576),
    "pendulum_pair": (1, 1100, 5.495386, -0.142857),
    "pendulum_swingup": (2, 4170, 5.99916, 0.120879),
    "arm_three_axes": (1, 2201, 4.4, np.nan),
    "arm_open_loop_torque": (1, 1087, 4.344, 0.20),
    "small_car_steps": (2, 242, 3.0, 0.386),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_logs_are_read_by_their_configs(name):
    if not DATA.is_dir():
        pytest.skip(f"no published logs in {DATA}; set SIMGAP_DATA")
    files, states, actions = PUBLISHED[name]
    parser = jsonargparse.ArgumentParser()
    parser.add_class_arguments(LogFormat, "columns", sub_configs=True)
    config = ROOT / "studies" / "configs" / "logs" / f"{name}.yaml"
    layout = parser.instantiate(parser.parse_args(["--columns", str(config)])).columns
    data = read_logs([DATA / file for file in files], states, actions, layout)
    runs, samples, seconds, first = FACTS[name]
    assert len(data.trajectories) == runs
    assert sum(len(run.times) for run in data.trajectories) == samples
    assert np.ptp(data.trajectories[0].times) == pytest.approx(seconds, abs=1e-4)
    assert data.trajectories[0].states[0, -1] == pytest.approx(first, abs=1e-3, nan_ok=True)
    assert "kinematics" not in kinds(data)
