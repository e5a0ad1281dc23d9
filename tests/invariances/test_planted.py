"""What is changed in a measured log, or in what its simulator knows, is named with its size.

The log is real, with all that is wrong with it, and yet the answer is known: the simulators hold
what docs/real-rigs.md says of each rig, and then one thing is put out by a known amount.
"""

import dataclasses

import numpy as np
import pytest
from answers import ask
from logs import DATA, Log, log

from sims import effects as known

#: What each nominal simulator lacks, by find_gap's answer about the log as it is.
LACKS = {
    "airtrack": [known.LinearSpring("position", 6.22)],
    "heater": [known.ActuatorLag("level", 17.3)],
    "pendulum-pair": [known.ParameterChange("payload", 0.846)],
    "pendulum-swingup": [
        known.CoulombFriction("angle", 0.165),
        known.ParameterChange("payload", 0.119),
        known.Delay("torque", 0.0152),
    ],
}


def known_wrong(name, share):
    """The simulator takes a parameter for a share of what it is."""

    def change(given):
        value = float(given.simulator.parameter_values()[name])
        wrong = given.simulator.with_parameters(**{name: share * value})
        return dataclasses.replace(given, simulator=wrong), (1 - share) * value

    return change


def commanded(made, size):
    """The commands are those of which what was applied would be made."""

    def change(given):
        runs = [
            dataclasses.replace(
                run, actions=made(run.times[: len(run.actions), None], np.asarray(run.actions))
            )
            for run in given.runs
        ]
        return dataclasses.replace(given, runs=tuple(runs)), size

    return change


def added(effect, size):
    """The simulator has something that is not there."""

    def change(given):
        simulator = given.simulator
        more = simulator.with_effects([*simulator.effects, effect])
        return dataclasses.replace(given, simulator=more), size

    return change


def lagged(times, applied):
    return applied + 0.03 * np.gradient(applied, times[:, 0], axis=0)


CASES = [
    ("airtrack", known_wrong("mass", 0.85), {"mass"}),
    ("heater", commanded(lambda _, u: u / 0.85, -0.15), {"actuator_gain@level", "gain"}),
    ("pendulum-pair", known_wrong("inertia", 0.8), {"inertia"}),
    ("pendulum-pair", known_wrong("moment", 1.2), {"moment"}),
    ("pendulum-pair", added(known.LinearSpring("angle", -0.6), 0.6), {"linear_spring@angle"}),
    ("pendulum-swingup", commanded(lambda _, u: u / 0.85, -0.15), {"actuator_gain@torque"}),
    ("pendulum-swingup", commanded(lambda _, u: u + 0.2 * np.sign(u), 0.2), {"dead_zone@torque"}),
    ("pendulum-swingup", commanded(lagged, 0.03), {"actuator_lag@torque"}),
]
QUICK = 2


@pytest.mark.skipif(not DATA.is_dir(), reason="no data: set SIMGAP_DATA")
@pytest.mark.parametrize(
    ("rig", "change", "accepted"),
    [
        pytest.param(*case, marks=[pytest.mark.long] * (place >= QUICK), id=f"{case[0]}-{place}")
        for place, case in enumerate(CASES)
    ],
)
def test_what_is_put_out_by_a_known_amount_comes_first_with_that_size(rig, change, accepted):
    measured = log(rig)
    repaired = Log(measured.simulator.with_effects(LACKS[rig]), measured.runs)
    given, size = change(repaired)
    first = next(v for v in ask(given).verdicts if v.kind in ("confirmed", "ambiguous"))
    assert accepted & {first.label, *first.same_motion}
    strength = next(iter(first.parameters.values()))
    assert strength.low <= size <= strength.high
    assert 0.5 < strength.value / size < 2.0
