"""A cart that runs into what its simulator does not know."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.trajectories import Trajectory
from sims.effects import LowerStop, UpperStop
from sims.effects.library import further_in
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, STIFF, SOFT, UPPER, LOWER = 0.01, 4000.0, 20.0, 0.2, -0.25


class Cart(EquationOfMotion):
    dt, substeps = DT, 4
    state_channels = (
        Channel("place", "m", "position", scale=0.2),
        Channel("speed", "m/s", "rate", rate_of="place", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", low=-10, high=10),)
    parameters = {"mass": Parameter(2.0, "kg", "mass"), "damping": Parameter(6.0, "N s/m", "oil")}

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] - p.damping * v[:, 0] + force[:, 0]) / p.mass)[:, None]


def logs(upper=np.inf, lower=-np.inf, seconds=8.0):
    rng, found = np.random.default_rng(4), []
    for run in range(4):
        rows = round(seconds / DT)
        pushes = np.repeat(rng.uniform(-8, 8, rows // 30 + 1), 30)[:rows]

        def rates(_, x, push):
            force = push - 6.1 * x[1]
            force -= max(STIFF * (x[0] - upper) + SOFT * x[1], 0.0) if x[0] > upper else 0.0
            force += max(STIFF * (lower - x[0]) - SOFT * x[1], 0.0) if x[0] < lower else 0.0
            return [x[1], force / 2.02]

        x, path = np.zeros(2), [np.zeros(2)]
        for push in pushes:
            x = solve_ivp(
                rates, (0, DT), x, rtol=1e-8, atol=1e-10, args=(push,), max_step=DT / 5
            ).y[:, -1]
            path.append(x)
        seen = np.array(path)
        seen[:, 0] += 3e-4 * rng.standard_normal(rows + 1)
        seen[:, 1] = np.nan
        found.append(Trajectory(f"run {run}", DT * np.arange(rows + 1), seen, pushes[:, None]))
    return found


def test_a_stop_is_looked_for_where_motion_ends_again_and_again():
    def sought(runs):
        cart = Cart()
        found = candidates(cart, further_in(cart), Samples.join(runs, 4))
        return {one.name for one in found if isinstance(one.effect, UpperStop | LowerStop)}

    assert sought(logs(UPPER, LOWER, 4.0)) == {"upper_stop", "lower_stop"}
    times = DT * np.arange(400)
    once = np.column_stack([0.3 * times, np.full(400, np.nan)])
    assert sought([Trajectory("one way", times, once, np.zeros((399, 1)))]) == set()


@pytest.mark.long
def test_bumpers_at_both_ends_are_named_with_their_places():
    result = find_gap(Cart(), logs(UPPER, LOWER))
    found = {v.effect: v.parameters for v in result.verdicts if v.kind == "confirmed"}
    assert set(found) == {"upper_stop", "lower_stop"}
    for name, place in (("upper_stop", UPPER), ("lower_stop", LOWER)):
        truth = {"stiffness": STIFF, "damping": SOFT, "at": place}
        for field, number in found[name].items():
            assert number.low <= truth[field] <= number.high, (name, field)
