"""Short windows of a robot that strikes the ground: they are followed, and strengths are found."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from residual.gap.candidates import candidates
from residual.gap.data import examine
from residual.gap.horizon import usual_horizon
from residual.gap.impacts.prepare import impact_fitter
from residual.gap.model import Model
from sims.loading import chosen_effects
from studies.robots.cases import NOISE, nominal
from studies.robots.drives import measure


def test_a_payload_is_found_and_windows_are_followed_past_impacts():
    simulator = nominal("hopper")
    logs = measure("hopper", {"mass of body torso": 0.6}, seed=1, runs=8)
    runs = examine(simulator, logs).trajectories
    fitter, _ = impact_fitter(simulator, runs, usual_horizon(simulator, runs))
    (payload,) = candidates(
        simulator, chosen_effects(simulator, ["mass of body torso"]), fitter.samples
    )
    before = fitter.fit(Model(simulator), np.zeros(0))
    # Whatever strength is proposed.
    fit = fitter.fit(Model(simulator, [payload]), np.array([1.2]), before)
    assert fit.theta[0] == pytest.approx(0.6, abs=0.12)
    assert fit.merit < 0.95 * before.merit
    data = fitter.data
    rows = data.windows.index.shape[1] * len(data.sigma)
    left = fit.inner.fitted.residual[:, :rows].reshape(len(data), -1, len(data.sigma))
    # The middle window; encoders err by NOISE, and the nominal's step is ten times the truth's.
    assert np.median(np.sqrt(np.mean((left * data.sigma) ** 2, axis=(1, 2)))) < 6 * NOISE
