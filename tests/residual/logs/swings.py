"""A log of an exact swing in any format, and what reading it says."""

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from residual.logs import LogError, LogFormat, read_logs
from sims.simulator import Channel

STATES = (
    Channel("angle", "rad", "position", angle=True),
    Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
)
ACTIONS = (Channel("voltage", "V", "input", scale=3.0),)
DEG = 180 / np.pi


def swing(samples=200, dt=0.05, speed=2.0, size=1.2):
    """Columns of a log of an exact swing, in SI."""
    t = dt * np.arange(samples)
    return {
        "time": t,
        "angle": 0.3 + size * np.sin(speed * t),
        "rate": size * speed * np.cos(speed * t),
        "voltage": np.sign(np.sin(5.3 * t + 0.1)),
    }


def write(path, columns):
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".parquet":
        pyarrow.parquet.write_table(pyarrow.table(dict(columns)), path)
    else:
        rows = [",".join(columns)]
        rows += [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
        path.write_text("\n".join(rows) + "\n")
    return path


def read(path, channels=(STATES, ACTIONS), **settings):
    return read_logs([path], *channels, LogFormat(**settings))


def error(path, **settings):
    """The message of the one error, which is one line."""
    with pytest.raises(LogError) as caught:
        read(path, **settings)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    return message


def kinds(data):
    return [finding.kind for finding in data.findings]
