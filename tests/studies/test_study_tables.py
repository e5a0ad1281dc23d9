"""Tables keep apart what differs."""

import pandas as pd
import pytest

from studies.learnt.sections import legend
from studies.learnt.statistics import common_starts
from studies.learnt.tables import apart, policy_rows
from studies.learnt.words import duration


def trial(seed, label="Linear", **settings):
    config = {"seed": seed, "estimator": {"class_path": label}, "uncertainty_penalty": 0.0}
    config |= {"budget": {"true_samples": 40, "iterations": 1}, "ddpg": {"gamma": 0.99}}
    policy = {"name": "idealised", "return_true": -1.0}
    return {"label": label, "seed": seed, "config": config | settings, "policies": [policy]}


def labels(*trials):
    return [named["label"] for named in apart(trials)]


def test_seeds_and_estimators_need_no_other_label():
    assert labels(trial(0), trial(1), trial(0, "Other")) == ["Linear", "Linear", "Other"]
    assert "settings" not in policy_rows(apart([trial(0), trial(1)]))


def test_a_mean_never_mixes_settings():
    gentle, bold = trial(0, ddpg={"gamma": 0.9}), trial(0)
    assert labels(gentle, bold) == ["Linear, ddpg.gamma=0.9", "Linear, ddpg.gamma=0.99"]
    rows = policy_rows(apart([gentle, bold]))
    assert list(rows["settings"]) == ["ddpg.gamma=0.9", "ddpg.gamma=0.99"]


def test_what_has_a_column_is_no_part_of_the_label():
    small, large = ({"true_samples": n, "iterations": n} for n in (1, 2))
    assert labels(trial(0, budget=small), trial(0, budget=large)) == ["Linear", "Linear"]


def test_settings_that_older_trials_lack_keep_them_apart():
    old = trial(0)
    del old["config"]["uncertainty_penalty"]
    assert labels(old, trial(0)) == [
        "Linear, uncertainty_penalty=None",
        "Linear, uncertainty_penalty=0.0",
    ]


@pytest.mark.parametrize(("other", "same"), [((0.1, 0.0), True), ((0.7, 0.0), False)])
def test_the_legend_says_whether_policies_had_common_starts(other, same):
    first = {((0.1, 0.0), 0): 1.0, ((0.2, 0.0), 0): 2.0}
    second = {(other, 0): 3.0, ((0.2, 0.0), 0): 4.0, ((0.2, 0.0), 1): 4.5}
    rows = pd.DataFrame({"seed": [0, 0, 1], "by_start": [first, second, {((5.0, 0.0), 0): 1.0}]})
    assert common_starts(rows) is same
    (says,) = legend(pd.DataFrame(), rows)
    assert ("the same for all policies" in says) is same
    assert ("begins elsewhere under the same seed" in says) is not same


@pytest.mark.parametrize(("seconds", "text"), [(119, "119 s"), (180, "3.0 min"), (21600, "6.0 h")])
def test_durations_are_told_in_units_of_their_size(seconds, text):
    assert duration(seconds) == text
