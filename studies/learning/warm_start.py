"""What a training takes over from those before it: the last networks, and what to learn again.

A policy that learns on with an empty replay forgets: its critic meets a few hundred transitions
of one way to move, and the returns collapse before they recover. All transitions simulated so far
are still right once the newest difference is added to what the nominal simulator said, so they
are kept as it said them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np

from policy.learner import Learner
from policy.replay import Seen
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from sims.environment import SimulatorEnv, judged, observe
from sims.simulator import Array

if TYPE_CHECKING:
    from studies.learning.training import Training

ReplayRule = Literal["first", "all"]
_ROWS = 8192  # predicted at a time


@dataclasses.dataclass(frozen=True)
class WarmStart:
    """The trainings on a simulator that came before one.

    Args:
        last: The last one, whose networks are trained on.
        rule: What is learnt from again: ``"first"``, from the second update on, what was
            simulated in the first one, as it is (paper, section III-C); ``"all"``, from the first
            on, all that was simulated, with the newest difference.
        trainings: Those that this concerns.
    """

    last: Training
    rule: ReplayRule
    trainings: tuple[Training, ...] = ()

    @classmethod
    def begin(cls, nominal: Training, rule: ReplayRule) -> WarmStart:
        """Before the first update."""
        return cls(nominal, rule, (nominal,) if rule == "all" else ())

    def then(self, training: Training) -> WarmStart:
        """After one more."""
        if self.rule == "first":
            return WarmStart(training, self.rule, self.trainings or (training,))
        return WarmStart(training, self.rule, (*self.trainings, training))

    def settings(self) -> dict[str, Any]:
        """What a training after these depends on, for its key."""
        return {"after": self.last.key, "again": [one.key for one in self.trainings]}

    @property
    def rows(self) -> int:
        """Transitions to learn from again."""
        return sum(len(one.simulated) for one in self.trainings if one.simulated)

    def fill(
        self,
        learner: Learner,
        env: SimulatorEnv,
        again: bool = False,
        tell: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Fill a learner's replay with what was simulated, as ``env`` would have it.

        Args:
            learner: Gets the transitions.
            env: What it is to learn in; if its simulator is a corrected one, so are they.
            again: Simulate them again, for an ``env`` whose simulator is another than theirs.
            tell: Told how many are done.
        """
        simulator, task, done = env.simulator, env.task, 0
        for training in self.trainings:
            if training.simulated is None:
                continue
            for states, actions, following in training.simulated.pieces():
                if again:
                    following = simulator.step(states, actions)
                elif self.rule == "all" and isinstance(simulator, CorrectedSimulator):
                    following = simulator.correct(states, actions, following)
                rewards, ends = judged(simulator, task, states, actions, following)
                seen, after = observe(simulator, states), observe(simulator, following)
                learner.remember(Seen(seen, actions, rewards, after, ends))
                done += len(states)
                tell(done)


@dataclasses.dataclass(frozen=True)
class Simulated:
    """Transitions of a training, in single precision: learning needs no more.

    Attributes:
        states, actions, next_states: shape (n, n_s), (n, n_a), (n, n_s).
    """

    states: np.ndarray
    actions: np.ndarray
    next_states: np.ndarray

    def __len__(self) -> int:
        return len(self.states)

    def pieces(self) -> list[tuple[Array, Array, Array]]:
        """The rows in double precision, some thousands at a time."""
        parts = [slice(k, k + _ROWS) for k in range(0, len(self), _ROWS)]
        return [
            (
                self.states[part].astype(float),
                self.actions[part].astype(float),
                self.next_states[part].astype(float),
            )
            for part in parts
        ]


class Recorder(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A simulator's environment that keeps the transitions it goes through.

    They lie in one array: a small one for each step, made between the large ones that networks
    come and go with, kept the allocator from using their memory again (7 GB in 120 000 steps).
    """

    def __init__(self, env: SimulatorEnv) -> None:
        super().__init__(env)
        self._rows = np.zeros((0, 0))
        self._count = 0
        self._state = np.zeros(0)

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        observation, info = self.env.reset(**options)
        self._state = info["state"]
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        step = self.env.step(action)
        following = step[-1]["state"]
        row = np.concatenate([self._state, np.ravel(action), following], dtype=float)
        if self._count == len(self._rows):
            more = np.zeros((max(_ROWS, self._count), len(row)))
            self._rows = np.concatenate([self._rows.reshape(-1, len(row)), more])
        self._rows[self._count] = row
        self._count += 1
        self._state = following
        return step

    def taken(self, difference: DifferenceModel | None = None) -> Simulated | None:
        """The transitions; None if there are none.

        Args:
            difference: Of the corrected simulator, to take off again: what is left is what the
                simulator below said.
        """
        if not self._count:
            return None
        n = len(self._state)
        parts = np.split(self._rows[: self._count], [n, self._rows.shape[1] - n], axis=1)
        states, actions, following = (part.copy() for part in parts)
        if difference is not None:
            for k in range(0, len(states), _ROWS):
                part = slice(k, k + _ROWS)
                following[part] -= difference.predict(states[part], actions[part])
        return Simulated(*(part.astype(np.float32) for part in (states, actions, following)))
