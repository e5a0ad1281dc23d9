"""What a robot's sensors make of its state, and an environment that shows no more than that."""

from __future__ import annotations

import dataclasses
from typing import Any

import gymnasium
import numpy as np

from sims.environment import observe
from sims.estimation import Belief, begun, predicted, updated, usual_push
from sims.simulator import Array, Simulator

#: What the simulator at hand may miss in one control period, in scales of the rates.
MISSED = 0.2


@dataclasses.dataclass(frozen=True)
class Measurement:
    """What is measured of the states of a true system; by default all of it, without error.

    Args:
        noise: Standard deviation for each state channel in its unit, such as 0.01 0.2 of an angle
            in rad and a rate in rad/s; none for no noise.
        steps: Step of the reading for each state channel in its unit, 0 for none.
        delay: Control periods by which a reading is late.
        unmeasured: State channels without a sensor.
    """

    noise: tuple[float, ...] = ()
    steps: tuple[float, ...] = ()
    delay: int = 0
    unmeasured: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return any(self.noise) or any(self.steps) or self.delay > 0 or bool(self.unmeasured)

    def check(self, simulator: Simulator) -> None:
        """Raise ``ValueError`` unless it fits a simulator's state channels."""
        names = [channel.name for channel in simulator.state_channels]
        for name in ("noise", "steps"):
            values = getattr(self, name)
            if values and (len(values) != len(names) or not min(values) >= 0):
                raise ValueError(
                    f"measure.{name} is {list(values)}, expected a number from 0 for each of "
                    f"{', '.join(names)}"
                )
        if unknown := [name for name in self.unmeasured if name not in names]:
            raise ValueError(
                f"measure.unmeasured: there is no state channel {', '.join(unknown)}, only "
                f"{', '.join(names)}"
            )
        if len(set(self.unmeasured)) == len(names):
            raise ValueError("measure.unmeasured: at least one state channel must be measured")
        if self.delay < 0:
            raise ValueError(f"measure.delay is {self.delay}, expected 0 or more control periods")
        if self and any(channel.kind == "memory" for channel in simulator.state_channels):
            raise ValueError(
                f"measure: {simulator.name} has hidden memory, which no measurement can tell"
            )

    def sigma(self, simulator: Simulator) -> Array:
        """Standard deviation of a reading, its step included, shape (n_s,)."""
        n = len(simulator.state_channels)
        noise, steps = (np.array(v or (0.0,) * n, float) for v in (self.noise, self.steps))
        least = 1e-6 * np.array([channel.scale for channel in simulator.state_channels])
        return np.maximum(np.sqrt(noise**2 + steps**2 / 12), least)

    def read(self, simulator: Simulator, state: Array, rng: np.random.Generator) -> Array:
        """One reading of a state, shape (n_s,); NaN where there is no sensor."""
        seen = np.array(state, float)
        if self.noise:
            seen += np.array(self.noise) * rng.standard_normal(len(seen))
        if self.steps:
            steps = np.array(self.steps)
            seen = np.where(steps > 0, np.round(seen / np.where(steps > 0, steps, 1)) * steps, seen)
        names = [channel.name for channel in simulator.state_channels]
        return np.where(np.isin(names, self.unmeasured), np.nan, seen)


class MeasuredEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A true system seen through its sensors, and a filter that makes a state of what they show.

    The observation is made of a Kalman filter's estimate, whose model is the simulator at hand;
    a late reading corrects the state that it is of, and the actions since carry that on. Rewards,
    and ``info["state"]``, are the true ones; ``info["measured"]`` is the reading.

    Args:
        env: The true system, with ``info["state"]``.
        nominal: The simulator at hand.
        measurement: What is measured.

    Raises:
        ValueError: The measurement does not fit the simulator.
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], nominal: Simulator, measurement: Measurement
    ) -> None:
        super().__init__(env)
        measurement.check(nominal)
        self.nominal, self.measurement = nominal, measurement
        self._sigma = measurement.sigma(nominal)
        self._push = usual_push(nominal, MISSED)

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        """As the environment's; before the first reading there was no motion."""
        _, info = self.env.reset(**options)
        self._waiting = [self._read(info)] * (self.measurement.delay + 1)
        self._actions: list[Array] = []
        self._belief = begun(self.nominal, self._waiting[0], self._sigma)
        return self._observation(), info | {"measured": self._waiting[0]}

    def step(self, action: Any) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
        """As the environment's, seen through the sensors."""
        _, reward, terminated, truncated, info = self.env.step(action)
        self._waiting = [*self._waiting[1:], self._read(info)]
        self._actions.append(np.asarray(action, float))
        if len(self._actions) > self.measurement.delay:
            acted = self._actions.pop(0)
            before, _ = predicted(self.nominal, self._belief, acted, self._push)
            self._belief = updated(self.nominal, before, self._waiting[0], self._sigma)
        info = info | {"measured": self._waiting[0]}
        return self._observation(), float(reward), terminated, truncated, info

    def _read(self, info: dict[str, Any]) -> Array:
        state = info["state"][: len(self.nominal.state_channels)]
        return self.measurement.read(self.nominal, state, self.np_random)

    def _observation(self) -> np.ndarray:
        belief: Belief = self._belief
        for action in self._actions:
            belief = Belief(
                self.nominal.step(belief.mean[None], action[None])[0], belief.covariance
            )
        return observe(self.nominal, belief.mean[None])[0]
