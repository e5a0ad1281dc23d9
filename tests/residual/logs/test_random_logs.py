"""Measured logs: anything at all gives sound trajectories or the one error."""

import dataclasses
import io

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from swings import read, swing, write

from residual.logs import Column, LogError, LogFormat


def only_log_errors(path, data, **settings):
    path.write_bytes(data)
    try:
        read(path, **settings)
    except LogError as error:
        assert "\n" not in str(error)


def seeds():
    """A good log in each format, as bytes."""
    columns = {name: np.round(values, 3) for name, values in swing(12).items()}
    text = "\n".join(
        [",".join(columns), *(",".join(map(str, r)) for r in zip(*columns.values(), strict=True))]
    )
    npz, parquet = io.BytesIO(), io.BytesIO()
    np.savez(npz, **columns)
    pyarrow.parquet.write_table(pyarrow.table(columns), parquet)
    return {".csv": text.encode(), ".npz": npz.getvalue(), ".parquet": parquet.getvalue()}


SEEDS = seeds()
ANY = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", SEEDS)
@ANY
@given(data=st.data())
def test_mutated_files_never_give_another_error(tmp_path, suffix, data):
    content = bytearray(SEEDS[suffix])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        junk = data.draw(st.binary(max_size=8))
        content[place : place + data.draw(st.integers(0, 20))] = junk
        content = content or bytearray(b"x")
    only_log_errors(tmp_path / f"log{suffix}", bytes(content))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", SEEDS)
@ANY
@given(content=st.binary(max_size=300))
def test_random_bytes_never_give_another_error(tmp_path, suffix, content):
    only_log_errors(tmp_path / f"log{suffix}", content)


CELLS = st.one_of(
    st.floats(width=64).map(str),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(["", "nan", "inf", "1_0", "1e308", "-1e-320", "0", "1", "2", "٣", '"', "a b"]),
    st.text(max_size=5),
)


@ANY
@given(
    rows=st.lists(st.lists(CELLS, min_size=3, max_size=5), max_size=12),
    header=st.booleans(),
    delimiter=st.sampled_from(["auto", ",", ";", "tab", "blank"]),
    split=st.booleans(),
)
def test_random_tables_never_give_another_error(tmp_path, rows, header, delimiter, split):
    joiner = {"auto": ",", "tab": "\t", "blank": " "}.get(delimiter, delimiter)
    text = "\n".join(joiner.join(row) for row in [["time", "angle", "rate", "voltage"], *rows])
    layout = LogFormat(
        time=1,
        states={"angle": 2, "rate": 3},
        actions={"voltage": Column(value=1.0)},
        header=header,
        delimiter=delimiter,
        split_at_time_resets=split,
        minimum_samples=3,
    )
    only_log_errors(
        tmp_path / "log.csv",
        text.encode("utf-8", "surrogatepass"),
        **{field.name: getattr(layout, field.name) for field in dataclasses.fields(layout)},
    )


@ANY
@given(
    columns=st.fixed_dictionaries(
        {
            name: st.lists(st.floats(allow_nan=True, allow_infinity=name == "rate", width=64),
                           min_size=8, max_size=8)
            for name in ("time", "angle", "rate", "voltage")
        }
    ),
    ordered=st.booleans(),
)  # fmt: skip
def test_random_numbers_give_sound_trajectories_or_an_error(tmp_path, columns, ordered):
    arrays = {name: np.array(values) for name, values in columns.items()}
    if ordered:
        arrays["time"] = np.sort(arrays["time"])
    path = write(tmp_path / "log.npz", arrays)
    try:
        data = read(path, split_at_time_resets=True, minimum_samples=3)
    except LogError as error:
        assert "\n" not in str(error)
        return
    for run in data.trajectories:
        assert (run.durations > 0).all()
        assert np.isfinite(run.actions).all()
        assert not np.isinf(run.states).any()
        assert len(run.times) == len(run.states) == len(run.actions) + 1 >= 3
