"""Models that Gymnasium ships (MIT licence) are simulators as they are."""

import warnings
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest

from sims.mujoco import AttributeChange, MujocoSimulator
from sims.mujoco.corrected import corrected_files
from tests.sims.mujoco.agreement import agreement

ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
SMOOTH = ("inverted_pendulum", "inverted_double_pendulum", "reacher", "swimmer", "pusher")


@pytest.mark.parametrize("name", [*SMOOTH, "hopper", "walker2d", "ant"])
def test_it_loads_and_steps_as_mujoco_does(name):
    path = ASSETS / f"{name}.xml"
    simulator = MujocoSimulator(str(path))
    rng = np.random.default_rng(0)
    states = simulator.smooth_states(4, rng)
    actions = rng.uniform(-0.1, 0.1, (4, len(simulator.action_channels)))
    after = simulator.step(states, actions)
    model = mujoco.MjModel.from_xml_path(str(path))
    for state, action, found in zip(states, actions, after, strict=True):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = state[: model.nq], state[model.nq :]
        data.ctrl[:] = action
        mujoco.mj_step(model, data, simulator.substeps)
        assert np.allclose(found, np.concatenate([data.qpos, data.qvel]), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", SMOOTH)
def test_its_file_comes_back_corrected(name, tmp_path):
    simulator = MujocoSimulator(str(ASSETS / f"{name}.xml"))
    for what in ("mass of body", "damping of joint", "frictionloss of joint"):
        label = next(label for label in simulator.parameters if label.startswith(what))
        size = 0.1 * simulator.parameters[label].scale
        changed = simulator.with_effects([AttributeChange(label, size)])
        corrected = corrected_files(changed)
        assert not corrected.missing
        for file, text in corrected.files.items():
            (tmp_path / file).write_bytes(text)
        assert agreement(changed, tmp_path / "corrected.xml") < 1e-9


def test_masses_that_the_file_scales_to_a_total_are_left_to_the_yaml():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulator = MujocoSimulator(str(ASSETS / "half_cheetah.xml"))
    changed = simulator.with_effects([AttributeChange("mass of body torso", 0.1)])
    assert "total" in corrected_files(changed).missing[0]
