"""The simulator contract: a pure, batched map from state and action to the next state."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Hold = Literal["zero", "linear"]
Kind = Literal["position", "rate", "input", "other", "memory"]

#: Units of angles, and what a whole turn is in each.
TURNS: Mapping[str, float] = {"rad": math.tau, "deg": 360.0, "rev": 1.0}
#: Units of inputs that push by themselves: forces, accelerations and motor currents.
PUSHES = {
    "N", "mN", "kN", "N m", "mN m", "kN m", "N cm", "N mm", "kgf", "A", "mA", "m/s^2", "rad/s^2",
}  # fmt: skip
#: Scale of a channel that declares none.
UNDECLARED = 1.0


@dataclasses.dataclass(frozen=True)
class Channel:
    """One named, unit-carrying column of a state or an action.

    Args:
        name: Identifier, unique within the simulator.
        unit: SI unit, for example ``"rad"``, ``"rad/s"``, ``"V"``.
        kind: ``"position"``, ``"rate"`` (time derivative of ``rate_of``), ``"input"``
            (an action), ``"other"`` (a state of a first-order system), or ``"memory"``
            (hidden state of an effect, such as the previous input of a delay).
        angle: True if the channel is an angle in rad, known only up to whole turns.
        rate_of: For ``kind="rate"``, the name of the position it is the rate of.
        scale: A typical magnitude in ``unit``; networks and kernels see the channel
            divided by it (an angle is seen as cosine and sine instead).
        low, high: Bounds; only inputs are clipped to them.
        invariant: True if the motion is the same wherever the channel is (how far a walker
            has come): policies and difference models need not see it.
        hold: How an input runs between two samples of a record: held (``"zero"``), as commands
            are, or straight to the next (``"linear"``), as most measured inputs are.
        integrates: Name of the measured channel that this one is the integral of, as a heading
            may be summed up from a yaw rate: its noise is then a random walk.

    Raises:
        ValueError: There is no such kind or hold; or ``angle=True`` of a channel that is not in
            rad, so that its turns are not those of 2 pi.
    """

    name: str
    unit: str
    kind: Kind
    angle: bool = False
    rate_of: str | None = None
    scale: float = UNDECLARED
    low: float = -math.inf
    high: float = math.inf
    invariant: bool = False
    hold: Hold = "zero"
    integrates: str | None = None

    def __post_init__(self) -> None:
        for name, known in (("kind", get_args(Kind)), ("hold", get_args(Hold))):
            if getattr(self, name) not in known:
                raise ValueError(
                    f"channel {self.name!r} has {name}={getattr(self, name)!r}, expected one of "
                    f"{', '.join(map(repr, known))}"
                )
        if self.angle and self.unit != "rad":
            raise ValueError(
                f"channel {self.name!r} has angle=True and unit={self.unit!r}, expected 'rad': "
                "write the simulator in rad (a log may stay as it is, see its unit: under states), "
                "or leave angle=True out and let the channel go on over whole turns"
            )

    @property
    def turn(self) -> float | None:
        """A whole turn in the channel's unit; None of what does not turn."""
        return TURNS.get(self.unit)

    @property
    def unit_text(self) -> str:
        """The unit as it follows a number, with its space; nothing where there is none."""
        return "" if self.unit in ("", "1") else f" {self.unit}"

    @property
    def pushes(self) -> bool:
        """Whether an input pushes by itself, as a force or a motor's current does: what a voltage
        or a goal pushes depends on the motion, too."""
        return self.unit in PUSHES


@dataclasses.dataclass(frozen=True)
class Joint:
    """A generalized coordinate that a force can act on.

    Args:
        name: Its name in effects and reports.
        position: State channel of its position.
        rate: State channel of its rate; None for a state of a first-order system, where a
            "force" is a rate of change. Of a speed without a position it is that of ``position``.
        unit: Unit of the force, ``"N m"`` or ``"N"``.
        scale: A typical force, or None to leave it to the simulator.
        driven: False if no actuator acts on it, so that it cannot have backlash.
    """

    name: str
    position: str
    rate: str | None
    unit: str
    scale: float | None = None
    driven: bool = True

    @property
    def first_order(self) -> bool:
        """Whether a force on it is a rate of change: of a state, or of a speed without a place."""
        return self.rate in (None, self.position)


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A physical parameter that a simulator declares: value, unit, meaning and bounds.

    ``value`` may be an array with one entry per row of a batch. ``scale`` is a typical size, for
    a parameter whose value is zero; by default it is the value. ``family`` is that of the effects
    which a change of it resembles, ``"dissipation"`` for a damping (``sims.effects.Effect``).
    ``bold`` is a change, as a share of the value, that a search tries in full, for a parameter of
    which small changes may do nothing, such as friction that holds anyway.
    """

    value: float | Array
    unit: str
    meaning: str
    low: float = -math.inf
    high: float = math.inf
    scale: float = 1.0
    family: str = ""
    bold: float | None = None


class Simulator(abc.ABC):
    """A system advanced by one control period: ``step(states, actions) -> next states``.

    Contract (``sims.checks.check_simulator`` tests it): ``step`` is a pure function of its
    rows. The same row gives bit-identical output whatever was stepped before, in any order,
    alone or in a batch. Angles are not wrapped: a state at 7 rad steps to a state near 7 rad.

    Attributes:
        name: What it is, for reports.
        dt: Control period in seconds; the action is held constant over it.
        state_channels: One per column of a state, n_s of them.
        action_channels: One per column of an action, n_a of them.
        parameters: The physical parameters by name.
    """

    name: str
    dt: float
    state_channels: tuple[Channel, ...]
    action_channels: tuple[Channel, ...]
    parameters: Mapping[str, Parameter]

    def __repr__(self) -> str:
        states, actions = (
            ", ".join(channel.name for channel in channels[:6])
            for channels in (self.state_channels, self.action_channels)
        )
        return f"{type(self).__name__}({states}; {actions}; every {self.dt:g} s)"

    @abc.abstractmethod
    def step(self, states: ArrayLike, actions: ArrayLike) -> Array:
        """Advance every row by one control period ``dt``.

        Args:
            states: shape (n, n_s).
            actions: shape (n, n_a); clipped to the bounds of ``action_channels``.

        Returns:
            Next states, shape (n, n_s), angles not wrapped.

        Raises:
            ValueError: The shapes do not fit the channels.
        """

    def with_parameters(self, **values: float | Array) -> Self:
        """A copy with some parameters changed; ``KeyError`` names an unknown one."""
        raise NotImplementedError(f"{type(self).__name__} has no parameters to change")

    def augment(self, states: ArrayLike, actions: ArrayLike | None = None) -> Array:
        """States with the memory channels that they lack appended, at rest.

        Args:
            states: shape (n, m), the leading channels.
            actions: shape (n, n_a), the last actions before; zero by default.

        Returns:
            shape (n, n_s).
        """
        states = np.asarray(states, float)
        lacking = len(self.state_channels) - states.shape[1]
        return np.pad(states, ((0, 0), (0, lacking)))

    def rollout(self, start: ArrayLike, actions: ArrayLike) -> Array:
        """Step through a sequence of actions, open loop.

        Args:
            start: shape (n_s,) or, for n rollouts at once, (n, n_s).
            actions: shape (T, n_a) or (n, T, n_a).

        Returns:
            States including the start, shape (T + 1, n_s) or (n, T + 1, n_s).
        """
        start, actions = np.asarray(start, float), np.asarray(actions, float)
        single = start.ndim == 1
        if single:
            start, actions = start[None], actions[None]
        states = np.empty((len(start), actions.shape[1] + 1, start.shape[1]))
        states[:, 0] = start
        for k in range(actions.shape[1]):
            states[:, k + 1] = self.step(states[:, k], actions[:, k])
        return states[0] if single else states

    def check_rows(self, states: ArrayLike, actions: ArrayLike) -> tuple[Array, Array]:
        """Both as float arrays of shape (n, n_s) and (n, n_a), actions clipped to their bounds.

        Raises:
            ValueError: A shape does not fit; the message names the channels expected.
        """
        states, actions = as_rows(self.state_channels, self.action_channels, states, actions)
        low = [channel.low for channel in self.action_channels]
        high = [channel.high for channel in self.action_channels]
        return states, np.clip(actions, low, high)


def physical(channels: tuple[Channel, ...]) -> tuple[Channel, ...]:
    """State channels without the hidden memory of effects, which comes after all others."""
    return tuple(channel for channel in channels if channel.kind != "memory")


def as_rows(
    state_channels: tuple[Channel, ...],
    action_channels: tuple[Channel, ...],
    states: ArrayLike,
    actions: ArrayLike,
) -> tuple[Array, Array]:
    """Both as float arrays of shape (n, n_s) and (n, n_a).

    Raises:
        ValueError: A shape does not fit; the message names the channels expected.
    """
    states, actions = np.asarray(states, float), np.asarray(actions, float)
    for what, rows, channels in (
        ("states", states, state_channels),
        ("actions", actions, action_channels),
    ):
        if rows.ndim != 2 or rows.shape[1] != len(channels):
            names = ", ".join(channel.name for channel in channels)
            raise ValueError(
                f"{what} has shape {rows.shape}, expected (n, {len(channels)}): "
                f"one column for each of {names}"
            )
    if len(states) != len(actions):
        raise ValueError(f"{len(states)} states but {len(actions)} actions")
    return states, actions


def wrap(angle: ArrayLike) -> Array:
    """Angle folded into [-pi, pi), in radians."""
    return (np.asarray(angle, float) + np.pi) % (2 * np.pi) - np.pi


def state_difference(channels: tuple[Channel, ...], a: ArrayLike, b: ArrayLike) -> Array:
    """``a - b`` channel by channel, angle differences wrapped; shapes broadcast to (..., n_s)."""
    difference = np.asarray(a, float) - np.asarray(b, float)
    for column, channel in enumerate(channels):
        if channel.angle:
            difference[..., column] = wrap(difference[..., column])
    return difference


def random_values(channel: Channel, n: int, rng: np.random.Generator) -> Array:
    """Random values of a channel, (n,): an angle anywhere, others within bounds, no farther from
    what is nearest to zero there than its scale."""
    size = np.pi if channel.angle else channel.scale
    middle = min(max(0.0, channel.low), channel.high)
    return rng.uniform(max(channel.low, middle - size), min(channel.high, middle + size), n)
