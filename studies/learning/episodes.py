"""Episodes on the true system, each kept until the step that needs them all is done."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium

from policy.evaluate import Policy, Rollout, rollout
from policy.noise import OrnsteinUhlenbeck
from simgap_files.npz import read_npz, write_npz

ARRAYS, BESIDE = "rollout.npz", "episode.json"
#: Arrays of a rollout, and those that it may lack.
ALWAYS, OPTIONAL = ("observations", "actions", "rewards"), ("states", "measured")

#: Computes an episode, or finds it again: of its settings, how to compute it, how to read it.
Keep = Callable[[Mapping[str, Any], Callable[[], "Episode"], Callable[[Path, str], "Episode"]], Any]


@dataclasses.dataclass(frozen=True)
class Episode:
    """One episode, and what goes on from it.

    Attributes:
        run: What was observed and done.
        noise: State of the random numbers of exploration after it, None without noise.
        said: What was to be said of the environment by then.
        key: Of the step that it was kept as.
    """

    run: Rollout
    noise: dict[str, Any] | None
    said: dict[str, str]
    key: str = ""

    def save(self, folder: Path) -> None:
        """Write it."""
        arrays = {name: getattr(self.run, name) for name in (*ALWAYS, *OPTIONAL)}
        write_npz(folder / ARRAYS, {name: a for name, a in arrays.items() if a is not None})
        beside = {"terminated": self.run.terminated, "noise": self.noise, "said": self.said}
        (folder / BESIDE).write_text(json.dumps(beside))

    @classmethod
    def load(cls, folder: Path, key: str) -> Episode:
        """Read what ``save`` wrote."""
        beside = json.loads((folder / BESIDE).read_text())
        found: dict[str, Any] = dict.fromkeys(OPTIONAL) | read_npz(folder / ARRAYS)
        run = Rollout(**found, terminated=beside["terminated"])
        return cls(run, beside["noise"], beside["said"], key)


class Episodes:
    """Rolls out as ``policy.evaluate.rollout`` does, and finds what it did again.

    A robot that breaks off costs the episode at hand and none before it.

    Args:
        keep: Keeps each of them; None keeps none.
        settings: All that they depend on together, plain values.

    Attributes:
        keys: Of those that were kept.
    """

    def __init__(self, keep: Keep | None, settings: Mapping[str, Any]) -> None:
        self.keep = keep
        self.settings = settings
        self.keys: list[str] = []

    def roll(
        self,
        policy: Policy,
        env: gymnasium.Env[Any, Any],
        seed: int,
        noise: OrnsteinUhlenbeck | None = None,
        max_steps: int | None = None,
    ) -> Rollout:
        """One episode, see ``policy.evaluate.rollout``."""
        if self.keep is None:
            return rollout(policy, env, seed, noise, max_steps)
        said: dict[str, str] = getattr(env.unwrapped, "said", {})

        def compute() -> Episode:
            run = rollout(policy, env, seed, noise, max_steps)
            return Episode(run, noise.state if noise else None, dict(said))

        own = {"reset": seed, "max_steps": max_steps, "noise": noise.state if noise else None}
        episode: Episode = self.keep({**self.settings, **own}, compute, Episode.load)
        if noise and episode.noise:
            noise.state = episode.noise
        said.update(episode.said)
        self.keys.append(episode.key)
        return episode.run
