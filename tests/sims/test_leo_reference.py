"""The oracle for Leo keeps energy and agrees with a library's integrator."""

import leo_reference as reference
import numpy as np
from leo_rows import flying, standing
from scipy.integrate import solve_ivp


def test_without_motors_energy_is_kept_in_flight():
    states, _ = flying(6)
    system = reference.System(torque_constant=1e-9, slope=0.1)
    after = reference.step(states, np.zeros((6, 6)), system, h=2e-4, dt=0.2)
    change = reference.energy(after, system) - reference.energy(states, system)
    assert np.abs(change).max() < 1e-4


def test_flight_agrees_with_a_stiff_integrator():
    states, actions = flying(2)
    found = reference.step(states, actions, h=1e-4)
    for state, volts, ours in zip(states, actions, found, strict=True):

        def rates(_, y, volts=volts):
            u, w = y[None, :9], y[None, 9:]
            return np.r_[y[9:], reference.accelerate(reference.System(), u, w, volts[None])[0]]

        start = np.r_[reference.TO_ABSOLUTE @ state[:9], reference.TO_ABSOLUTE @ state[9:]]
        y = solve_ivp(rates, (0, 0.03), start, "Radau", rtol=1e-7, atol=1e-9).y[:, -1]
        np.testing.assert_allclose(ours[:9], reference.TO_POSE @ y[:9], atol=1e-5)
        np.testing.assert_allclose(ours[9:], reference.TO_POSE @ y[9:], atol=5e-4)


def test_without_gravity_and_motors_momentum_is_kept():
    states, _ = flying(6)
    system = reference.System(torque_constant=1e-9, gravity=0.0)
    body = reference._Body(system, 6)

    def momentum(states):
        u = states[:, :9] @ reference.TO_ABSOLUTE.T
        w = states[:, 9:] @ reference.TO_ABSOLUTE.T
        return np.einsum("nij,nj->ni", body.mechanics(u, w)[0], w)[:, :2]

    after = reference.step(states, np.zeros((6, 6)), system, h=1e-4)
    np.testing.assert_allclose(momentum(after), momentum(states), atol=1e-4)


def test_standing_wheels_stay_where_they_are_and_above_the_ground():
    state, joints = standing()
    states = state[None]
    for _ in range(8):
        states = reference.step(states, np.clip(30 * (joints - states[:, 3:9]), -8, 8), h=1e-3)
        assert reference.gaps(states).min() > -1e-9
    wheels = [reference._wheels(s[None, :9] @ reference.TO_ABSOLUTE.T) for s in (state, states[0])]
    assert np.abs(wheels[0][0] - wheels[1][0]).max() < 2e-3


def test_stops_hold():
    state, actions = flying(1)
    state[:, 2:] = 0.0
    actions[:] = 8.6
    system = reference.System(stops=True)
    for _ in range(6):
        state = reference.step(state, actions, system, h=1e-3)
        assert (state[:, 3:9] < reference.STOPS[:, 1] + 1e-6).all()
