"""What the benchmarks measured, as tables of ours beside the peer a user would reach for."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from studies.reporting.markdown import filled, markdown
from studies.timing import fit_scaling

PEERS = {"GaussianProcess": "GaussianProcessRegressor", "DropoutNet": "MLPRegressor"}
OURS = ("Linear", "GaussianProcess", "DropoutNet")
NOTHING = "-"
SCALING = "## Cost of a fit against size"

# What the project asks of itself; every other figure is for information.
LEAST_TIMES_DDPG = 2.5
LEAST_SHARE_OF_PRODUCTS = 0.85
LEAST_TIMES_GP = 10.0
MOST_ONE_ROW = 0.2  # ms
LEAST_CONTROL_STEPS = 8000.0
MOST_ANSWER = {"Pendulum": 60.0, "PendulumEquation": 20.0, "two joints": 180.0}

Record = dict[str, Any]


def records(data: Mapping[str, Any]) -> list[Record]:
    """What the benchmarks in the JSON of pytest-benchmark found, flat; failed ones are left out.

    Args:
        data: The content of a file that ``pytest --benchmark-json`` wrote.

    Returns:
        One dict per benchmark: ``test`` (the function's name), its parameters, its
        ``extra_info`` and ``seconds``, the median time of a round.

    Raises:
        ValueError: It is no such file, or it holds no benchmarks.
    """
    found = data.get("benchmarks") if isinstance(data, Mapping) else None
    if not found:
        raise ValueError("no benchmarks in it: expected a file that --benchmark-json wrote")
    try:
        return [
            {"test": re.sub(r"\[.*", "", entry["name"])}
            | (entry.get("params") or {})
            | entry["extra_info"]
            | {"seconds": entry["stats"]["median"]}
            for entry in found
            if entry["extra_info"]  # empty if the benchmark failed
        ]
    except (KeyError, TypeError) as problem:
        raise ValueError(
            f"a benchmark in it lacks {problem}: expected a file that --benchmark-json wrote"
        ) from None


def tables(data: Mapping[str, Any]) -> str:
    """Every table, in Markdown, with the machine and the versions.

    Args:
        data: The content of a file that ``pytest --benchmark-json`` wrote. What is not in it
            is ``-`` in the tables or, where nothing is left, a table fewer.

    Raises:
        ValueError: See ``records``.
    """
    found = records(data)
    parts = [
        ("Machine", _machine(data)),
        ("What the project asks of itself", _targets(found)),
        ("DDPG", _ddpg(found)),
        ("Fitting", _beside_peers(found, "test_fit_time", "points", "s", 1.0)),
        (SCALING.removeprefix("## "), fit_scaling.table(found)),
        ("Predicting", _beside_peers(found, "test_prediction_latency", "rows", "ms", 1e3)),
        ("Simulators", _simulators(found)),
        ("find_gap, from logs to verdicts", _answers(found)),
    ]
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text) + "\n"


def mujoco_tables(measured: Mapping[str, Sequence[Record]]) -> dict[str, str]:
    """What ``tests/benchmarks/mujoco_models.py`` measured, as tables by the same names."""
    speeds = {
        "model": "{robot}",
        "rows that differ": "{ours:,.0f}",
        "rows alike": "{alike:,.0f}",
        "`mujoco.rollout`": "{bare:,.0f}",
        "share": "{share:.2f}",
    }
    rivals = {
        "hidden": "{hidden}",
        "": "{who}",
        "named: change (95 % interval)": "{named}",
        "false names": "{false}",
        "held-out error": "{error:.2f} mrad (nominal {nominal:.2f})",
        "s": "{seconds:.0f}",
    }
    columns = {"speeds": speeds, "rivals": rivals}
    return {name: filled(measured[name], columns[name]) for name in columns}


def _machine(data: Mapping[str, Any]) -> str:
    info = data.get("machine_info", {})
    cpu = info.get("cpu", {})
    packages = ", ".join(f"{name} {v}" for name, v in info.get("packages", {}).items())
    lines = [
        f"{cpu.get('brand_raw', 'unknown processor')}, {cpu.get('count', '?')} cores, "
        f"{info.get('system', '?')}; Python {info.get('python_version', '?')}; {packages}.",
        f"Measured {data.get('datetime', '')[:10]}, one thread.",
    ]
    if "load_at_start" in info:
        # Beside whom it ran decides how far to trust the figures.
        lines.append(f"Load of the machine at the start: {info['load_at_start']:.1f}.")
    if "seconds" in data:
        wall, processor = data["seconds"] / 60, data["processor_seconds"] / 60
        lines.append(f"The suite took {wall:.1f} minutes, {processor:.1f} of them processor time.")
    return " ".join(lines)


def _targets(found: Sequence[Record]) -> str:
    rows: list[list[str]] = []

    def add(what: str, value: float, form: str, limit: float, at_least: bool = True) -> None:
        met = value >= limit if at_least else value <= limit
        sign = "at least" if at_least else "at most"
        verdict = "yes" if met else f"no: {value / limit:.2f} times that"
        rows.append([what, format(value, form), f"{sign} {limit:{form}}", verdict])

    asked = (
        ("test_learn_against_stable_baselines3", "times stable-baselines3's updates per second",
         "times_stable_baselines3", LEAST_TIMES_DDPG),
        ("test_update_against_its_products", "share of an update that is its matrix products",
         "share_of_products", LEAST_SHARE_OF_PRODUCTS),
    )  # fmt: skip
    for test, what, figure, least in asked:
        for record in _of(found, test):
            add(f"DDPG, {record['env']}: {what}", record[figure], ".2f", least)
    own = _one(found, "test_fit_time", estimator="GaussianProcess", points=3750)
    peer = _one(found, "test_fit_time", estimator=PEERS["GaussianProcess"], points=3750)
    if own and peer:
        what = "Gaussian process, fit at 3750 points: times faster than scikit-learn's"
        add(what, peer["seconds"] / own["seconds"], ".1f", LEAST_TIMES_GP)
        error, most = own["held_out_error"], peer["held_out_error"]
        add("the same: held-out error", error, ".3g", most, at_least=False)
    for what, value, form, most in fit_scaling.targets(found):
        add(what, value, form, most, at_least=False)
    for name in OURS:
        if own := _one(found, "test_prediction_latency", estimator=name, rows=1):
            took = 1e3 * own["seconds"]
            add(f"{name}: prediction of one row, ms", took, ".3f", MOST_ONE_ROW, at_least=False)
    for system, most in MOST_ANSWER.items():
        seconds = [r["processor_seconds"] for r in found if r.get("system") == system]
        if seconds:
            what = f"find_gap, {system}: slowest answer, processor s"
            add(what, max(seconds), ".1f", most, at_least=False)
    if own := _one(found, "test_simulator_speed", simulator="Pendulum", rows=1):
        what = "Pendulum: control steps per second, one row"
        add(what, own["control_steps_per_second"], ".0f", LEAST_CONTROL_STEPS)
    return markdown(["figure", "measured", "wanted", "met"], rows)


def _ddpg(found: Sequence[Record]) -> str:
    learn = {
        "sizes": "{env}",
        "ours, steps/s": "{steps_per_second:.0f}",
        "stable-baselines3, steps/s": "{stable_baselines3_steps_per_second:.0f}",
        "times": "**{times_stable_baselines3:.2f}**",
    }
    update = {
        "sizes": "{env}",
        "updates/s alone": "{updates_per_second:.0f}",
        "share of its own matrix products": "{share_of_products:.2f}",
        "sgemm peak, Gflop/s": "{matrix_peak_gflop_per_second:.0f}",
        "share of peak": "**{share_of_peak:.2f}**",
    }
    act = {"sizes": "{env}", "one action, µs": "{microseconds:.0f}"}
    parts = [
        filled(_of(found, "test_learn_against_stable_baselines3"), learn),
        filled(_of(found, "test_update_against_its_products"), update),
        filled(_of(found, "test_act_one_row"), act),
    ]
    return "\n\n".join(filter(None, parts))


def _beside_peers(found: Sequence[Record], test: str, size: str, unit: str, times: float) -> str:
    rows = []
    sizes = sorted({record[size] for record in _of(found, test)})
    for name in OURS:
        for n in sizes:
            own = _one(found, test, estimator=name, **{size: n})
            if own is None:
                continue
            peer = _one(found, test, estimator=PEERS.get(name), **{size: n})
            ratio = f"**{peer['seconds'] / own['seconds']:.3g}**" if peer else NOTHING
            ours, theirs = _timed(own, times), _timed(peer, times)
            rows.append([name, str(n), *ours, PEERS.get(name, "no peer"), *theirs, ratio])
    head = ["ours", size, unit, "held-out error", "peer", unit, "held-out error", "times"]
    return markdown(head, rows)


def _timed(record: Record | None, times: float) -> list[str]:
    if record is None:
        return [NOTHING, NOTHING]
    return [f"{times * record['seconds']:.3g}", f"{record['held_out_error']:.2g}"]


def _simulators(found: Sequence[Record]) -> str:
    speeds = [*_of(found, "test_simulator_speed"), *_of(found, "test_environment_speed")]
    columns = {
        "simulator": "{simulator}",
        "rows": "{rows}",
        "control steps/s": "{control_steps_per_second:.0f}",
        "Gymnasium Pendulum-v1, steps/s": "{gymnasium_steps_per_second:.0f}",
        "times": "**{times_gymnasium:.3g}**",
        "one-step error, rad": "{error_angle:.1g}",
        "rad/s": "{error_rate:.1g}",
    }
    return filled(speeds, columns)


def _answers(found: Sequence[Record]) -> str:
    asked = [*_of(found, "test_find_gap_time"), *_of(found, "test_find_gap_time_of_an_arm")]
    columns = {
        "simulator": "{system}",
        "rows": "{rows}",
        "hidden": "{hidden}",
        "first verdict": "{kind}: {named}",
        "processor s": "{processor_seconds:.1f}",
    }
    return filled(asked, columns)


def _of(found: Sequence[Record], test: str) -> list[Record]:
    return [record for record in found if record["test"] == test]


def _one(found: Sequence[Record], test: str, **values: Any) -> Record | None:
    matching = (record for record in _of(found, test) if values.items() <= record.items())
    return next(matching, None)
