"""Control steps per second of the simulators, beside Gymnasium's Pendulum-v1.

Run with ``OMP_NUM_THREADS=1 pytest tests/benchmarks/test_simulator_speed.py --benchmark-only``.
Simulator and peer run in turns. The peer is Gymnasium's environment without its wrappers: per
step one semi-implicit Euler step of a pendulum without a motor, reward and observation; ours
solve the control period to the error in ``extra_info`` (RMS over random states, against an
adaptive Runge-Kutta method of order 8). Leo, for which the peer is only a unit of measure, is
stepped through what random voltages make of its start, feet on the ground for the most part;
its error is measured in ``tests/sims/test_leo.py``.

``-k effect`` times one control period with dry friction and play, the systems with one joint and
with two, alone and in batches.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

import estimator_data as data
import gymnasium
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.linear import Linear
from sims.effects import Backlash, CoulombFriction, Effect, StribeckFriction, ViscousFriction
from sims.environment import SimulatorEnv
from sims.equations import EquationOfMotion
from sims.host import HostSimulator
from sims.leo import Leo
from sims.leo.walking import Walking
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter, Simulator
from sims.tasks import SwingUp, Task

# Processor time of this one thread: another program on the core then does not count.
TIMER = time.thread_time
pytestmark = pytest.mark.benchmark(timer=TIMER)
STEPS = 500


@functools.cache
def corrected() -> CorrectedSimulator:
    """The idealised pendulum with a linear model of what it lacks."""
    rows, difference = data.observed(3750, seed=0, reach=12.0)
    model = DifferenceModel(Linear(), Pendulum())
    return CorrectedSimulator(
        Pendulum(), model.fit_difference(rows[:, :2], rows[:, 2:], difference)
    )


SIMULATORS: dict[str, Callable[[], Simulator]] = {
    "Pendulum": Pendulum,
    "PendulumEquation": PendulumEquation,
    "Pendulum + Linear": corrected,
    "Leo": Leo,
    "Leo, viscous friction": lambda: Leo(effects=[ViscousFriction("left_knee", 0.03)]),
    "Leo, dry friction": lambda: Leo(effects=[CoulombFriction("left_knee", 0.1)]),
}
WANTED = {"Pendulum": Pendulum, "PendulumEquation": Pendulum, "Pendulum + Linear": Pendulum.true}


def exact(simulator: Pendulum, states: np.ndarray, voltages: np.ndarray) -> np.ndarray:
    """The states one control period later, from the paper's equation of motion."""
    p = simulator.parameter_values()
    drive = p["torque_constant"] / p["resistance"]
    weight = p["mass"] * p["gravity"] * p["length"]
    friction = p["damping"] + drive * p["torque_constant"]

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        angle, rate = y.reshape(2, -1)
        torque = weight * np.sin(angle) - friction * rate + drive * voltages
        return np.concatenate([rate, torque / p["inertia"]])

    span = (0.0, simulator.dt)
    solution = solve_ivp(rates, span, states.T.ravel(), "DOP853", rtol=1e-12, atol=1e-12)
    return solution.y[:, -1].reshape(2, -1).T


def rows_of(simulator: Simulator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """States and actions to step from."""
    if not isinstance(simulator, Leo):
        inputs, _ = data.observed(n, seed=2, reach=12.0)
        return inputs[:, :2].copy(), inputs[:, 2:].copy()
    task, rng = Walking(start_at="around", knees="free"), np.random.default_rng(2)
    states, actions = np.empty((n, 18)), rng.uniform(-8.6, 8.6, (n, 6))
    state = task.start(rng)
    for i in range(n):
        states[i] = state
        state = simulator.step(state[None], actions[i : i + 1])[0]
        if task.terminal(state[None])[0]:
            state = task.start(rng)
    return states, actions


def task_of(simulator: Simulator) -> Task:
    """An episode that lasts as long as the actions."""
    if isinstance(simulator, Leo):
        return Walking(horizon=STEPS, start_at="around")
    return SwingUp(horizon=STEPS)


def measure(benchmark: Any, work: Callable[[], object], steps: int) -> None:
    """Time ``work``, and before each round as many steps of Gymnasium's pendulum as it has."""
    peer: Any = gymnasium.make("Pendulum-v1").unwrapped
    peer.reset(seed=0)
    inputs = np.random.default_rng(0).uniform(-2, 2, (STEPS, 1)).astype(np.float32)
    times = []

    def run_peer() -> None:
        start = TIMER()
        for action in inputs:
            peer.step(action)
        times.append(TIMER() - start)

    work()
    benchmark.pedantic(work, setup=run_peer, rounds=10)
    own = steps / benchmark.stats.stats.median
    other = STEPS / float(np.median(times[1:]))
    benchmark.extra_info.update(
        control_steps_per_second=own,
        gymnasium_steps_per_second=other,
        times_gymnasium=own / other,
    )


@pytest.mark.parametrize("rows", [1, 1024])
@pytest.mark.parametrize("name", SIMULATORS)
def test_simulator_speed(benchmark: Any, name: str, rows: int) -> None:
    simulator = SIMULATORS[name]()
    states, actions = rows_of(simulator, 1024)
    if rows == 1:
        pairs = [(states[i : i + 1], actions[i : i + 1]) for i in range(STEPS)]

        def work() -> object:
            return [simulator.step(*pair) for pair in pairs]
    else:

        def work() -> object:
            return simulator.step(states, actions)

    measure(benchmark, work, STEPS if rows == 1 else rows)
    benchmark.extra_info.update(simulator=name, rows=rows)
    if name in WANTED:
        error = simulator.step(states, actions) - exact(WANTED[name](), states, actions[:, 0])
        rms = np.sqrt(np.mean(error**2, axis=0))
        benchmark.extra_info.update(error_angle=float(rms[0]), error_rate=float(rms[1]))
        assert np.isfinite(rms).all()


@pytest.mark.parametrize("name", SIMULATORS)
def test_environment_speed(benchmark: Any, name: str) -> None:
    simulator = SIMULATORS[name]()
    env = SimulatorEnv(simulator, task_of(simulator))
    reach = np.array([channel.high for channel in simulator.action_channels])
    actions = np.random.default_rng(0).uniform(-reach, reach, (STEPS, len(reach)))

    def work() -> None:
        env.reset(seed=0)
        for action in actions:
            *_, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    measure(benchmark, work, STEPS)
    benchmark.extra_info.update(simulator=f"SimulatorEnv({name})", rows=1)


class DoublePendulum(EquationOfMotion):
    """Two point masses on rods in a row, hanging; a motor at each joint; 500 Hz."""

    dt = 0.002
    substeps = 2
    state_channels = (
        Channel("upper", "rad", "position", angle=True),
        Channel("lower", "rad", "position", angle=True),
        Channel("upper rate", "rad/s", "rate", rate_of="upper", scale=3.0),
        Channel("lower rate", "rad/s", "rate", rate_of="lower", scale=3.0),
    )
    action_channels = (
        Channel("upper torque", "N m", "input", scale=5.0),
        Channel("lower torque", "N m", "input", scale=2.0),
    )
    parameters = {
        "upper_mass": Parameter(1.0, "kg", "mass at the end of the upper rod", low=0.1),
        "lower_mass": Parameter(0.6, "kg", "mass at the end of the lower rod", low=0.1),
    }

    def acceleration(self, q: Any, v: Any, u: Any, force: Any, p: Any) -> np.ndarray:
        whole, rod, arm = p.upper_mass + p.lower_mass, 0.4, 0.3
        coupled = p.lower_mass * rod * arm
        cosine, sine = coupled * np.cos(q[:, 1]), coupled * np.sin(q[:, 1])
        second = p.lower_mass * arm * arm
        first = whole * rod * rod + second + 2 * cosine
        mixed = second + cosine
        low = 9.81 * p.lower_mass * arm * np.sin(q[:, 0] + q[:, 1])
        high = 9.81 * whole * rod * np.sin(q[:, 0]) + low
        turning = 2 * v[:, 0] * v[:, 1] + v[:, 1] * v[:, 1]
        a = u[:, 0] + force[:, 0] - high + sine * turning
        b = u[:, 1] + force[:, 1] - low - sine * v[:, 0] * v[:, 0]
        determinant = first * second - mixed * mixed
        return np.stack(
            [(second * a - mixed * b) / determinant, (first * b - mixed * a) / determinant], axis=1
        )


def effects_on(simulator: HostSimulator) -> dict[str, list[Effect]]:
    """What is timed, at strengths that stop and hold the joints now and then."""
    if isinstance(simulator, DoublePendulum):
        levels = {"upper": 0.5, "lower": 0.1}
        return {
            "none": [],
            "Coulomb": [CoulombFriction(name, level) for name, level in levels.items()],
            "Stribeck": [StribeckFriction(n, level, 2 * level, 0.3) for n, level in levels.items()],
        }
    return {
        "none": [],
        "Coulomb": [CoulombFriction("pivot", 2e-3)],
        "Stribeck": [StribeckFriction("pivot", 1e-3, 2.5e-3, 0.8)],
        "backlash": [Backlash("pivot", 0.2)],
    }


HOSTS = (Pendulum(), PendulumEquation(), DoublePendulum())
CASES = [(host, name) for host in HOSTS for name in effects_on(host)]


@pytest.mark.parametrize("rows", [1, 64, 2048])
@pytest.mark.parametrize(("host", "effects"), CASES, ids=[f"{h.name}-{e}" for h, e in CASES])
def test_effect_speed(benchmark: Any, host: HostSimulator, effects: str, rows: int) -> None:
    simulator = host.with_effects(effects_on(host)[effects])
    rng = np.random.default_rng(7)
    reach = [np.pi if c.angle else c.scale for c in host.state_channels]
    states = rng.uniform(-1, 1, (rows, len(reach))) * reach
    # A fifth of the rates rest, and a fifth is about to.
    slow = rng.choice([0.0, 0.03, 1.0], states.shape, p=[0.2, 0.2, 0.6])
    states = np.where([c.kind == "rate" for c in host.state_channels], slow * states, states)
    actions = rng.uniform(-1, 1, (rows, len(host.action_channels)))
    actions *= [channel.scale for channel in host.action_channels]
    start = simulator.augment(states, -actions)
    after = simulator.step(start, actions)
    benchmark.pedantic(simulator.step, args=(start, actions), rounds=20, warmup_rounds=1)
    benchmark.extra_info.update(
        simulator=host.name,
        effects=effects,
        rows=rows,
        microseconds_per_row=1e6 * benchmark.stats.stats.median / rows,
    )
    assert np.isfinite(after).all()
