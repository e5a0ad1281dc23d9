"""A few hundred of the damaged files that ``run.py`` makes by the thousand; long: all of them."""

from __future__ import annotations

import json

import fuzzed_models as models
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from run import attempts
from safetensors.numpy import load_file, save_file

import residual
from policy import DDPG, load_policy
from residual.logs import LogError, read_logs
from simgap_files.arrays import read_arrays, write_arrays
from sims.pendulum_equation import PendulumEquation

pytestmark = pytest.mark.filterwarnings("ignore")  # what broken numbers make numpy warn of
QUICK = {"logs": 360, "models": 170, "simulators": 92}
LONG = {"logs": 10_000, "models": 3000, "results": 500, "configs": 200, "simulators": 184}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def try_all(area, count, folder, but="nothing"):
    for number, kind, run in attempts(area, count, folder):
        if kind.startswith(but):
            continue
        try:
            run()
        except Exception as error:
            raise AssertionError(f"{area}, attempt {number}, {kind}") from error


@pytest.mark.parametrize("area", QUICK)
def test_nothing_damaged_does_harm(area, folder):
    try_all(area, QUICK[area], folder, but="effects")  # which take seconds to be found


@pytest.mark.long
@pytest.mark.parametrize("area", LONG)
def test_thousands_of_them(area, folder):
    try_all(area, LONG[area], folder)


@settings(max_examples=100, suppress_health_check=list(HealthCheck))
@given(text=st.text(max_size=200), header=st.booleans())
def test_any_text_at_all_is_a_log_or_an_error_of_one_line(text, header, folder):
    path = folder / "any.csv"
    path.write_bytes((("time,angle,rate,voltage\n" * header) + text).encode(errors="replace"))
    simulator = PendulumEquation()
    try:
        read_logs([path], simulator.physical_channels, simulator.action_channels)
    except LogError as error:
        assert str(path) in str(error) and "\n" not in str(error)


KINDS = [kind for kind in models.FILES if kind not in (*models.NPZ, "effects")]


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_the_first_version_still_loads(kind, folder, tmp_path):
    header, arrays = read_arrays(models.whole(kind, folder))
    del header["version"]
    save_file(arrays, tmp_path / "old", metadata={"simgap": json.dumps(header)})
    models.load(kind, tmp_path / "old")
    path = tmp_path / "new"
    save_file(arrays, path, metadata={"simgap": json.dumps({**header, "version": 2})})
    with pytest.raises(ValueError, match="checksum is missing"):
        models.load(kind, path)


@pytest.mark.parametrize("kind", models.NPZ)
def test_arrays_of_the_first_version_still_load(kind, folder, tmp_path):
    arrays = models._content(kind, models.whole(kind, folder))[1]
    np.savez(tmp_path / "old.npz", **arrays)
    models.load(kind, tmp_path / "old.npz")


def forged(kind, folder, tmp_path, change):
    header, arrays = read_arrays(models.whole(kind, folder))
    change(header, arrays)
    write_arrays(tmp_path / kind, header, arrays)
    return tmp_path / kind


def test_a_header_that_asks_for_134_gigabytes(tmp_path, folder):
    path = forged("agent", folder, tmp_path, lambda h, a: h["config"].update(replay=4 * 10**9))
    with pytest.raises(ValueError, match=r"agent is damaged.*replay is 4000000000, expected"):
        DDPG.load(path)


def test_a_damaged_policy_is_not_called_an_agent(tmp_path, folder):
    content = models.whole("policy", folder).read_bytes()
    (tmp_path / "cut").write_bytes(content[:-4])
    with pytest.raises(ValueError, match=r"cut is damaged"):
        load_policy(tmp_path / "cut")
    arrays = load_file(models.whole("policy", folder))
    assert np.array_equal(arrays["low"], models.agent().policy.low)


def test_a_process_without_a_factor_is_refused_and_not_waited_for(tmp_path, folder):
    path = forged(
        "process", folder, tmp_path, lambda h, a: a.update(outputscale_=-a["outputscale_"])
    )
    with pytest.raises(ValueError, match=r"process is damaged.*have to be positive"):
        residual.load(path)
