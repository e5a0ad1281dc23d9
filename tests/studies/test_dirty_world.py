"""The dirty world: its truth against the simulators, its oracle, and the fast subset end to end."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap.result import Number, Span, Verdict
from sims.checks import check_simulator
from sims.chosen import chosen_effects
from sims.effects.library import library
from sims.effects.store import SecondStore
from studies.hidden.dirty import sets
from studies.hidden.dirty.measure import Sensors, records
from studies.hidden.dirty.report import headlines, judged, misses
from studies.hidden.dirty.score import is_the_store, oracle, same_as
from studies.hidden.dirty.sets import HIDDEN, LEAD, make_set
from studies.hidden.dirty.systems import SYSTEMS, nominal
from studies.hidden.dirty.truth import STORE_TIME, Truth, simulate
from studies.hidden.grid import DirtyBlock, HiddenStudy, trials_of
from studies.hidden_effects import main
from studies.judging.forecasts import plan, relative_error, root_mean_squares

SHARP = Sensors(noise=0.0, coloured=0.0)
LABELS = [(system, label) for system, labels in HIDDEN.items() for label in labels]
#: Of these, every run of the suite takes the ones of two systems.
QUICK = [
    pytest.param(*one, marks=[] if one[0] in ("arm", "oven") else [pytest.mark.long])
    for one in LABELS
]


@pytest.fixture
def short_records(monkeypatch):
    """A quarter of the seconds, at the lowest rates."""
    monkeypatch.setattr(sets, "SECONDS", {name: 0.25 * s for name, s in sets.SECONDS.items()})
    monkeypatch.setattr(sets, "RATES", {name: rates[:1] for name, rates in sets.RATES.items()})


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_clean_truth_moves_as_the_nominal_simulator(system):
    """Two derivations of the same equations, two integrators."""
    period = 0.5 if system == "oven" else 0.02
    runs = records(Truth(system, {}), SHARP, "ramp", period, 300 * period, (3,))
    simulator = nominal(system, period, False, False)
    groups = plan(simulator, runs, 40 * period)
    assert relative_error(simulator, groups) < 1e-4


@pytest.mark.parametrize(("system", "label"), QUICK)
def test_a_hidden_effect_is_what_the_library_calls_so(system, label, short_records):
    """With the library's effect at the true strength, nothing is left."""
    name, _, where = label.partition("@")
    made = make_set({"system": system, "hidden": label, "size": 4.0, "layout": "ramp", "seed": 5})
    strength = made.truth.strength
    assert strength != 0
    truth = Truth(system, {}, effect=name, where=where, strength=strength, soft=1e-3)
    period = 0.25 if system == "oven" else 0.01
    runs = records(truth, SHARP, "single", period, 400 * period, (6,))
    simulator = nominal(system, period, False, False)
    (effect,) = chosen_effects(simulator, [label])
    (field,) = effect.strengths()
    explained = simulator.with_effects([effect.with_values(**{field: strength})])
    # The memory of a lag at the start of a forecast is not measured, so all begins at rest.
    groups = plan(simulator, runs, 200 * period)
    before, after = relative_error(simulator, groups), relative_error(explained, groups)
    assert after < 0.03 * before


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_nominal_simulator_keeps_the_contract_and_hosts_what_is_hidden(system):
    simulator = nominal(system, 0.02, False, False)
    check_simulator(simulator)
    labels = {str(effect) for effect in library(simulator)}
    assert {label for own, label in LABELS if own == system} <= labels


def test_restarts_at_jumps_change_nothing():
    """LSODA in pieces against SciPy's solve_ivp in one go, for a smooth input."""
    truth = Truth("arm", {"mass": 0.02})
    times = np.linspace(0, 3, 61)

    def torque(t):
        return 2 * np.sin(2 * t)

    seen, _ = simulate(truth, [0.3], [torque], times, [0.777, 1.5, 2.2])
    p = truth.parameters()

    def motion(t, y):
        weight = 9.81 * p["mass"] * p["length"] * np.sin(y[0])
        inertia = p["inertia"] + p["mass"] * p["length"] ** 2
        return [y[1], (torque(t) - weight) / inertia]

    expected = solve_ivp(motion, (0, 3), [0.3, 0.0], t_eval=times, rtol=1e-9, atol=1e-11).y.T
    np.testing.assert_allclose(seen, expected, atol=2e-6)


def test_sets_are_repeatable_and_held_runs_are_others(short_records):
    config = {"system": "cart", "hidden": "cart_mass", "size": 4.0, "layout": "many", "seed": 8}
    a, b = make_set(config), make_set(config)
    np.testing.assert_array_equal(a.logs[3].states, b.logs[3].states)
    assert a.truth == b.truth
    assert not np.array_equal(a.logs[0].actions[:50], a.held[0].actions[:50])
    assert all(0.005 < abs(off) < 0.035 for off in a.truth.off.values())


@pytest.mark.parametrize("label", [
    pytest.param("viscous_friction@shoulder", marks=pytest.mark.long), "mass",
    pytest.param("delay@torque", marks=pytest.mark.long),
])  # fmt: skip
def test_the_oracle_finds_the_strength_amid_the_dirt(label):
    made = make_set({"system": "arm", "hidden": label, "size": 6.0, "layout": "many", "seed": 11})
    fit = plan(made.simulator, made.logs, made.horizon, LEAD * made.horizon, 20)
    (found,) = oracle(made, fit)
    (field,) = found.strengths()
    assert getattr(found, field) == pytest.approx(made.truth.strength, rel=0.25)
    held = plan(made.simulator, made.held, made.horizon, LEAD * made.horizon, 20)
    repaired = made.simulator.with_effects([found])
    assert relative_error(repaired, held) < 0.5 * relative_error(made.simulator, held)


def test_a_lead_in_beats_noisy_starts():
    truth = Truth("arm", {})
    runs = records(truth, Sensors(noise=0.01, rates=False), "ramp", 0.02, 24.0, (9,))
    simulator = nominal("arm", 0.02, False, False)
    fitted = root_mean_squares(simulator, plan(simulator, runs, 0.6, 0.2))
    assert set(fitted) == {"shoulder"}  # the rate was not measured
    # Noise of 0.01 rad in every reading; what the lead-in does not settle may add twice as much.
    assert fitted["shoulder"] < 0.03


def test_what_means_the_same_is_the_same():
    arm = nominal("arm", 0.02, False, False)
    assert same_as("constant_load@shoulder", arm) >= {"actuator_bias@torque"}
    assert same_as("", arm) == frozenset()


@pytest.mark.parametrize(
    ("flexible", "rate", "right"), [(0.024, 0.006, True), (0.024, 0.02, False), (0.0, 0.006, False)]
)
def test_a_store_is_right_where_the_oven_has_one_of_that_size(flexible, rate, right):
    config = {"system": "oven", "hidden": "", "size": 3.0, "layout": "ramp", "seed": 4}
    made = make_set(config)
    made = dataclasses.replace(made, truth=dataclasses.replace(made.truth, flexible=flexible))
    numbers = {
        "rate": Number(rate, rate / 1.5, rate * 1.5, "1/s"),
        "time": Number(3.5, 2.0, 6.0, "s"),
    }
    said = Verdict("confirmed", "second_store", "temperature", numbers, (), "", "", Span(1, 1, 1))
    assert is_the_store(said, made) is right


def test_the_oven_with_a_second_mass_is_the_simulator_with_a_store():
    """What the dirt holds there is the library's effect: two derivations, two integrators."""
    truth = Truth("oven", {}, flexible=0.03)
    runs = records(truth, SHARP, "many", 0.5, 600.0, (5,))
    store = SecondStore("temperature", rate=0.03 / STORE_TIME, time=STORE_TIME)
    simulator = nominal("oven", 0.5, False, False)
    groups = plan(simulator, runs, 50.0)  # whole records: the store begins in balance
    with_store = simulator.with_effects([store])
    assert relative_error(with_store, groups) < 0.02 * relative_error(simulator, groups)


def test_the_grid_takes_every_effect_in_turn():
    study = HiddenStudy(dirty=[DirtyBlock("hidden", repeats=2), DirtyBlock("dirt only")])
    cells = trials_of(study)
    assert len(cells) == 2 * len(LABELS) + len(SYSTEMS)
    assert len({cell["seed"] for cell in cells}) == len(cells)
    assert {cell["layout"] for cell in cells} == {"ramp", "single", "many"}


def scored(**changes):
    row = {
        "block": "hidden", "system": "arm", "layout": "ramp", "hidden": "mass", "seed": 1,
        "named": ["mass"], "sure": ["mass"], "wrong_sure": [], "truly_off": [], "unlike": [],
        "first": True,
        "family": True, "among": True, "nominal": 1.0, "corrected": 0.2, "oracle": 0.2,
        "covered": True, "seconds": 3.0,
    }  # fmt: skip
    return row | changes


def test_misses_are_told_in_words():
    rows = [
        scored(),
        scored(seed=2, family=False, first=False, named=["delay@torque"], corrected=1.5),
        scored(seed=3, wrong_sure=["length"], truly_off=["length"], unlike=["mass"]),
    ]
    data = judged([{"config": {}, "answers": {"find_gap": row}} for row in rows])
    told = "\n".join(misses(data))
    assert "seed 2: mass was called delay@torque" in told
    assert "7.50 times the oracle's error" in told
    assert "1.50 times as bad as the nominal" in told
    assert "seed 3: mass: confirmed length (truly off)" in told
    assert "seed 3: mass: records are said to differ in mass" in told
    assert "seed 1" not in told
    table = {what: found for what, _, found in headlines(data).itertuples(index=False)}
    assert table["or its family"].startswith("67 % (2/3")


def test_nothing_to_run_is_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--output", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "nothing to run" in capsys.readouterr().err


def test_an_effect_that_cannot_be_hidden_is_one_line(tmp_path, capsys):
    block = json.dumps([{"name": "hidden", "systems": ["oven"], "effects": ["mass"]}])
    with pytest.raises(SystemExit) as stop:
        main(["--dirty", block, "--output", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "'mass'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_fast_subset(tmp_path, capsys, short_records):
    main(["--config", "studies/configs/hidden_effects/dirty_fast.yaml", "--output", str(tmp_path)])
    assert "or its family" in capsys.readouterr().out
    text = (tmp_path / "dirty.md").read_text()
    assert "## Every cell" in text and "## Misses" in text
    results = [json.loads(p.read_text()) for p in tmp_path.glob("sets/*/results.json")]
    hidden = [r["answers"]["find_gap"] for r in results if r["config"]["hidden"]]
    assert all(answer["family"] for answer in hidden)
    assert all(answer["corrected"] < answer["nominal"] for answer in hidden)
