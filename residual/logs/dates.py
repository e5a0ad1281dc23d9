"""Times that are written as dates, or as the time of day, in seconds."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: What can be read, for a message.
DATED = "as 2024-05-01 12:00:00.5, 01.05.2024 12:00:00.5, 2024-05-01 or 12:00:00.5"

_TIME = r"\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?"
_YEAR_FIRST = re.compile(r"\d{4}-\d{2}-\d{2}(?:[T ]\d{2}:\d{2}|\Z)")
_DAY_FIRST = re.compile(rf"\d{{1,2}}\.\d{{1,2}}\.\d{{4}}(?:[T ]+{_TIME})?")
_OF_DAY = re.compile(r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?")
_ANY = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}\b|\d{1,2}:\d{2}\b")


def seconds_of(texts: Sequence[str]) -> Array | None:
    """Dates as seconds since 1970 (UTC unless they say otherwise), times of day since midnight.

    A date alone is its midnight, as in a log of days.

    Dates with slashes are not read: whether the day or the month stands first is not known.

    Args:
        texts: One column of a file.

    Returns:
        Seconds, shape (n,), or None if they are no such times. A time that is missing is NaN.
    """
    first = next((text for text in texts if text), "")
    if _YEAR_FIRST.match(first):
        given, layout = list(texts), "ISO8601"
    elif _DAY_FIRST.fullmatch(first):
        given, layout = [_reordered(text) for text in texts], "ISO8601"
    elif _OF_DAY.fullmatch(first):
        return _since_midnight(texts)
    else:
        return None
    import pandas as pd  # half a second to load, for logs with dates

    with contextlib.suppress(ValueError):
        dates = pd.to_datetime(given, format=layout, utc=True).tz_localize(None).to_numpy()
        seconds = dates.astype("datetime64[ns]").astype(np.int64) * 1e-9
        return np.where(np.isnat(dates), np.nan, seconds)
    return None


def looks_dated(text: str) -> bool:
    """Whether a text is a date or a time of day of some kind."""
    return bool(_ANY.match(text))


def _reordered(text: str) -> str:
    """A date that begins with the day, with the year first; any other text as it is."""
    if not _DAY_FIRST.fullmatch(text):
        return text
    date, *later = re.split(r"[T ]+", text, maxsplit=1)
    day, month, year = date.split(".")
    if not later:
        return f"{year}-{month:0>2}-{day:0>2}"
    (time,) = later
    hour, rest = time.split(":", 1)
    return f"{year}-{month:0>2}-{day:0>2} {hour:0>2}:{rest.replace(',', '.')}"


def _since_midnight(texts: Sequence[str]) -> Array | None:
    seconds = np.full(len(texts), np.nan)
    for place, text in enumerate(texts):
        if not text:
            continue
        if not _OF_DAY.fullmatch(text):
            return None
        hours, minutes, rest = text.split(":")
        seconds[place] = 3600 * int(hours) + 60 * int(minutes) + float(rest.replace(",", "."))
    return seconds
