"""A parameter that follows what was measured is named and added; it is not certain beside more."""

import numpy as np
import pytest
from held import path
from trolley import Trolley
from trolley import record as trolley

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter
from sims.effects import ParameterCurve
from studies.gap.summary import summary

DT, ROWS = 0.05, 1200
#: What may be missing.
ASKED = ("resistance", "inertia", "coulomb_friction")


class Motor(FirstOrderSystem):
    """A motor that warms by what it takes up."""

    dt = DT
    substeps = 2
    state_channels = (
        Channel("speed", "rad/s", "rate", scale=100.0),
        Channel("temp", "degC", "other", scale=60.0),
    )
    action_channels = (Channel("volts", "V", "input", scale=12.0, low=-24, high=24),)
    parameters = {
        "resistance": Parameter(1.2, "ohm", "of the winding", low=0.05),
        "torque_constant": Parameter(0.05, "N m/A", "of the motor", low=1e-3),
        "inertia": Parameter(2e-4, "kg m^2", "of the rotor", low=1e-6),
        "cooling": Parameter(0.15, "W/K", "by the air", low=0.0),
    }

    def derivative(self, x, u, p):
        speed, temp = x[:, 0], x[:, 1]
        current = (u[:, 0] - p.torque_constant * speed) / p.resistance
        heat = p.resistance * current**2 - p.cooling * (temp - 22.0)
        turned = (p.torque_constant * current - 1e-4 * speed) / p.inertia
        return np.stack([turned, heat / 3.0], axis=1)


def motor(seed, by_degree, ripple=0.0):
    """A record of one whose copper has its resistance at 45 degC; ripple by the speed."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-20, 20, ROWS // 25 + 1), 25)[:ROWS]

    def rates(_, x, volts):
        resistance = 1.2 * (1 + by_degree * (x[1] - 45.0))
        current = (volts - 0.05 * x[0]) / resistance
        torque = 0.05 * current - 1e-4 * x[0] + ripple * np.sin(x[0] / 20.0)
        return [torque / 2e-4, (resistance * current**2 - 0.15 * (x[1] - 22.0)) / 3.0]

    states = path(rates, [0.0, 22.0], volts[:-1], DT, atol=1e-9)
    seen = states + rng.standard_normal((ROWS, 2)) * [0.3, 0.1]
    return Trajectory(f"run {seed}", DT * np.arange(ROWS), seen, volts[:-1, None])


@pytest.mark.long
def test_a_resistance_that_rises_as_it_warms_is_confirmed_at_its_size():
    result = find_gap(Motor(), [motor(seed, 0.0039) for seed in (1, 2)], effects=ASKED)
    (curve,) = [effect for effect in result.effects if isinstance(effect, ParameterCurve)]
    assert str(curve) == "parameter_curve@resistance over temp"
    (verdict,) = [v for v in result.verdicts if v.effect == curve.name]
    assert verdict.kind == "confirmed" and result.changing is None
    for field, number in verdict.parameters.items():
        at, _ = curve.point_of(field)
        assert number.low <= 1.2 * 0.0039 * (at - 45.0) <= number.high
    told = " ".join(summary(result).split())
    assert "of the gap is resistance that changes with temp" in told
    assert "resistance that changes with temp: change −0.1" in told and "degC" in told


@pytest.mark.long
def test_a_parameter_that_nobody_asks_for_is_no_curve():
    result = find_gap(Motor(), motor(1, 0.0039), effects=("inertia", "coulomb_friction"))
    assert not any(isinstance(effect, ParameterCurve) for effect in result.effects)


@pytest.mark.long
def test_it_can_be_asked_for_over_what_the_log_holds():
    records = [motor(seed, 0.0039) for seed in (1, 2)]
    asked = "parameter_curve@resistance over temp"
    result = find_gap(Motor(), records, effects=[asked])
    (curve,) = result.effects
    seen = np.concatenate([record.states[:, 1] for record in records])
    assert str(curve) == asked
    assert curve.reach == pytest.approx((seen.min(), seen.max()), rel=0.01)


@pytest.mark.long
def test_beside_what_has_no_name_it_is_not_certain():
    record = motor(3, 0.0039, ripple=3e-3)
    result = find_gap(Motor(), record, effects=("resistance", "coulomb_friction"))
    (verdict,) = [v for v in result.verdicts if v.effect == ParameterCurve.name]
    assert verdict.kind == "ambiguous" and "law" in verdict.doubts
    assert "unexplained" in [v.kind for v in result.verdicts]


def test_a_resistance_that_stays_is_no_curve():
    result = find_gap(Motor(), motor(5, 0.0), effects=ASKED)
    assert not result.effects and result.changing is None


@pytest.mark.long
def test_two_that_make_the_same_motion_are_both_told():
    """A damper that follows the place and a spring that follows the speed."""

    def damping(place):
        return 1.0 + 0.45 * place

    records = [trolley(seed, lambda _: 20.0, damping=damping) for seed in (6, 7)]
    result = find_gap(Trolley(), records)
    (verdict,) = [v for v in result.verdicts if v.effect == ParameterCurve.name]
    assert verdict.kind == "ambiguous"
    both = {verdict.label, *verdict.alternatives, *verdict.form, *verdict.same_motion}
    assert {"parameter_curve@damping over place", "parameter_curve@stiffness over speed"} <= both
