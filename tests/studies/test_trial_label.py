"""Folders of trials are named after what sets them apart."""

from studies.learning.trial import trial_label


def test_systems_of_one_file_have_folders_of_their_own():
    config = {"estimator": {"class_path": "residual.Linear"}, "budget": {"true_samples": 9}}
    labels = [
        trial_label({**config, "seed": 0, "system": name})
        for name in ("arm.SYSTEM", "robots.arm.LAGGED", "")
    ]
    assert labels == ["arm.SYSTEM-Linear-9-seed0", "arm.LAGGED-Linear-9-seed0", "Linear-9-seed0"]
    other = trial_label({**config, "seed": 0, "learner": "stable_baselines3.SAC"})
    assert other == "SAC-Linear-9-seed0"
