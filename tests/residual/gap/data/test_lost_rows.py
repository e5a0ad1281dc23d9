"""Where rows were lost while a command changed, a log does not tell how commands are held."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.lost_rows import untimed_changes
from residual.gap.data.samples import Samples
from residual.gap.data.windows import fixed
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, LATE, TAU = 0.02, 0.04, 0.2


class Motor(FirstOrderSystem):
    """Its speed follows its command."""

    dt = DT
    state_channels = (Channel("speed", "rad/s", "rate", scale=5.0),)
    action_channels = (Channel("command", "1", "input", scale=5.0, low=-9.0, high=9.0),)
    parameters: ClassVar = {"tau": Parameter(TAU, "s", "time constant", low=0.01)}

    def derivative(self, x, u, p):
        return (u - x) / np.reshape(p.tau, (-1, 1))


def record(seed, rows=700, every=35):
    """A command that is held and comes late, exactly; of three changes one falls on lost rows."""
    rng = np.random.default_rng(seed)
    command, speed = np.repeat(rng.uniform(-8, 8, rows // every), every), [0.0]
    late = np.r_[[command[0]] * round(LATE / DT), command][:rows]
    for u in late[:-1]:
        speed.append(u + (speed[-1] - u) * np.exp(-DT / TAU))
    kept = np.ones(rows, bool)
    for change in range(every, rows, 3 * every):
        kept[change - 1 : change + 1] = False
    seen = np.array(speed)[kept, None] + rng.normal(0, 0.01, (kept.sum(), 1))
    return Trajectory(f"run {seed}", DT * np.flatnonzero(kept), seen, command[kept][:-1, None])


def test_windows_whose_changes_have_no_time_are_told():
    samples = Samples.join([record(0)], 1)
    untimed = untimed_changes(samples, fixed(samples, 33))
    assert untimed.any() and untimed.mean() < 0.5


@pytest.mark.parametrize("hold", [None, "zero"])
def test_a_delay_is_as_long_as_it_is_though_rows_were_lost(hold):
    runs = [record(seed) for seed in range(3)]
    found = find_gap(Motor(), runs, effects=("delay", "tau", "actuator_gain"), hold=hold)
    (delay,) = [v for v in found.verdicts if v.effect == "delay"]
    time = delay.parameters["time"]
    assert time.low <= LATE <= time.high and time.value == pytest.approx(LATE, abs=0.003)
    assert not any("run straight" in one.says for one in found.quality)
