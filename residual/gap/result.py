"""What the workflow finds, as plain data for reports and files."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirm import Span
from sims.effects.base import Effect
from sims.host import HostSimulator

Array = NDArray[np.float64]
Kind = Literal["confirmed", "ambiguous", "needs_data", "unexplained", "no_gap"]


@dataclasses.dataclass(frozen=True)
class Number:
    """A fitted number with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str


@dataclasses.dataclass(frozen=True)
class Verdict:
    """One answer.

    Attributes:
        kind: ``confirmed``: one effect, tested on held-out data; ``ambiguous``: it or an
            alternative; ``needs_data``: this log cannot show it; ``unexplained``: a remainder
            without a name; ``no_gap``: nothing above noise, or nothing that matters.
        effect: Name of the effect, empty if there is none.
        where: Joint, actuator, channel or parameter.
        parameters: Its numbers.
        alternatives: Effects (``name@where``) that these data cannot exclude, exact aliases
            included.
        family: What all of them have in common, such as ``"dissipation"``; empty if nothing.
        says: The answer in words.
    """

    kind: Kind
    effect: str
    where: str
    parameters: dict[str, Number]
    alternatives: tuple[str, ...]
    family: str
    says: str


@dataclasses.dataclass(frozen=True)
class Step:
    """Forecast error after adding one more effect."""

    added: str
    gap: Span


@dataclasses.dataclass(frozen=True)
class ChannelGap:
    """Forecast error of one channel on held-out data, in its unit."""

    unit: str
    before: Span
    after: Span
    noise_floor: Span
    ceiling: Span | None


@dataclasses.dataclass(frozen=True)
class Gap:
    """Forecast error on held-out data.

    Attributes:
        channel: The channel that the main figures are about, and ``unit`` its unit.
        horizon_s: Seconds forecast from a fitted lead-in.
        before, after: Of the nominal and of the corrected simulator.
        noise_floor: What the corrected simulator would reach on its own data plus noise.
        ceiling: Of the nominal simulator plus a flexible estimator; None if not asked for.
        steps: From nominal to corrected, one effect at a time.
        by_channel: The same for every measured channel.
        windows_before, windows_after: Residual over noise on held-out windows with free start
            states; 1 is the noise. A window counts at most 20 times the median one: where the
            start state was not found, its residual says nothing of the model.
        left_out: Share of forecasts that no model could make (unstable), left out.
    """

    channel: str
    unit: str
    horizon_s: float
    before: Span
    after: Span
    noise_floor: Span
    ceiling: Span | None
    steps: tuple[Step, ...]
    by_channel: dict[str, ChannelGap]
    windows_before: float
    windows_after: float
    left_out: float


@dataclasses.dataclass(frozen=True)
class Rival:
    """A set of effects that was refitted, and how it did on the training windows.

    Attributes:
        effects: ``name@where`` of its members; empty for the nominal simulator.
        excess: Score above the chosen set's (cost plus price of its numbers); 0 for the chosen.
        ratio: Residual over noise.
        chosen: Whether it is the chosen set.
        excluded: Whether the data exclude it.
    """

    effects: tuple[str, ...]
    excess: float
    ratio: float
    chosen: bool
    excluded: bool


@dataclasses.dataclass(frozen=True)
class Profile:
    """Missing acceleration against one variable: mean and 95 % band in bins.

    Attributes:
        variable, unit: What it is plotted against.
        target, target_unit: The driven channel and the unit of its missing rate of change.
    """

    variable: str
    unit: str
    target: str
    target_unit: str
    centres: Array
    mean: Array
    low: Array
    high: Array


@dataclasses.dataclass(frozen=True)
class Where:
    """Where the nominal simulator fails.

    Attributes:
        by_channel: Residual over noise for each measured channel.
        profiles: Missing acceleration against states and inputs.
        lags_s: Lags of the input in s.
        lag_correlation: Correlation of the missing acceleration with the input that long ago.
        run_ratio: Residual over noise of each training run, by name.
    """

    by_channel: dict[str, float]
    profiles: tuple[Profile, ...]
    lags_s: Array
    lag_correlation: dict[str, Array]
    run_ratio: dict[str, float]


@dataclasses.dataclass(frozen=True)
class Rollout:
    """One held-out forecast for pictures: measured, nominal, corrected; columns are channels."""

    run: str
    times: Array
    seen: Array
    before: Array
    after: Array


@dataclasses.dataclass(frozen=True)
class Blind:
    """An effect that this log could hide.

    Attributes:
        effect: ``name@where``.
        visible_from: Smallest strength that would have been noticed, in ``unit``.
        needs: What data would show it.
    """

    effect: str
    visible_from: float
    unit: str
    needs: str


@dataclasses.dataclass(frozen=True)
class GapResult:
    """Everything that was found.

    Attributes:
        verdicts: The answers, most important first.
        gap: Forecast errors on held-out data.
        where: Where the nominal simulator fails.
        evidence: Chosen set, nominal and runners-up, best first.
        rollouts: Held-out forecasts for pictures.
        effects: The effects that were added.
        corrected: The simulator with them.
        channels: Names and units of the measured channels, in the order of all columns.
        noise: Standard deviation of each measured channel, with its standard error.
        quality: Findings about the data, in words.
        blind: Effects that this log could hide.
        threshold: Fall of the cost that an effect needs, and how much noise alone reached in
            simulated no-gap data (99.9 % point).
        seconds: Time spent, by stage.
        robust: True if every window had one robust vote and forecast errors are medians over
            forecasts (systems with contacts).
    """

    verdicts: tuple[Verdict, ...]
    gap: Gap
    where: Where
    evidence: tuple[Rival, ...]
    rollouts: tuple[Rollout, ...]
    effects: tuple[Effect, ...]
    corrected: HostSimulator
    channels: tuple[tuple[str, str], ...]
    noise: dict[str, tuple[float, float]]
    quality: tuple[str, ...]
    blind: tuple[Blind, ...]
    threshold: tuple[float, float]
    seconds: dict[str, float]
    robust: bool = False
