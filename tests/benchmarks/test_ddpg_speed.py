"""DDPG's speed on one core: against stable-baselines3, and against its own matrix products.

Run with ``pytest tests/benchmarks/test_ddpg_speed.py --benchmark-only``. What is compared runs
in turns, and the ratios are in the ``extra_info`` of ``--benchmark-json``. "Same work" is ``STEPS``
steps of one environment with one update of batch 64 each, the same networks, 400
and 300 wide, float32.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch

from policy import DDPG, DDPGConfig, passes

# Processor time of this one thread: another program on the core then does not count.
TIMER = time.thread_time
pytestmark = pytest.mark.benchmark(timer=TIMER)
STEPS = 200
SIZES = {"pendulum": (3, 1), "leo": (17, 6)}


class Free(gymnasium.Env[np.ndarray, np.ndarray]):
    """An environment that costs next to nothing, of any size; episodes of 400 steps."""

    def __init__(self, observations: int, actions: int) -> None:
        self.observation_space = gymnasium.spaces.Box(-10, 10, (observations,))
        self.action_space = gymnasium.spaces.Box(-1, 1, (actions,))

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        self.k = 0
        self.x = self.np_random.normal(size=self.observation_space.shape).astype(np.float32)
        return self.x, {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        self.k += 1
        self.x = 0.9 * self.x
        self.x[0] += action[0]
        return self.x.astype(np.float32), -abs(float(self.x[0])), False, self.k == 400, {}


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(params=SIZES)
def env(request: pytest.FixtureRequest) -> gymnasium.Env[np.ndarray, np.ndarray]:
    return Free(*SIZES[request.param])


def trained(env: gymnasium.Env[np.ndarray, np.ndarray]) -> DDPG:
    agent = DDPG.for_env(env, DDPGConfig(warm_up=100))
    agent.learn(env, 300)
    return agent


def measure(
    benchmark: Any, work: Callable[[], Any], peer: Callable[[], Any] = lambda: None
) -> float:
    """Time ``work`` in rounds, before each of them ``peer``; returns the peer's median time."""
    times = []

    def run_peer() -> None:
        start = TIMER()
        peer()
        times.append(TIMER() - start)

    for _ in range(2):
        work()
        peer()
    benchmark.pedantic(work, setup=run_peer, rounds=10)
    return float(np.median(times))


def test_learn_against_stable_baselines3(benchmark, env):
    agent = trained(env)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peer = pytest.importorskip("stable_baselines3").DDPG(
            "MlpPolicy",
            env,
            policy_kwargs={"net_arch": [400, 300]},
            batch_size=64,
            buffer_size=300_000,
            tau=1e-3,
            learning_starts=100,
            train_freq=1,
            gradient_steps=1,
            seed=0,
            device="cpu",
        )
        peer.learn(300)
        before = agent.updates, peer._n_updates
        peer_time = measure(
            benchmark,
            lambda: agent.learn(env, STEPS),
            lambda: peer.learn(STEPS, reset_num_timesteps=False),
        )
    assert (agent.updates - before[0], peer._n_updates - before[1]) == (12 * STEPS, 12 * STEPS)
    own_time = benchmark.stats.stats.median
    benchmark.extra_info["steps_per_second"] = STEPS / own_time
    benchmark.extra_info["stable_baselines3_steps_per_second"] = STEPS / peer_time
    benchmark.extra_info["times_stable_baselines3"] = peer_time / own_time


Product = tuple[np.ndarray, np.ndarray, np.ndarray]


def products_of_an_update(agent: DDPG, monkeypatch: pytest.MonkeyPatch) -> list[Product]:
    """Both factors and the result of every matrix product of an update, in order."""
    noted: list[Product] = []
    dot = np.dot

    def noting(left: np.ndarray, right: np.ndarray, out: np.ndarray) -> np.ndarray:
        noted.append((left, right, out))
        return dot(left, right, out=out)

    with monkeypatch.context() as patch:
        for name in ("forward", "backward", "weight_gradients", "product"):
            patch.setattr(passes, name, getattr(passes, name).py_func)  # not compiled
        patch.setattr(np, "dot", noting)
        agent.update()
    return noted


def _operations(products: list[Product]) -> int:
    """Multiplications and additions in the products of one update."""
    return sum(2 * left.size * right.shape[1] for left, right, _ in products)


def _multiply(products: list[Product]) -> None:
    for _ in range(STEPS):
        for product in products:
            passes.product(*product)


def test_update_against_its_products(benchmark, env, monkeypatch):
    """The peer is the very products of one update, on the same arrays, without the rest.

    Unlike the update it calls them from Python; that is measured with products of one element
    and taken off.
    """
    agent = trained(env)
    products = products_of_an_update(agent, monkeypatch)
    assert _operations(products) > 10 * 2 * 64 * 400 * 300
    one = np.zeros((1, 1), np.float32)
    empty = [(one, one, one)] * len(products)
    large = np.random.default_rng(0).normal(size=(3, 1024, 1024)).astype(np.float32)
    peaks, calls = [], []

    def products_and_peak() -> None:
        start = TIMER()
        passes.product(*large)
        peaks.append(2 * 1024**3 / (TIMER() - start))
        start = TIMER()
        _multiply(empty)
        calls.append(TIMER() - start)
        _multiply(products)

    def update() -> None:
        for _ in range(STEPS):
            agent.update()

    peer_time = measure(benchmark, update, products_and_peak)
    peak = float(np.median(peaks))
    peer_time -= 2 * 1024**3 / peak + 2 * float(np.median(calls))
    own_time = benchmark.stats.stats.median
    operations = STEPS * _operations(products)
    benchmark.extra_info["updates_per_second"] = STEPS / own_time
    benchmark.extra_info["share_of_products"] = peer_time / own_time
    benchmark.extra_info["matrix_peak_gflop_per_second"] = peak / 1e9
    benchmark.extra_info["share_of_peak"] = operations / own_time / peak


def test_act_one_row(benchmark, env):
    agent = DDPG.for_env(env)
    observation, _ = env.reset(seed=0)
    measure(benchmark, lambda: [agent.act(observation) for _ in range(STEPS)])
    benchmark.extra_info["microseconds"] = 1e6 * benchmark.stats.stats.median / STEPS
