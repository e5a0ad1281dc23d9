"""Effects that no motion can tell apart are told with their sizes, and what they do to the rest."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects import ConstantLoad, ParameterChange
from sims.effects.library import library
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

MASS, LENGTH, ROTOR, FRICTION = 1.0, 0.2, 0.02, 0.03
DT = 0.02


class Arm(EquationOfMotion):
    """An arm that swings freely."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = ()
    parameters: ClassVar = {
        "mass": Parameter(MASS, "kg", "mass", low=0.01),
        "rotor": Parameter(0.005, "kg m^2", "rotor", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        inertia = p.mass * LENGTH**2 + p.rotor
        return ((force[:, 0] - 9.81 * p.mass * LENGTH * np.sin(q[:, 0])) / inertia)[:, None]


def swing(start):
    """The true arm: a heavy rotor, and friction."""
    inertia = MASS * LENGTH**2 + ROTOR

    def slope(_, x):
        return [x[1], (-9.81 * MASS * LENGTH * np.sin(x[0]) - FRICTION * x[1]) / inertia]

    times = np.arange(400) * DT
    found = solve_ivp(slope, (0, times[-1]), [start, 0.0], t_eval=times, rtol=1e-9, atol=1e-10)
    noise = np.random.default_rng(int(10 * start)).normal(0, [[1e-3], [1e-2]], found.y.shape)
    return Trajectory(f"{start} rad", times, (found.y + noise).T, np.zeros((399, 0)))


def looked_for(rotor):
    simulator = Arm().with_parameters(rotor=rotor)
    names = ("mass", "rotor", "viscous_friction", "coulomb_friction")
    offered = [effect for effect in library(simulator) if effect.name in names]
    return find_gap(simulator, [swing(start) for start in (0.8, 1.4)], effects=offered)


@pytest.fixture(scope="module")
def found():
    return looked_for(0.005)


def named(found, effect):
    return next(verdict for verdict in found.verdicts if verdict.effect == effect)


def test_the_size_of_a_twin_is_told(found):
    (rotor,) = named(found, "mass").meant
    assert rotor.effect == "rotor"
    value, unit = rotor.numbers["change"]
    assert value == pytest.approx(ROTOR - 0.005, rel=0.05)
    assert unit == "kg m^2"


def test_what_stands_beside_a_twin_has_an_interval_for_either(found):
    friction = named(found, "viscous_friction")
    number, (rotor,) = friction.parameters["coefficient"], friction.beside
    assert rotor.effect == "rotor"
    assert rotor.numbers["coefficient"][0] == pytest.approx(FRICTION, rel=0.05)
    # Beside a smaller mass the same motion is that of less friction.
    assert number.value < 0.5 * FRICTION
    assert number.low <= number.value < FRICTION <= number.high
    assert number.if_exact[1] < 0.5 * FRICTION


def test_a_twin_of_a_believable_size_stands_for_one_that_is_not():
    found = looked_for(0.001)  # of all inertia a fortieth; the mass would be a twentieth
    assert [v.effect for v in found.verdicts if v.kind == "confirmed"] == [
        "rotor", "viscous_friction",
    ]  # fmt: skip
    rotor = named(found, "rotor")
    assert rotor.same_motion == ("mass",)
    assert rotor.meant == ()
    assert rotor.parameters["change"].value == pytest.approx(ROTOR - 0.001, rel=0.02)
    friction = named(found, "viscous_friction").parameters["coefficient"]
    assert friction.value == pytest.approx(FRICTION, rel=0.02)


def test_a_twin_that_no_screen_knows_moves_as_what_it_is_a_twin_of():
    ready = prepare(Arm(), [swing(0.8), swing(1.4)], 0.4)
    mass, rotor, load = candidates(
        Arm(), (ParameterChange("mass"), ParameterChange("rotor"), ConstantLoad("angle")),
        ready.fitter.samples,
    )  # fmt: skip
    search = Search(Arm(), [mass, load], ready.fitter, twins={"mass": [rotor]})
    twin = search.candidates.index(rotor)
    assert search.same_motion((), 0, twin)
    assert not search.same_motion((), 1, twin)
    assert not search.same_motion((1,), 0, twin)  # beside a set that was never fitted
