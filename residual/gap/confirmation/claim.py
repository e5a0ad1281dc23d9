"""A chosen effect with everything that bears on its verdict."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.result import Meant, Number

#: Part of an effect's share of the gap by which it may add to the gap where few blocks tell.
HARDLY = 0.1
#: Share of the gap below which it may not add to it at all.
SMALL = 0.05


def other_than(exact: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Names of effects less those that move exactly alike."""
    return tuple(name for name in names if name not in exact)


@dataclasses.dataclass(frozen=True)
class Claim:
    """One chosen effect with everything that bears on its verdict.

    Attributes:
        number: The candidate.
        numbers: Fitted numbers.
        form: Effects of the same family and place that do nearly as well.
        alike: Effects of other families that do, with the same motion in these data.
        rivals: Effects of other families that do, with another motion.
        twins: Effects that make the same motion in any data.
        needed: Whether forecasts are clearly worse without it; where chance decides, also whether
            its share is above zero in its interval.
        steady: Whether its strength is about the same in every fold.
        creeps: Whether it is a constant that changes along the records, with how far the system
            moves, or from one record to another.
        drifts: Whether a push that grows steadily along the records would do its work as well.
        one_way: Whether motion goes one way only, so that part of it may be a load.
        other_law: Whether it, or one beside it, explains more if it changes with the motion.
        sound: Whether it survives other numerics.
        bounded: Whether a number of it lies at its bound.
        share: Part of the nominal squared error that it takes off, with a 95 % interval.
        calibration: Whether forecasts are nearly as good without it if parameters of the simulator
            are free within their tolerance.
        within: Whether it may be a parameter, gain or scale off by no more than its tolerance.
        slight: Whether they are without these, too: the parameters do nothing of its work.
        instead: Effects that together do as well as its whole set, without it.
        unasked: Whether there was no time to ask that, or for what may stand in its place.
        brief: Whether it is a time too short for the log's own clock.
        within_step: Whether it may be less than a step of the sensor whose zero it is.
        counted: Whether the log may count otherwise than the simulator does.
        cut_off: Whether the simulator stays the same beyond a value that was recorded.
        extreme: Whether a number of its set is out of all proportion to the simulator's.
        stretched: Whether it is a parameter several times its nominal value beside a remainder.
        orders: Whether it repeats along a turn, and is one of several that do, or beside a
            remainder: together they fit whatever follows the position.
        few_levels: Whether its input rests at as few levels as the laws of it have numbers.
        in_a_loop: Whether its input follows what was measured, so that others fit as well.
        unlike: Whether it may stand for one effect in a size of its own in each record.
        refuted: Whether the corrected simulator forecasts records that were set aside worse.
        helpless: Whether it, or all that was found, forecasts them no better, though they show more
            than noise.
        swapped: Whether it is a lag of a drive or a time of what it drives, which may have each
            other's size.
        in_company: Whether it only helps beside another effect that may not be there.
        rare: Whether it is rarer than the library, beside what is many times the noise.
        sensor: Whether it is a sensor wrong as sensors seldom are, beside a remainder.
        by_fit: Whether a fit to all data leaves three times as much without it: forecasts of single
            blocks may go astray all the same, where motion hangs on a hair.
        there: Whether nothing comes near without it, parameters free, so that it has a size.
        meant: Numbers of its twins in its place.
        beside: Its own numbers beside twins of the others, where they differ.
    """

    number: int
    numbers: dict[str, Number]
    form: tuple[str, ...]
    alike: tuple[str, ...]
    rivals: tuple[str, ...]
    twins: tuple[str, ...]
    needed: bool
    steady: bool
    sound: bool
    bounded: bool
    share: tuple[float, float, float]
    calibration: bool = False
    within: bool = False
    slight: bool = False
    unasked: bool = False
    brief: bool = False
    within_step: bool = False
    swapped: bool = False
    sensor: bool = False
    counted: bool = False
    cut_off: bool = False
    extreme: bool = False
    stretched: bool = False
    orders: bool = False
    few_levels: bool = False
    in_a_loop: bool = False
    unlike: bool = False
    refuted: bool = False
    helpless: bool = False
    by_fit: bool = False
    there: bool = False
    creeps: bool = False
    drifts: bool = False
    one_way: bool = False
    other_law: bool = False
    in_company: bool = False
    rare: bool = False
    instead: tuple[str, ...] = ()
    meant: tuple[Meant, ...] = ()
    beside: tuple[Meant, ...] = ()

    @property
    def stand_ins(self) -> tuple[str, ...]:
        """Effects that could be meant in its place."""
        return (*self.twins, *self.form, *self.alike, *self.rivals)

    def less(self, exact: Sequence[str]) -> Claim:
        """The same if some could stand in its place exactly: they are no other answer."""
        rivals, alike = other_than(exact, self.rivals), other_than(exact, self.alike)
        return dataclasses.replace(self, rivals=rivals, alike=alike)

    @property
    def sure(self) -> bool:
        """Whether nothing speaks against it."""
        against = (
            self.bounded,
            self.calibration,
            self.within,
            self.brief,
            self.within_step,
            self.swapped,
            self.sensor,
            self.counted,
            self.cut_off,
            self.extreme,
            self.stretched,
            self.orders,
            self.few_levels,
            self.in_a_loop,
            self.unlike,
            self.refuted,
            self.helpless,
            self.rivals,
            self.alike,
            self.instead,
            self.unasked,
            self.creeps,
            self.drifts,
            self.one_way,
            self.other_law,
            self.in_company,
            self.rare,
        )
        return self.needed and self.gains and self.steady and self.sound and not any(against)

    @property
    def gains(self) -> bool:
        """Whether it takes a part of the gap off, or hardly adds to it, whichever blocks of data
        are drawn."""
        value, low, _ = self.share
        return low > 0 if value < SMALL else low >= -HARDLY * value
