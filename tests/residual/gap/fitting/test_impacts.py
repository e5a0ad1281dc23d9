"""Short windows of a robot that strikes the ground: they are followed, and strengths are found."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from residual.gap import find_gap
from residual.gap.data.examine import examine
from residual.gap.fitting.impacts import prepare as windows
from residual.gap.fitting.impacts.prepare import impact_fitter
from residual.gap.fitting.intervals import deviations
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.preparation import prepare
from residual.gap.preparation.horizon import usual_horizon
from residual.gap.search import finals
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.mujoco import AttributeChange, MujocoSimulator
from studies.robots.cases import NOISE, nominal
from studies.robots.drives import measure


@pytest.mark.long  # the ball below is a quicker system that strikes the ground
def test_a_payload_is_found_and_windows_are_followed_past_impacts():
    simulator = nominal("hopper")
    logs = measure("hopper", {"mass of body torso": 0.6}, seed=1, runs=4)
    runs = examine(simulator, logs).trajectories
    fitter, _ = impact_fitter(simulator, runs, usual_horizon(simulator, runs), most=40)
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


#: A ball that is pushed off the ground, and falls back on it.
BALL = """
<mujoco>
  <option timestep="0.004" integrator="RK4"/>
  <worldbody>
    <geom type="plane" size="5 5 .1" solref="-4000 -10"/>
    <body name="ball" pos="0 0 .1">
      <joint name="height" type="slide" axis="0 0 1"/><geom size=".1" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="height" ctrlrange="-30 30"/></actuator>
</mujoco>
"""


def ball(folder, lighter):
    """The nominal ball, and a noisy log of one that falls less hard; rates are not seen."""
    (folder / "ball.xml").write_text(BALL)
    simulator = MujocoSimulator(str(folder / "ball.xml"))
    true = simulator.with_effects([AttributeChange("gravity z", change=lighter)])
    rng = np.random.default_rng(0)
    times = simulator.dt * np.arange(601)
    push = np.where(np.sin(5 * times[:-1]) > 0, 12.0, -2.0)[:, None]
    states = true.rollout(np.array([0.3, 0.0]), push)
    states[:, 0] += 5e-4 * rng.standard_normal(len(states))
    states[:, 1] = np.nan
    assert simulator.for_motion([states]).has_contacts
    return simulator, [Trajectory("run", times, states, push)]


def test_forecasts_tell_a_size_and_the_profile_how_well_it_is_known(tmp_path):
    simulator, runs = ball(tmp_path, 1.5)
    runs = examine(simulator, runs).trajectories
    simulator = simulator.for_motion([run.states for run in runs])
    fitter, _ = impact_fitter(simulator, runs, usual_horizon(simulator, runs), most=20)
    effect = chosen_effects(simulator, ["gravity z"])
    (gravity,) = candidates(simulator, effect, fitter.samples)
    before = fitter.fit(Model(simulator), np.zeros(0))
    model = Model(simulator, [gravity])
    # Whatever strength is proposed.
    for proposed in (-3.0, 6.0):
        fit = fitter.fit(model, np.array([proposed]), before)
        assert fit.theta[0] == pytest.approx(1.5, abs=0.05)
        assert fit.merit < 0.8 * before.merit
    known = fitter.profiled(fit)
    half = 1.96 * deviations(known, fitter.blocks)[0]
    assert abs(known.theta[0] - 1.5) <= half < 0.1
    # What is known by its profile stays.
    assert fitter.profiled(known) is known


@pytest.mark.parametrize(("lighter", "kind"), [(0.0, "no_gap"), (1.5, "unexplained")])
def test_forecasts_that_err_more_than_noise_and_have_no_name_are_a_gap(tmp_path, lighter, kind):
    simulator, runs = ball(tmp_path, lighter)
    found = find_gap(simulator, runs, effects=["sensor_offset@height_qpos"], parameter_tolerance=0)
    assert [v.kind for v in found.verdicts if v.kind != "needs_data"] == [kind]


@pytest.mark.long
def test_sets_that_few_windows_leave_open_meet_on_more(tmp_path, monkeypatch):
    simulator, runs = ball(tmp_path, 1.5)
    effects = ["gravity z", "gain of actuator push"]
    # As if few windows told nothing apart.
    monkeypatch.setattr(finals, "finalists", lambda found: [k for k in found.search.tried if k])
    monkeypatch.setattr(prepare, "NAMED_ON", 20)
    monkeypatch.setattr(windows, "WORTH", 1.2)
    found = find_gap(simulator, runs, effects=effects, parameter_tolerance=0)
    assert any("those leave open on 35" in one.says for one in found.quality)
    assert [e.effects for e in found.evidence if e.chosen] == [("gravity z",)]
    assert (found.verdicts[0].kind, found.verdicts[0].effect) == ("confirmed", "gravity z")
    number = found.verdicts[0].parameters["change"]
    assert number.low < 1.5 < number.high
