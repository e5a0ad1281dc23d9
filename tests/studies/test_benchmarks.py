"""The tables hold what was measured, and say what was not."""

import copy
import json

import pytest

from studies import benchmarks
from studies.benchmarks import main
from studies.timing.tables import markdown, tables


def entry(name, seconds, **extra):
    return {"name": name, "params": None, "extra_info": extra, "stats": {"median": seconds}}


def fit(name, points, seconds, error):
    info = {"estimator": name, "points": points, "held_out_error": error}
    return entry(f"test_fit_time[{name}-{points}]", seconds, **info)


def one_row(name, seconds):
    info = {"estimator": name, "rows": 1, "points": 3750, "held_out_error": 0.01}
    return entry(f"test_prediction_latency[{name}-1]", seconds, **info)


@pytest.fixture
def measured():
    learn = entry(
        "test_learn_against_stable_baselines3[pendulum]", 0.5,
        steps_per_second=400.0, stable_baselines3_steps_per_second=160.0,
        times_stable_baselines3=2.5,
    )  # fmt: skip
    update = entry(
        "test_update_against_its_products[pendulum]", 0.4,
        updates_per_second=500.0, share_of_products=0.8,
        matrix_peak_gflop_per_second=90.0, share_of_peak=0.6,
    )  # fmt: skip
    learn["params"] = update["params"] = {"env": "pendulum"}
    speed = {"control_steps_per_second": 9000.0, "gymnasium_steps_per_second": 90000.0}
    speed |= {"times_gymnasium": 0.1, "simulator": "Pendulum", "rows": 1}
    return {
        "datetime": "2030-05-06T07:08:09",
        "machine_info": {
            "cpu": {"brand_raw": "Abacus", "count": 2},
            "packages": {"torch": "9.9"},
            "load_at_start": 0.5,
        },
        "seconds": 300.0,
        "processor_seconds": 240.0,
        "benchmarks": [
            learn,
            update,
            fit("GaussianProcess", 3750, 4.0, 0.001),
            fit("GaussianProcessRegressor", 3750, 80.0, 0.002),
            fit("GaussianProcess", 15000, 9.0, 0.001),
            one_row("Linear", 3e-5),
            one_row("DropoutNet", 3e-4),
            one_row("MLPRegressor", 6e-4),
            entry("test_simulator_speed[Pendulum-1]", 0.1, **speed, error_angle=1e-8,
                  error_rate=2e-7),
            entry("test_environment_speed[Pendulum]", 0.1, **speed),
        ],
    }  # fmt: skip


def at_scale(name, points, seconds, error):
    info: dict[str, object] = {
        "estimator": name,
        "points": points,
        "fit_seconds": seconds,
        "held_out_error": error,
    }
    info |= {"processor_seconds": 0.9 * seconds, "peak_megabytes": 400.0}
    return entry(f"test_fit_at_scale[{name}-{points}]", seconds + 3, **info)


@pytest.fixture
def scaled(measured):
    measured["benchmarks"] += [
        at_scale("Linear", 10_000, 0.2, 0.1),
        at_scale("Linear", 100_000, 2.0, 0.09),
        at_scale("DropoutNet", 10_000, 20.0, 0.2),
        at_scale("DropoutNet", 100_000, 360.0, 0.25),
    ]
    return measured


def rows(page, start):
    """The cells of the table rows that begin with this cell."""
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("|")]
    return [cells for cells in lines if cells[0].startswith(start)]


def without(measured, part):
    kept = copy.deepcopy(measured)
    kept["benchmarks"] = [e for e in measured["benchmarks"] if part not in e["name"]]
    return kept


def test_ours_stands_beside_its_peer(measured):
    page = tables(measured)
    small, large = (r for r in rows(page, "GaussianProcess") if len(r) == 8)
    assert small == ["GaussianProcess", "3750", "4", "0.001", "GaussianProcessRegressor",
                     "80", "0.002", "**20**"]  # fmt: skip
    assert large[4:] == ["GaussianProcessRegressor", "-", "-", "-"]
    (net,) = (r for r in rows(page, "DropoutNet") if len(r) == 8)
    assert net[2] == "0.3" and net[-1] == "**2**"
    (linear,) = (r for r in rows(page, "Linear") if len(r) == 8)
    assert linear[4:] == ["no peer", "-", "-", "-"]
    assert ["pendulum", "400", "160", "**2.50**"] in rows(page, "pendulum")
    assert [r[-2:] for r in rows(page, "Pendulum") if len(r) == 7] == [
        ["1e-08", "2e-07"],
        ["-", "-"],
    ]


def test_every_row_of_a_table_is_as_wide_as_its_head(measured):
    blocks = tables(measured).split("\n\n")
    found = [block.splitlines() for block in blocks if block.startswith("|")]
    assert len(found) == 6
    for lines in found:
        assert len({line.count(" | ") for line in lines}) == 1


def test_targets_are_judged_in_both_directions(measured):
    def verdicts(page):
        return {r[0]: r[3] for r in rows(page, "") if len(r) == 4 and r[3][:2] in ("ye", "no")}

    found = verdicts(tables(measured))
    assert len(found) == 7
    assert found["DDPG, pendulum: times stable-baselines3's updates per second"] == "yes"
    assert found["DDPG, pendulum: share of an update that is its matrix products"].startswith(
        "no: 0.94"
    )
    assert found["Linear: prediction of one row, ms"] == "yes"
    assert found["DropoutNet: prediction of one row, ms"].startswith("no: 1.50")
    assert found["the same: held-out error"] == "yes"
    measured["benchmarks"][3]["extra_info"]["held_out_error"] = 0.0005
    assert verdicts(tables(measured))["the same: held-out error"].startswith("no: 2.00")


def test_machine_versions_and_time_are_said(measured):
    page = tables(measured)
    for words in ("Abacus, 2 cores", "torch 9.9", "2030-05-06", "start: 0.5", "took 5.0 minutes"):
        assert words in page


@pytest.mark.parametrize("missing", ["Regressor", "stable_baselines3", "latency", "Gauss", "["])
def test_what_was_not_run_is_left_out(measured, missing):
    kept = without(measured, missing)
    if not kept["benchmarks"]:
        with pytest.raises(ValueError, match="no benchmarks"):
            tables(kept)
        return
    page = tables(kept)
    assert "None" not in page
    assert ("## Predicting" in page) == (missing != "latency")
    assert ("2.50" in page) == (missing != "stable_baselines3")


def test_a_benchmark_that_failed_is_left_out(measured):
    measured["benchmarks"][0]["extra_info"] = {}
    page = tables(measured)
    assert "2.50" not in page and "## Fitting" in page


def test_nothing_measured_is_one_line_and_exit_code_2(tmp_path, capfd, monkeypatch):
    # A suite without benchmarks stands for one that cannot start.
    (tmp_path / benchmarks.SUITE).mkdir(parents=True)
    monkeypatch.setattr(benchmarks, "ROOT", tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main([])
    assert stopped.value.code == 2
    assert capfd.readouterr().err.splitlines()[-1].startswith("error: nothing was measured")


def test_without_the_suite_the_folder_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(benchmarks, "ROOT", tmp_path)
    with pytest.raises(SystemExit):
        main([])
    assert str(tmp_path / benchmarks.SUITE) in capsys.readouterr().err


def test_the_cost_of_a_fit_is_judged_by_time_and_error(scaled):
    page = tables(scaled)
    found = [(r[0], r[3]) for r in rows(page, "") if len(r) == 4 and "10000" in r[0]]
    assert found == [
        ("Linear: fit of 100000 Leo-sized points, s", "yes"),
        ("the same: held-out error, against that at 10000", "yes"),
        ("DropoutNet: fit of 100000 Leo-sized points, s", "no: 2.00 times that"),
        ("the same: held-out error, against that at 10000", "no: 1.25 times that"),
    ]
    assert ["Linear", "100000", "2", "1.8", "400", "0.09"] in rows(page, "Linear")


def test_the_page_shows_the_cost_of_a_fit_on_log_axes(scaled, tmp_path):
    source, target = tmp_path / "measured.json", tmp_path / "docs" / "page.md"
    source.write_text(json.dumps(scaled))
    main(["--read", str(source), "--output", str(target)])
    assert "](images/fit_scaling.png)" in target.read_text()
    assert (tmp_path / "docs" / "images" / "fit_scaling.png").stat().st_size > 1000
    numbers = (tmp_path / "docs" / "images" / "fit_scaling.csv").read_text()
    assert len(numbers.splitlines()) == 5


def test_a_table_without_rows_is_nothing():
    assert markdown(["a", "b"], []) == ""


def test_the_command_reads_prints_and_writes(measured, tmp_path, capsys):
    source, target = tmp_path / "measured.json", tmp_path / "new" / "page.md"
    source.write_text(json.dumps(measured | {"command": "what was typed"}))
    main(["--read", str(source), "--output", str(target)])
    printed = capsys.readouterr().out
    assert target.read_text() == printed[:-1]
    assert tables(measured) in printed
    assert "`what was typed`" in printed


@pytest.mark.parametrize("content", [None, "not json", "{}", "[]", '{"benchmarks": [{}]}'])
def test_a_wrong_file_is_one_line_and_exit_code_2(tmp_path, capsys, content):
    source, target = tmp_path / "measured.json", tmp_path / "page.md"
    if content is not None:
        source.write_text(content)
    with pytest.raises(SystemExit) as stopped:
        main(["--read", str(source), "--output", str(target)])
    assert stopped.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and str(source) in said and said.count("\n") == 1
    assert not target.exists()


def test_the_section_on_mujoco_models_and_the_rest_leave_each_other_alone(
    measured, tmp_path, monkeypatch, capsys
):
    (tmp_path / "kept.json").write_text(json.dumps(measured))
    page = tmp_path / "page.md"
    speed = {"robot": "arm2", "ours": 1.0, "alike": 2.0, "bare": 4.0, "share": 0.25}
    rival = {"who": "find_gap", "named": "-", "false": "none", "error": 1.0, "nominal": 2.0}
    for size in ("12", "34"):
        rivals = [rival | {"hidden": f"mass {size}", "seconds": 5.0}]
        found = {"speeds": [speed], "rivals": rivals}
        monkeypatch.setattr(benchmarks, "measure_mujoco", lambda found=found: found)
        main(["--mujoco", "--output", str(page)])
        main(["--read", str(tmp_path / "kept.json"), "--output", str(page)])
        text = page.read_text()
        assert text.count("# MuJoCo models") == text.count("# How it was measured") == 1
        assert f"| mass {size} | find_gap |" in text and "| arm2 | 1 | 2 | 4 | 0.25 |" in text
        assert ("mass 12" in text.partition("# MuJoCo")[2]) == (size == "12")
