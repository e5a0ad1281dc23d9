"""What the studies ask of an algorithm, and how one is named: DDPG, or one of another library."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import gymnasium
from numpy.typing import NDArray

from policy.config import DDPGConfig
from policy.ddpg import DDPG, Progress
from policy.evaluate import Policy
from policy.files import OtherForm, content_of, read_arrays
from policy.observations import StateColumns
from policy.replay import Seen
from policy.scaling import Scaling

OURS = "policy.DDPG"
# What the loop gives itself.
_GIVEN = ("env", "seed")


class Learner(Protocol):
    """An off-policy algorithm on its way; methods as those of ``policy.DDPG``."""

    @property
    def policy(self) -> Policy:
        """The current policy without noise; it changes as the learner learns."""
        ...

    @property
    def updates(self) -> int:
        """Updates of the networks so far."""
        ...

    def learn(
        self,
        env: gymnasium.Env[Any, Any],
        steps: int,
        callback: Callable[[Progress], bool | None] | None = None,
        every: int = 1000,
        random_steps: int = 0,
    ) -> None:
        """Act in ``env`` and learn."""
        ...

    def remember(self, seen: Seen) -> None:
        """Add transitions to the replay."""
        ...

    def networks(self) -> dict[str, NDArray[Any]]:
        """A copy of what was learnt, by name."""
        ...

    def restore(self, networks: dict[str, NDArray[Any]]) -> None:
        """Return to such a copy."""
        ...

    def save(self, path: str | Path, replay: bool = False) -> None:
        """Write what was learnt to a file."""
        ...


@dataclasses.dataclass(frozen=True)
class Algorithm:
    """Which algorithm learns, and its settings.

    Args:
        path: ``"policy.DDPG"``, or the import path of an off-policy algorithm of
            Stable-Baselines3, such as ``"stable_baselines3.SAC"``.
        ddpg: Settings of ``policy.DDPG``.
        options: Settings of any other algorithm: keyword arguments of its class.

    Raises:
        ValueError: There is no such class, it is not off-policy, or its library is not installed.
    """

    path: str = OURS
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)
    options: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.path == OURS and self.options:
            raise ValueError(f"the options of {OURS} are those of ddpg, not {dict(self.options)}")
        known = inspect.signature(self.kind()).parameters
        if unknown := [name for name in self.options if name not in known]:
            raise ValueError(
                f"{self.path} has no option {', '.join(unknown)}, it has "
                f"{', '.join(name for name in known if name not in _GIVEN)}"
            )

    def kind(self) -> type[Any]:
        """The class."""
        if self.path == OURS:
            return DDPG
        from policy.stable_baselines import off_policy_class

        return off_policy_class(self.path)

    def make(
        self,
        env: gymnasium.Env[Any, Any],
        seed: int,
        noise_sigma: float | None = None,
        scaling: Scaling | None = None,
        columns: StateColumns | None = None,
    ) -> Learner:
        """A learner before any training.

        Args:
            env: For its spaces.
            seed: Everything random follows from it.
            noise_sigma: Exploration noise of DDPG, if not that of its settings; other algorithms
                explore in their own way.
            scaling: Of what its networks see; by default none.
            columns: Of the states that the observations of ``env`` are made of, if it is known.
        """
        if self.path != OURS:
            from policy.stable_baselines import StableBaselines

            return StableBaselines(self.kind(), self.options, env, seed, scaling, columns)
        config = self.ddpg
        if noise_sigma is not None:
            config = dataclasses.replace(config, noise_sigma=noise_sigma)
        return DDPG.for_env(env, config, seed, scaling, columns)

    def load(self, path: Path, env: gymnasium.Env[Any, Any]) -> Learner:
        """A learner with what another one of this algorithm has saved.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: The file is damaged or of another algorithm, or its options were others.
        """
        if self.path == OURS:
            return DDPG.load(path)
        from policy.stable_baselines import FORMAT

        arrays, metadata = read_arrays(path, FORMAT)
        with content_of(path, "policy"):
            columns = StateColumns.taken_from(metadata)
        learner = self.make(env, 0, columns=columns)
        try:
            learner.restore(arrays)
        except ValueError as error:
            raise ValueError(f"{path} holds {error}") from error
        return learner

    @property
    def warm_up(self) -> int:
        """Transitions that an empty replay needs before anything is learnt."""
        if self.path == OURS:
            return self.ddpg.warm_up
        return int(self.options.get("learning_starts", 100))


def other_name(path: str | None) -> str:
    """The class of an algorithm by its import path; empty if it is ours."""
    return "" if path in (None, OURS) else str(path).rsplit(".", 1)[-1]


def imported(path: str, what: str) -> Any:
    """What an import path names.

    Args:
        path: ``"package.module.Name"``.
        what: In words, for the error.

    Raises:
        ValueError: There is no such thing.
    """
    module, _, name = path.rpartition(".")
    if not module:
        package = "stable_baselines3" if what == "learner" else "my_file"
        name = path if what == "learner" else "NAME"
        raise ValueError(f"{what} {path!r} is no import path: write {package}.{name}")
    if name == "py":
        raise ValueError(f"{what} {path!r} is a file: write the name in it, too, {module}.NAME")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"no {what} {path!r}: {error}") from None


def load_policy(path: str | Path) -> Policy:
    """A policy from a file of ``DDPG.save`` or ``MlpPolicy.save``, or by its import path.

    One that the loop learnt acts on states in the units of the system's channels,
    ``load_policy(path).act_on(state)``. Its ``act`` takes what the loop's environments observe:
    channels divided by their scale, angles as cosine and sine. Any other file knows no channels,
    and only has ``act``. Files name no code, so one of another algorithm is read by
    ``Algorithm.load``.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: The file holds something else, or there is nothing at the import path.
    """
    from policy.mlp import MlpPolicy

    by_name = not str(path).endswith(".safetensors") and "/" not in str(path)
    if by_name and "." not in str(path) and not Path(path).exists():
        raise FileNotFoundError(
            f"there is no file {path}: give a policy's .safetensors file, or an import path such "
            "as my_file.POLICY"
        )
    if by_name and not Path(path).exists():
        found = imported(str(path), "policy")
        return found() if isinstance(found, type) else found
    try:
        return MlpPolicy.load(path)
    except OtherForm:
        return DDPG.load(path).policy
