"""The ways that a log may be read otherwise, one after the other."""

from __future__ import annotations

import contextlib

from residual.gap.clock import Clock, OutOfTime
from residual.gap.readings.from_rest import begun_from_rest
from residual.gap.readings.held import held_the_other_way
from residual.gap.readings.out_of_range import without_an_end
from residual.gap.readings.read import Asked, Read
from residual.gap.readings.reversed_sign import a_sign_reversed
from residual.gap.readings.row_late import a_row_earlier
from residual.gap.readings.sensor_late import a_sensor_earlier


def read_otherwise(read: Read, asked: Asked, clock: Clock, hold_is_known: bool) -> Read:
    """The log in the reading that explains it, or as it is said to be.

    Where it seems to count otherwise, clocks are not asked about: nothing found so is worth it.

    Args:
        read: The log as it is said to be, with what it may count otherwise.
        asked: What it is asked so.
        clock: The time that is left.
        hold_is_known: Whether the user said how inputs run between their rows.
    """
    with clock.once_more(), contextlib.suppress(OutOfTime):
        read = without_an_end(read, asked)
    with clock.once_more(), contextlib.suppress(OutOfTime):
        read = a_sign_reversed(read, asked)
    if read.conventions is None and not read.says:
        with clock.once_more(), contextlib.suppress(OutOfTime):
            read = a_row_earlier(read, asked)
    if read.conventions is None and not read.says:
        with clock.once_more(), contextlib.suppress(OutOfTime):
            read = a_sensor_earlier(read, asked)
    if not hold_is_known and not read.says:
        with clock.once_more():
            read = held_the_other_way(read, asked)
    return begun_from_rest(read, asked)
