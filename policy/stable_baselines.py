"""Off-policy algorithms of Stable-Baselines3 as learners.

Their own files hold pickles, so only the arrays of their networks are kept. Optimisers begin anew
in every training.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from policy.ddpg import Progress
from policy.files import write_arrays
from policy.observations import StateColumns, finite, observation_of
from policy.replay import Seen
from policy.scaling import ScaledEnv, Scaling

if TYPE_CHECKING:
    from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

FORMAT = "simgap.stable_baselines.1"
_ENTROPY = "log_ent_coef"

#: Exploration noise of an algorithm whose policy has none of its own, as a share of the bounds:
#: that of Fujimoto, van Hoof and Meger, Addressing Function Approximation Error (2018). The
#: library's default is none at all.
EXPLORATION = 0.1


def off_policy_class(path: str) -> type[OffPolicyAlgorithm]:
    """An off-policy algorithm by its import path.

    Raises:
        ValueError: There is none, it learns on-policy, or the library is not installed.
    """
    from policy.learner import imported

    try:
        from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
    except ImportError:
        raise ValueError(
            f"learner {path!r} needs Stable-Baselines3: `pip install stable-baselines3`"
        ) from None
    kind = imported(path, "learner")
    if not (isinstance(kind, type) and issubclass(kind, OffPolicyAlgorithm)):
        raise ValueError(
            f"learner {path!r} is no off-policy algorithm of Stable-Baselines3: DDPG, TD3, SAC and "
            "the like learn from a replay, which the loop needs"
        )
    return kind


class StableBaselines:
    """An algorithm of Stable-Baselines3 with the methods of ``policy.DDPG``.

    Args:
        kind: Its class.
        options: Keyword arguments of it; the policy is ``"MlpPolicy"`` unless they say otherwise,
            and ``action_noise`` may be a number: the standard deviation of normal exploration
            noise as a share of the actions' bounds, for DDPG and TD3 0.1 unless they say otherwise.
        env: For the spaces.
        seed: Seed of everything random; the library also sets the global generators by it.
        scaling: Of what the networks see; by default none.
        columns: Of the states that observations are made of; without them ``act_on`` refuses.

    Attributes:
        model: The algorithm itself.
    """

    def __init__(
        self,
        kind: type[OffPolicyAlgorithm],
        options: Mapping[str, Any],
        env: gymnasium.Env[Any, Any],
        seed: int = 0,
        scaling: Scaling | None = None,
        columns: StateColumns | None = None,
    ) -> None:
        from stable_baselines3 import TD3
        from stable_baselines3.common.logger import Logger
        from stable_baselines3.common.noise import NormalActionNoise

        # Copied, since the library adds to what it is given.
        given = copy.deepcopy(dict(options))
        chosen: dict[str, Any] = {"policy": "MlpPolicy", "device": "cpu"} | given
        if issubclass(kind, TD3):  # DDPG is one, too.
            chosen.setdefault("action_noise", EXPLORATION)
        if isinstance(sigma := chosen.get("action_noise"), int | float):
            zeros = np.zeros(env.action_space.shape or ())
            chosen["action_noise"] = NormalActionNoise(zeros, zeros + sigma)
        self._seed = seed % 2**32
        self.columns = columns
        self.scaling = scaling or Scaling.none(int(np.prod(env.observation_space.shape or ())))
        try:
            self.model: Any = kind(env=env, seed=self._seed, **chosen)
        except AssertionError as error:  # such as an algorithm for discrete actions alone
            raise ValueError(f"learner {kind.__name__} does not fit: {error}") from error
        if not {"verbose", "tensorboard_log"} & chosen.keys():
            # Else it leaves a folder for its log in the system's temporary one.
            self.model.set_logger(Logger(folder=None, output_formats=[]))
        self._remembered = 0

    @property
    def policy(self) -> StableBaselines:
        """Itself, since it acts."""
        return self

    def act(self, observation: ArrayLike) -> NDArray[Any]:
        """Action(s) without noise; arguments and errors as in ``MlpPolicy.act``."""
        seen = self.scaling.seen(finite(observation))
        return self.model.predict(seen, deterministic=True)[0]

    def act_on(self, state: ArrayLike) -> NDArray[Any]:
        """Action(s) for a state; arguments and errors as in ``MlpPolicy.act_on``."""
        return self.act(observation_of(state, self.columns))

    @property
    def updates(self) -> int:
        """Updates of the networks so far."""
        return int(self.model._n_updates)

    def learn(
        self,
        env: gymnasium.Env[Any, Any],
        steps: int,
        callback: Callable[[Progress], bool | None] | None = None,
        every: int = 1000,
        random_steps: int = 0,
    ) -> None:
        """As ``DDPG.learn``; the algorithm has random first steps of its own."""
        from stable_baselines3.common.callbacks import BaseCallback

        class Watch(BaseCallback):
            def _on_step(self) -> bool:
                step = self.num_timesteps
                told = callback and (step % every == 0 or step == steps)
                return not (told and callback and callback(Progress(step, steps, ())))

        if self._remembered:
            self.model.learning_starts = 0
        if steps:
            self.model.set_env(ScaledEnv(env, self.scaling))
            # What happened to the global generators since the start shall not matter.
            self._seed = (self._seed + 1) % 2**32
            self.model.set_random_seed(self._seed)
            self.model.learn(steps, Watch(), reset_num_timesteps=True)

    def remember(self, seen: Seen) -> None:
        """Add transitions to the replay; of more than fit the last remain."""
        memory: Any = self.model.replay_buffer
        rows = zip(
            self.scaling.seen(seen.observations), self.scaling.seen(seen.next_observations),
            self.model.policy.scale_action(np.asarray(seen.actions)),
            self.scaling.reward * np.asarray(seen.rewards),
            np.asarray(seen.terminated), strict=True,
        )  # fmt: skip
        for observation, following, action, reward, ended in rows:
            memory.add(
                observation[None], following[None], action[None],
                np.array([reward]), np.array([ended]), [{}],
            )  # fmt: skip
            self._remembered += 1

    def networks(self) -> dict[str, NDArray[Any]]:
        """A copy of all networks by name, for ``restore``."""
        state = self.model.policy.state_dict()
        found = {name: value.detach().cpu().numpy().copy() for name, value in state.items()}
        if (entropy := getattr(self.model, _ENTROPY, None)) is not None:
            found[_ENTROPY] = entropy.detach().cpu().numpy().copy()
        return found | self.scaling.arrays()

    def restore(self, networks: dict[str, NDArray[Any]]) -> None:
        """Return to a copy from ``networks``.

        Raises:
            ValueError: The copy is from other networks.
        """
        import torch

        networks = dict(networks)
        self.scaling = Scaling.taken_from(networks, len(self.scaling.middle))
        tensors = {name: torch.as_tensor(value) for name, value in networks.items()}
        entropy = tensors.pop(_ENTROPY, None)
        try:
            self.model.policy.load_state_dict(tensors)
        except RuntimeError as error:
            # Its first line says of which class, each other one what does not fit.
            first = [line.strip() for line in str(error).splitlines() if line.strip()][1:2]
            raise ValueError(
                "networks of another algorithm or size: give the class and the options that they "
                f"were learnt with ({' '.join(first):.120})"
            ) from None
        if entropy is not None:
            with torch.no_grad():
                getattr(self.model, _ENTROPY).copy_(entropy)

    def save(self, path: str | Path, replay: bool = False) -> None:
        """Write the networks to a safetensors file; a replay cannot be kept."""
        kind = type(self.model)
        name = f"{kind.__module__}.{kind.__qualname__}"
        columns = self.columns.plain() if self.columns else {}
        write_arrays(path, FORMAT, self.networks(), {"algorithm": name, **columns})
