"""What a study is about: a simulator, the system that it stands for, and a task."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np

from sims.contract import refuse_unsound
from sims.environment import SimulatorEnv
from sims.measured import MeasuredEnv, Measurement
from sims.protocol import EvaluationProtocol
from sims.same_channels import check_same_channels, seen_as
from sims.sampled import SampledEnv, StateOf
from sims.simulator import Array, Simulator, physical
from sims.task_contract import refuse_unsound_task
from sims.tasks import Task
from sims.unsound import Unsound, answered, cannot_call

# Up to so many state channels are reported one by one, more by their kind.
_FEW = 6
#: Starts of a test on the true system where they differ.
USUAL_STARTS = 5


@dataclasses.dataclass(frozen=True, repr=False)
class System:
    """A simulator at hand, the true system, and what is asked of it.

    Args:
        name: For titles and files.
        nominal: The simulator that one has; its channels are the system's.
        true: The system that one wants to control: a simulator, a Gymnasium environment, or a
            function that makes either. It is only ever sampled: reset and stepped.
        task: Reward, termination, start states, horizon.
        evaluation: How policies are tested.
        state_of: For an environment that does not report ``info["state"]``: reads the state,
            shape (n_s,), given the environment and its observation.
        measures: What is reported of a rollout on the true system beside its return, by name,
            from its states (T + 1, n_s) and actions (T, n_a).
        groups: State channels by the name under which their errors are averaged; by default each
            by itself, or many by their kind.
        shown: State channels drawn over time; by default the first three.
        path: Two state channels, along and up, of a place whose path is drawn.
        target: A return that counts as success, if there is one.
        best: The best return that is possible, if it is known.
        elsewhere: Draws states (n, T + 1, n_s) and actions (n, T, n_a) of rollouts of the true
            system from anywhere, to compare with where policies go; by default uniformly, if the
            true system is a simulator.
        published: For tables: what others published, by kind of policy.
        cold_noise_sigma: Exploration noise of policies that are learnt from nothing.
        measurement: What sensors show of the true system: all that policies, collecting and
            testing see of it. Rewards, and what is reported, are of the true states.

    Raises:
        ValueError: Two parts do not fit together; the message says which.
    """

    name: str
    nominal: Simulator
    true: Simulator | gymnasium.Env[Any, Any] | Callable[[], Any]
    task: Task
    evaluation: EvaluationProtocol = dataclasses.field(default_factory=EvaluationProtocol)
    state_of: StateOf | None = None
    measures: Callable[[Array, Array], Mapping[str, float]] | None = None
    groups: Mapping[str, tuple[str, ...]] | None = None
    shown: tuple[str, ...] | None = None
    path: tuple[str, str] | None = None
    target: float | None = None
    best: float | None = None
    elsewhere: Callable[[np.random.Generator], tuple[Array, Array]] | None = None
    published: Mapping[str, str] = dataclasses.field(default_factory=dict)
    cold_noise_sigma: float = 0.20
    measurement: Measurement = dataclasses.field(default_factory=Measurement)

    def __post_init__(self) -> None:
        self._refuse_kinds()
        if not isinstance(self.nominal, Simulator):
            raise ValueError(
                f"system {self.name}: nominal is {_kind(self.nominal)}, expected a Simulator: "
                "an object of a subclass of sims.EquationOfMotion or sims.Simulator"
            )
        if not isinstance(self.true, Simulator | gymnasium.Env):
            _refuse_no_maker(self.true, f"system {self.name}: true")
        if not isinstance(self.task, Task):
            raise ValueError(
                f"system {self.name}: task is {_kind(self.task)}, expected a Task: an object of a "
                "class derived from sims.Task"
            )
        if isinstance(self.true, Simulator):
            check_same_channels(self.nominal, self.true, f"system {self.name}: the true system")
        names = [channel.name for channel in self.nominal.state_channels]
        named = [*(self.shown or ()), *(self.path or ())]
        named += [name for part in (self.groups or {}).values() for name in part]
        if unknown := [name for name in named if name not in names]:
            raise ValueError(
                f"system {self.name}: no state channel {', '.join(unknown)}, only "
                f"{', '.join(names)}"
            )

    def _refuse_kinds(self) -> None:
        """Refuse what is of another kind than it should be."""
        if not isinstance(self.name, str):
            raise ValueError(f"system {self.name!r}: name is {_kind(self.name)}, expected a text")
        if not isinstance(self.evaluation, EvaluationProtocol):
            raise ValueError(
                f"system {self.name}: evaluation is {_kind(self.evaluation)}, expected an "
                "EvaluationProtocol: EvaluationProtocol(every=1000)"
            )
        takes = {"state_of": "env, observation", "measures": "states, actions", "elsewhere": "rng"}
        for name, arguments in takes.items():
            if (given := getattr(self, name)) is None:
                continue
            why = cannot_call(given, *arguments.split(", ")) if callable(given) else None
            if why != "":
                raise ValueError(
                    f"system {self.name}: {name} is {_kind(given)}, expected a function "
                    f"{name}({arguments})" + (f": {why}" if why else "")
                )

    def __repr__(self) -> str:
        true = getattr(self.true, "name", None) or type(self.true).__name__
        return f"System({self.name!r}: {self.nominal.name} for {true}, {self.task!r})"

    def environment(self, simulator: Simulator, task: Task | None = None) -> SimulatorEnv:
        """The task on a simulator."""
        return SimulatorEnv(simulator, task or self.task)

    def true_environment(self, believed: Simulator | None = None) -> gymnasium.Env[Any, Any]:
        """The task on the true system.

        Args:
            believed: The simulator that makes a state of what sensors show; by default the one at
                hand, which also stands in for one with hidden memory.

        Raises:
            ValueError: The environment does not fit the nominal simulator.
        """
        true = self.true
        if not isinstance(true, Simulator | gymnasium.Env):
            true = answered(f"system {self.name}: the function true", true)
            if not isinstance(true, Simulator | gymnasium.Env):
                raise ValueError(
                    f"system {self.name}: the function true returned {_kind(true)}, expected a "
                    "Simulator or a Gymnasium environment, such as gymnasium.make(...)"
                )
        if isinstance(true, Simulator):
            check_same_channels(self.nominal, true, f"system {self.name}: the true system")
            env: gymnasium.Env[Any, Any] = SimulatorEnv(seen_as(self.nominal, true), self.task)
        else:
            env = SampledEnv(true, self.nominal, self.task, self.state_of)
        if not self.measurement:
            return env
        memory = believed and any(c.kind == "memory" for c in believed.state_channels)
        known = self.nominal if believed is None or memory else believed
        return MeasuredEnv(env, known, self.measurement)

    @property
    def can_learn_on_truth(self) -> bool:
        """Whether there can be two of the true system: one to learn in, one to be tested in."""
        return not isinstance(self.true, gymnasium.Env)

    def with_nominal(self, simulator: Simulator) -> System:
        """The same with another simulator at hand.

        Raises:
            ValueError: It has other channels than the present one.
        """
        check_same_channels(self.nominal, simulator, f"system {self.name}: the simulator")
        return dataclasses.replace(self, nominal=simulator)

    def check(self) -> None:
        """Try all parts: rows of simulator and task, and one step of an episode on each system.

        Raises:
            ValueError: The task, the simulator and the true system do not fit together, or the
                simulator or the task is unsound (``sims.contract``, ``sims.task_contract``).
        """
        refuse_unsound(self.nominal)
        for channel in self.nominal.action_channels:
            if not np.isfinite([channel.low, channel.high]).all():
                raise Unsound(
                    f"system {self.name}: action channel {channel.name!r} is bounded by "
                    f"{channel.low:g} and {channel.high:g}, but policies act between bounds: give "
                    "its Channel a finite low= and high="
                )
            if not channel.low < channel.high:
                raise Unsound(
                    f"system {self.name}: action channel {channel.name!r} can only be "
                    f"{channel.low:g}: give its Channel a low= below its high="
                )
        try:
            refuse_unsound_task(self.task, self.nominal)
        except Unsound as error:
            raise Unsound(f"system {self.name}: {error}") from error.__cause__ or error
        names = ", ".join(channel.name for channel in self.nominal.state_channels)
        fits = f"{type(self.task).__name__} does not fit {self.nominal.name} ({names})"
        for env, wrong in (
            (self.environment(self.nominal), fits),
            (self.true_environment(), "the true system cannot be stepped"),
        ):
            try:
                env.reset(seed=0)
                env.step(env.action_space.sample() * 0)
            except (IndexError, TypeError, KeyError) as error:
                raise ValueError(
                    f"system {self.name}: {wrong}: {type(error).__name__}: {error}"
                ) from error

    def code(self) -> list[Any]:
        """The objects and functions whose code says what the system is."""
        inside = getattr(self.true, "unwrapped", None)
        given = [self.true, inside, self.state_of, self.measures, self.elsewhere]
        return [self.nominal, self.task, *(part for part in given if part is not None)]

    def channel_groups(self) -> dict[str, tuple[str, ...]]:
        """State channels by the name under which their errors are averaged."""
        if self.groups is not None:
            return dict(self.groups)
        channels = physical(self.nominal.state_channels)
        if len(channels) <= _FEW:
            return {channel.name: (channel.name,) for channel in channels}
        kinds = dict.fromkeys(channel.kind for channel in channels)
        return {f"{k}s": tuple(c.name for c in channels if c.kind == k) for k in kinds}

    def description(self) -> dict[str, Any]:
        """What tables and reports need to know, in plain values."""
        channels = physical(self.nominal.state_channels)
        return {
            "name": self.name,
            "nominal": self.nominal.name,
            "dt": self.nominal.dt,
            "sampled": not isinstance(self.true, Simulator),
            "states": [{"name": c.name, "unit": c.unit, "angle": c.angle} for c in channels],
            "actions": [{"name": c.name, "unit": c.unit} for c in self.nominal.action_channels],
            "groups": {name: list(part) for name, part in self.channel_groups().items()},
            "shown": list(self.shown or [channel.name for channel in channels[:3]]),
            "path": list(self.path or []),
            "visited_seconds": self.evaluation.visited_seconds,
            "target": self.target,
            "best": self.best,
            "published": dict(self.published),
        }


def _kind(given: Any) -> str:
    """What somebody gave, in words."""
    if isinstance(given, type):
        return f"the class {given.__name__}, not an object of it ({given.__name__}(...))"
    if isinstance(given, str | int | float):
        return f"{given!r:.40} ({type(given).__name__})"
    return f"a {type(given).__name__}"


def _refuse_no_maker(true: Any, what: str) -> None:
    """Refuse what is no function without arguments."""
    if not callable(true):
        like_one = hasattr(true, "reset") and hasattr(true, "step")
        mend = ": derive its class from gymnasium.Env" if like_one else ""
        raise ValueError(
            f"{what} is {_kind(true)}, expected a Simulator, a Gymnasium environment, or a "
            f"function that makes either{mend}"
        )
    if why := cannot_call(true):
        raise ValueError(
            f"{what} cannot be called without arguments ({why}): give a function that makes the "
            "true system, such as lambda: gymnasium.make(...)"
        )
