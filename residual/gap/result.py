"""What the workflow finds, as plain data for reports and files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from residual.gap.beside import Blind, Changing, Conventions, Periodic, Unlike
from residual.gap.data.stretch import Stretch
from residual.gap.fitting.where import Where
from residual.logs.checks import Finding
from sims.effects.base import Effect
from sims.host import HostSimulator

Array = NDArray[np.float64]
Kind = Literal[
    "confirmed", "ambiguous", "calibrated", "minor", "needs_data", "unexplained", "no_gap"
]
#: Why an effect is not certain, each in words in ``residual.gap.answer.doubts.DOUBTS``.
Doubt = Literal[
    "not_needed", "unsteady", "creeps", "drift", "one_way", "law", "numerics", "at_bound", "clock",
    "within_step", "swapped", "conventions", "cut_off", "extreme", "stretched", "orders", "levels",
    "loop", "records", "set_aside", "no_help", "sensor", "no_time", "may_be_zero", "size_open",
    "share_may_be_zero", "calibration", "within", "slight", "company", "rare", "few_blocks",
    "rivals", "instead",
]  # fmt: skip
#: Forecast error over that of the nominal simulator from which on the corrected one is worse.
WORSE = 1.05
#: Forecast error over that by noise, from which on there is a gap.
OFF = 1.5


@dataclasses.dataclass(frozen=True)
class Number:
    """A fitted number with its 95 % interval and unit; at a bound it has none that means much.

    ``if_exact`` is the interval if all else in the simulator were exactly right; None if it was
    taken for that. ``along`` is what it is as the records begin and end if it clearly changes.
    """

    value: float
    low: float
    high: float
    unit: str
    at_bound: bool = False
    if_exact: tuple[float, float] | None = None
    along: tuple[float, float] | None = None


@dataclasses.dataclass(frozen=True)
class Meant:
    """Numbers, each with its unit, if a twin is meant: ``effect`` (``name@where``)."""

    effect: str
    numbers: Mapping[str, tuple[float, str]]


@dataclasses.dataclass(frozen=True)
class Span:
    """A value with a 95 % interval."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Verdict:
    """One answer.

    Attributes:
        kind: ``confirmed``: one effect (or one family of them), by forecasts of data that did not
            fit it; ``ambiguous``: it or an alternative; ``calibrated``: parameters that were moved
            within their tolerance; ``minor``: it helps a little, and is not added; ``needs_data``:
            this log cannot show it; ``unexplained``: a remainder without a name; ``no_gap``:
            nothing above noise, or nothing that matters.
        effect: Name of the effect, empty if there is none.
        where: Joint, actuator, channel or parameter.
        parameters: Its numbers.
        alternatives: Effects (``name@where``) that these data cannot exclude, exact aliases
            included.
        family: What all of them have in common, such as ``"dissipation"``; empty if nothing.
        says: The answer in words.
        share: Part of the nominal simulator's cross-validated squared error that it takes off;
            of a remainder, the part that is left.
        provisional: True if too few blocks of data had to confirm it.
        same_motion: Those of ``alternatives`` that no motion can tell from it, ``resized`` those of
            them that need other sizes of what else is named for that.
        instead: Effects that together do as well as all that is named, without it.
        meant: What some of those would be in its place.
        beside: What this one would be if a twin of another named effect is meant, where that
            makes a difference; the intervals hold it.
        together: Sets of effects that make the same motion in one exact proportion.
        form: Those of ``alternatives`` that belong to its family and do nearly as well.
        doubts: Why it is not certain.
        follows: What the force that has no name looks like, empty if it follows nothing.
        shape: Numbers that were chosen rather than fitted, such as the order of a cogging.
    """

    kind: Kind
    effect: str
    where: str
    parameters: dict[str, Number]
    alternatives: tuple[str, ...]
    family: str
    says: str
    share: Span
    provisional: bool = False
    same_motion: tuple[str, ...] = ()
    together: tuple[tuple[str, ...], ...] = ()
    form: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    instead: tuple[str, ...] = ()
    follows: str = ""
    shape: Mapping[str, float] = dataclasses.field(default_factory=dict)
    meant: tuple[Meant, ...] = ()
    beside: tuple[Meant, ...] = ()
    resized: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """``name@where``, or the name alone of a parameter; empty if there is no effect."""
        return self.effect if self.where in ("", self.effect) else f"{self.effect}@{self.where}"

    def __repr__(self) -> str:
        return f"Verdict({self.kind}: {self.says})"[:180]


@dataclasses.dataclass(frozen=True)
class Step:
    """Forecast error after adding one more effect."""

    added: str
    gap: Span


@dataclasses.dataclass(frozen=True)
class ChannelGap:
    """Cross-validated forecast error of one channel, in its unit."""

    unit: str
    before: Span
    after: Span
    noise_floor: Span


@dataclasses.dataclass(frozen=True)
class Gap:
    """Forecast errors, each of data that did not fit the numbers it was made with.

    Attributes:
        channel: The channel that the main figures are about, and ``unit`` its unit.
        horizon_s: Seconds over which errors of forecasts are told: lead-ins included, but for
            what strikes the ground, whose forecasts begin where a window ends.
        before, after: Of the nominal and of the corrected simulator.
        noise_floor: What the corrected simulator would reach on its own data plus noise.
        steps: From nominal to corrected, one effect at a time.
        by_channel: The same for every measured channel.
        windows_before, windows_after: Residual over noise in windows with free start states; 1 is
            the noise.
        share: Part of the nominal simulator's squared error that has a name.
        blocks, folds: Blocks of data, and groups of them that were left out in turn.
        no_better: Blocks in which the corrected simulator forecasts no better than the nominal one.
        drowned: Whether noise alone makes forecasts of every channel no better than its mean is.
    """

    channel: str
    unit: str
    horizon_s: float
    before: Span
    after: Span
    noise_floor: Span
    steps: tuple[Step, ...]
    by_channel: dict[str, ChannelGap]
    windows_before: float
    windows_after: float
    share: Span
    blocks: int
    folds: int
    no_better: int = 0
    drowned: bool = False

    def exceeds_noise(self, times: float, *, corrected: bool = False) -> bool:
        """Whether the nominal (or the corrected) simulator errs by more than so many times what
        noise makes, and by more whichever blocks of data are drawn."""
        error, noise = self.after if corrected else self.before, self.noise_floor
        return error.value > times * noise.value and error.low > noise.high

    @property
    def helps(self) -> bool:
        """Whether the corrected simulator errs less than the nominal one."""
        return WORSE * self.after.value < self.before.value

    @property
    def tells(self) -> bool:
        """Whether more than noise is to be seen, so that it could help."""
        return self.exceeds_noise(1.0) or self.exceeds_noise(OFF, corrected=True)

    @property
    def denies(self) -> bool:
        """Whether it does not help, though it could, and does no clear harm."""
        return self.tells and not self.helps and not self.refutes

    @property
    def refutes(self) -> bool:
        """Whether it errs more, and not by chance."""
        by_chance = self.after.low < self.before.value and self.after.value < self.before.high
        return self.after.value > WORSE * self.before.value and not by_chance


@dataclasses.dataclass(frozen=True)
class Rival:
    """A set of effects that was fitted, and how well it forecasts.

    Attributes:
        effects: ``name@where`` of its members; empty for the nominal simulator.
        error: Cross-validated forecast error over the nominal simulator's.
        chosen: Whether it is the chosen set.
        reason: Why it was not chosen, in words.
    """

    effects: tuple[str, ...]
    error: float
    chosen: bool
    reason: str


@dataclasses.dataclass(frozen=True)
class Rollout:
    """One forecast for pictures: measured, nominal, corrected; columns are channels."""

    run: str
    times: Array
    seen: Array
    before: Array
    after: Array


@dataclasses.dataclass(frozen=True)
class GapResult:
    """Everything that was found.

    Attributes:
        verdicts: The answers, most important first.
        gap: Cross-validated forecast errors.
        held_out: The same on records that the user had set aside; None without such.
        where: Where the nominal simulator fails.
        evidence: Chosen set, nominal and runners-up, best first.
        rollouts: Held-out forecasts for pictures.
        effects: The effects that were added.
        corrected: The simulator with them.
        channels: Names and units of the measured channels, in the order of all columns.
        noise: Standard deviation of each measured channel, with its standard error.
        quality: Findings about the data and, of kind ``search``, what bears on all answers.
        blind: Effects that this log could hide.
        adequate: True if what was found leaves no more than noise, so that chance decided;
            otherwise shares of the error did.
        seconds: Time spent, by stage.
        substeps: Sub-steps per control period of ``corrected``, if it needs more than it had.
        conventions: What to look at first, None where nothing is counted otherwise.
        cut_off: Channels that the simulator cuts off within what was recorded of them.
        unlike: Effects that would take much of what is left off with own sizes in each record.
        changing: What would take most of what is left off if it changed along the records;
            ``periodic``: a force at one frequency that would.
        nearly_late: Labels of delays and lags of some inputs that late, or filtering, sensors would
            nearly imitate, since the other inputs hardly change in that time.
        lone: Where most of the error lies, if nothing explains it and it was not left out.
    """

    verdicts: tuple[Verdict, ...]
    gap: Gap
    held_out: Gap | None
    where: Where
    evidence: tuple[Rival, ...]
    rollouts: tuple[Rollout, ...]
    effects: tuple[Effect, ...]
    corrected: HostSimulator
    channels: tuple[tuple[str, str], ...]
    noise: dict[str, tuple[float, float]]
    quality: tuple[Finding, ...]
    blind: tuple[Blind, ...]
    adequate: bool
    seconds: dict[str, float]
    substeps: int | None = None
    conventions: Conventions | None = None
    cut_off: tuple[str, ...] = ()
    unlike: tuple[Unlike, ...] = ()
    changing: Changing | None = None
    periodic: Periodic | None = None
    nearly_late: tuple[str, ...] = ()
    lone: Stretch | None = None

    def __repr__(self) -> str:
        kinds = "; ".join(f"{v.effect} {v.kind}".strip() for v in self.verdicts[:4])
        before, after = self.gap.before.value, self.gap.after.value
        return f"{type(self).__name__}({kinds}; error {before:.3g} -> {after:.3g})"[:180]
