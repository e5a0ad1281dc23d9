"""A verdict claims what pairs of policies show, and no more."""

import numpy as np
import pandas as pd
import pytest

from studies.learnt.figures import drawn_steps, episodes_figure
from studies.learnt.report import write_report
from studies.learnt.sections import policies_once
from studies.learnt.statistics import above, to_digits
from studies.learnt.tables import tables_of
from studies.learnt.verdict import headline
from studies.learnt.words import returns_by_start

STARTS = [
    -40.0,
    -10.0,
    -90.0,
    -5.0,
    -60.0,
]  # what a start is worth differs by far more than policies
ABOUT = {
    "name": "tanks", "dt": 2.0, "groups": {"upper": ["upper"], "lower": ["lower"]},
    "states": [{"name": "upper", "unit": "m"}, {"name": "lower", "unit": "m"}],
    "actions": [], "shown": ["upper"], "path": [], "target": None, "published": {},
}  # fmt: skip


def policy(name, returns, iteration=0, samples=0):
    tests = [{"start": [0.1 * k, 0.0], "return": value} for k, value in enumerate(returns)]
    return {
        "name": name, "iteration": iteration, "true_samples": samples, "tests": tests,
        "return_true": sum(returns) / len(returns), "return_model": 0.0, "curve": [],
    }  # fmt: skip


def more(gain, wobble=0.5):
    """Returns that are better by so much from the same starts, hardly by the same."""
    return [value + gain + wobble * (-1) ** k for k, value in enumerate(STARTS)]


def trial(learnt, control=None, seed=0, error=0.01, gap=0.2, target=None):
    policies = [policy("idealised", STARTS)]
    accuracy = []
    for k, returns in enumerate(learnt, start=1):
        policies.append(policy("difference", returns, k, 450 * k))
        one_step = {"upper": error, "lower": error and error / 2}
        visited = {"one_step": one_step, "multi_step": {}, "coverage90": None,
                   "gap": {"upper": gap, "lower": gap}}  # fmt: skip
        accuracy.append({"iteration": k, "true_samples": 450 * k, "fit_seconds": 1.0,
                         "visited": visited})  # fmt: skip
    if control:
        policies.append(policy("control", control, len(learnt)))
    about = ABOUT | {"target": target}
    return {"about": about, "system": "tanks", "policies": policies, "accuracy": accuracy,
            "label": "Linear", "seed": seed}  # fmt: skip


def verdict(*trials):
    rows, errors = tables_of(trials)
    found, tiles = headline(policies_once(rows), errors, trials[0]["about"])
    return found, tiles


def test_a_gap_is_closed_where_pairs_show_it_and_that_the_model_did_it():
    found, tiles = verdict(trial([more(8)], control=more(1)))
    assert (found.label, found.tone) == ("gap closed, on one seed", "good")
    assert "over 5 common starts the gain is 8.1 ± 0.7" in found.text.replace("\u00a0", " ")
    assert "worth 7.0 ± 0.0" in found.text.replace("\u00a0", " ")
    assert tiles.items["gain"].startswith("8.1")


def test_without_a_control_the_cause_is_not_shown():
    found, _ = verdict(trial([more(8)]))
    assert (found.label, found.tone) == ("better, cause not shown", "warning")
    assert "--budget.control_steps" in found.text
    passed, _ = verdict(trial([more(8)], target=-35.0))
    assert (passed.label, passed.tone) == ("better, cause not shown", "good")
    assert "target of -35 is passed" in passed.text


def test_a_control_that_does_as_well_shows_no_cause():
    as_well = [value + (-3) ** k / 9 for k, value in enumerate(more(8))]
    assert verdict(trial([more(8)], control=as_well))[0].label == "better, cause not shown"
    half = verdict(trial([more(8)], control=more(5)))[0]
    assert half.label == "better, cause not shown"  # one seed: as likely the luck of training


@pytest.mark.parametrize(("error", "label"), [(0.19, "gap"), (0.21, "most of the gap")])
def test_a_third_of_the_gap_that_is_left_is_not_called_closed(error, label):
    several = [trial([more(8)], control=more(1), error=error, seed=seed) for seed in range(3)]
    assert verdict(*several)[0].label == f"{label} closed"


@pytest.mark.parametrize(
    ("high", "label", "tone"),
    [(0.4, "gap closed, on one seed", "good"), (0.75, "better, gap may remain", "warning")],
)
def test_rollouts_that_leave_open_what_is_left_close_no_gap(high, label, tone):
    one = trial([more(8)], control=more(1), error=0.14)
    one["accuracy"][0]["visited"]["one_step_95"] = {"upper": (0.05, high), "lower": (0.01, 0.1)}
    found, tiles = verdict(one)
    assert (found.label, found.tone) == (label, tone)
    assert tiles.items[f"one-step error, share of gap (0.05 to {high})"] == "0.14"
    assert ("cannot tell from 0.75" in found.text) == (high == 0.75)
    # Of several seeds their spread tells more.
    several = [trial([more(8)], control=more(1), error=0.14, seed=seed) for seed in range(3)]
    several[0]["accuracy"] = one["accuracy"]
    assert verdict(*several)[0].label == "gap closed"


def test_an_idealised_policy_that_had_only_begun_to_learn_is_told():
    """As much training again then does what the difference model seems to do."""
    for before, again, told in ((-509.0, -100.0, True), (-60.0, -58.0, False), (3.0, 4.0, False)):
        one = trial([more(8)], control=more(1))
        one["policies"][0]["return_model"], one["policies"][-1]["return_model"] = before, again
        found, _ = verdict(one)
        assert ("only begun to learn" in found.text) == told


def test_an_update_that_was_better_is_told():
    found, _ = verdict(trial([more(20), more(2)]))
    assert "Update 1 had returned -20.9: not every update helps." in found.text
    better, _ = verdict(trial([more(2), more(20)]))
    assert "not every update" not in better.text


@pytest.mark.parametrize("error", [0.5, 0.89, 1.6])
def test_nothing_is_closed_by_a_model_that_leaves_the_gap(error):
    found, _ = verdict(trial([more(8)], control=more(1), error=error))
    assert (found.label, found.tone) == ("better, gap remains", "warning")
    assert f"errs by {error:.2g} of the gap in upper" in found.text


def test_a_gain_within_its_interval_is_not_settled():
    uneven = [value + gain for value, gain in zip(STARTS, [30, -12, 9, -8, 4], strict=True)]
    found, _ = verdict(trial([uneven], control=STARTS))
    assert (found.label, found.tone) == ("not settled", "warning")
    assert "More seeds, or more starts (true_episodes)" in found.text
    kept, _ = verdict(trial([more(-0.01, wobble=0)]))
    assert kept.label == "unchanged" and "-0.010" in kept.text
    worse, _ = verdict(trial([more(-8)]))
    assert (worse.label, worse.tone) == ("worse", "bad")


def test_one_pair_has_no_interval_and_settles_nothing():
    one = trial([more(8)], control=more(1))
    for record in one["policies"]:
        record["tests"] = record["tests"][:1]
    found, _ = verdict(one)
    assert found.label == "better, not settled" and "no interval" in found.text
    # Of several seeds each counts as one.
    found, _ = verdict(*(one | {"seed": seed} for seed in (0, 1, 2)))
    assert found.label == "gap closed" and "Seed by seed" in found.text


def test_one_test_done_again_is_no_second_one():
    """From a fixed start all tests of a policy are the same."""
    fixed = trial([[-20.0] * 5], control=[-39.0] * 5)
    for record in fixed["policies"]:
        for test in record["tests"]:
            test["start"] = [3.1, 0.0]
    fixed["policies"][0]["tests"] = [{"start": [3.1, 0.0], "return": -41.0}] * 5
    assert verdict(fixed)[0].label == "better, not settled"
    # Chance in the true system gives other returns from the same state.
    lucky = {"tests": [{"start": [3.1], "return": r} for r in (-4.0, -6.0, -5.0)]}
    assert list(returns_by_start(lucky).values()) == [-4.0, -6.0, -5.0]


def test_starts_that_are_not_common_make_no_pairs():
    apart = trial([more(8)], control=more(1))
    for number, record in enumerate(apart["policies"]):
        for test in record["tests"]:
            test["start"][1] = float(number)
    found, _ = verdict(apart)
    assert found.label == "better, not settled" and "no interval" in found.text


def test_a_true_system_like_the_simulator_is_said_to_be():
    # What a model learnt of nothing is exact, or infinitely wrong, which has no number.
    for error in (0.0, None):
        found, tiles = verdict(trial([more(-3)], error=error, gap=1e-7))
        assert (found.label, found.tone) == ("no gap found", "neutral")
        assert "does what the simulator does" in found.headline
        assert not any("error" in name for name in tiles.items)
    unknown = trial([more(8)], control=more(1), error=None, gap=None)
    assert verdict(unknown)[0].label == "gap closed, on one seed"


def test_a_channel_without_a_gap_has_no_error():
    found = trial([more(8)], control=more(1))
    visited = found["accuracy"][0]["visited"]
    visited["one_step"]["upper"], visited["gap"]["upper"] = 7.0, 1e-9
    assert verdict(found)[0].label == "gap closed, on one seed"


def test_the_last_update_is_judged_and_not_the_luckiest():
    assert verdict(trial([more(20), more(2)]))[0].headline.endswith(
        "to -38.9 (Linear, update 2, 900 true samples, 30.0 min)."
    )
    reached = verdict(trial([more(20), more(2)], target=-30.0))[0]
    assert "update 1" in reached.headline and "is passed" in reached.text


def test_pairs_are_of_one_seed_one_start_and_the_same_settings():
    def rows(returns, **more):
        by_start = dict(enumerate(returns))
        mean = sum(returns) / len(returns)
        return pd.DataFrame([{"seed": 0, "return_true": mean, "by_start": by_start} | more])

    assert above(rows([1.0, 5.0]), rows([0.5, 2.0])) == [0.5, 3.0]
    assert above(rows([1.0, 5.0]), rows([2.0])) == [-1.0]  # the start that both have
    assert above(rows([1.0, 5.0]), rows([0.5, 2.0], by_start={})) == [1.75]
    several = [pd.concat([rows(r), rows(r, seed=1)]) for r in ([1.0, 5.0], [0.5, 2.0])]
    assert above(*several) == [1.75, 1.75]
    assert above(rows([1.0], settings="a"), rows([0.0], settings="b")) == []


def test_slow_systems_are_drawn_over_enough_of_their_periods():
    about = ABOUT | {"dt": 60.0, "states": [{"name": "upper", "unit": "rad", "angle": True}]}
    episode = {"states": np.arange(151.0)[:, None], "actions": np.zeros((150, 1))}
    _, numbers = episodes_figure(about, {"idealised": episode})
    assert numbers["time_s"].max() == 60.0 * 99
    assert drawn_steps(0.05) == 200  # ten seconds


def test_episodes_are_drawn_from_begins_within_half_a_turn():
    about = ABOUT | {"states": [{"name": "upper", "unit": "rad", "angle": True}]}
    begins = {"a": 13.0, "b": -3.0, "c": 3.1}
    swing = np.linspace(0.0, 9.0, 40)  # Each ends more than a turn from where it begins.
    episodes = {name: {"states": (begin + swing)[:, None]} for name, begin in begins.items()}
    episodes["b"]["states"] = (-3.0 - swing)[:, None]
    _, numbers = episodes_figure(about, episodes)
    first = numbers.groupby("policy")["value"].first()
    assert abs(first - first["a"]).max() <= np.pi and abs(first["a"]) <= np.pi
    for name, begin in begins.items():
        assert np.isclose((first[name] - begin) / (2 * np.pi) % 1, [0, 1], atol=1e-9).any()


@pytest.mark.parametrize(
    ("steps", "says"),
    [(20, "One whole episode of each policy on the true system"), (101, "The first 200\u00a0s on")],
)
def test_a_caption_says_how_much_of_episodes_is_drawn(tmp_path, steps, says):
    episode = {"states": np.zeros((steps, 2)), "actions": np.zeros((steps - 1, 0))}
    write_report([trial([more(8)])], tmp_path, {"idealised": episode})
    assert says in (tmp_path / "report.html").read_text()


def test_numbers_of_a_column_have_the_same_digits(tmp_path):
    assert [to_digits(v, 5) for v in (-41, -93.618, 0.0, 0.0123456, 12345.6, 123456.7)] == [
        "-41.000", "-93.618", "0", "0.012346", "12346", "123457",
    ]  # fmt: skip
    told = write_report([trial([more(8)])], tmp_path)
    assert "-41.000" in told and "0.00750" in told


def test_the_terminal_says_what_its_columns_mean(tmp_path):
    told = write_report([trial([more(8)], control=more(1))], tmp_path)
    assert "above control" in told and "7.0\u00a0±\u00a00.0" in told
    for words in ("Above control: start by start", "Error: of one step", "In 90 %: share",
                  "each the mean of 5 starts, the same for all policies"):  # fmt: skip
        assert words in told
    page = (tmp_path / "report.html").read_text()
    assert "Above control: start by start" in page
