"""What the bonds of a closed chain tell: a slider-crank, whose angles have a closed form."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

CRANK, ROD = 0.1, 0.3
MODEL = f"""
<mujoco>
  <worldbody>
    <body>
      <joint name="crank" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 {CRANK} 0 0" size="0.01" contype="0" conaffinity="0"/>
      <body name="rod" pos="{CRANK} 0 0">
        <joint name="rod" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 {ROD} 0 0" size="0.01" contype="0" conaffinity="0"/>
      </body>
    </body>
    <body name="ram" pos="{CRANK + ROD} 0 0">
      <joint name="ram" type="slide" axis="1 0 0"/>
      <geom size="0.03" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <equality><connect body1="rod" body2="ram" anchor="{ROD} 0 0"/></equality>
  <actuator><motor joint="crank" name="motor"/></actuator>
</mujoco>
"""
CHANNELS = {"crank_qpos": 0, "rod_qpos": 1, "ram_qpos": 2, "crank_qvel": 3, "rod_qvel": 4}


@pytest.fixture(scope="module")
def bonds(tmp_path_factory):
    from sims.mujoco import MujocoSimulator

    model = tmp_path_factory.mktemp("press") / "press.xml"
    model.write_text(MODEL)
    simulator = MujocoSimulator(model)
    assert [c.name for c in simulator.physical_channels][:3] == list(CHANNELS)[:3]
    return simulator.bonds


def path(turns=2.0, rows=200):
    """Angles of crank and rod and place of the ram, and their rates by time, along whole turns."""
    crank = np.linspace(0, 2 * np.pi * turns, rows)
    tilt = np.arcsin(CRANK * np.sin(crank) / ROD)
    ram = CRANK * np.cos(crank) + ROD * np.cos(tilt) - CRANK - ROD
    positions = np.stack([crank, -tilt - crank, ram], axis=1)
    rates = np.gradient(positions, axis=0) * rows
    return np.concatenate([positions, rates], axis=1)


def unknown(*names):
    return np.array([any(i == CHANNELS[name] for name in names) for i in range(6)])


def test_what_was_not_logged_is_worked_out_over_dead_centres(bonds):
    true = path()
    seen = true.copy()
    seen[:, 1] = 0.0
    told = bonds.told(seen, unknown("rod_qpos", "rod_qvel"))
    assert told.tolist() == [False, True, False, False, True, False]
    assert np.abs(bonds.filled(seen, told)[:, :3] - true[:, :3]).max() < 1e-6


def test_one_position_tells_both_others(bonds):
    true = path(turns=0.2)
    seen = true.copy()
    seen[:, [1, 2]] = 0.0
    told = bonds.told(seen, unknown("rod_qpos", "ram_qpos"))
    assert told.tolist() == [False, True, True, False, False, False]
    assert np.abs(bonds.filled(seen, told)[:, :3] - true[:, :3]).max() < 1e-6


def test_what_nothing_tells_is_not_told(bonds):
    names = "crank_qpos", "rod_qpos", "ram_qpos"
    assert not bonds.told(path(), unknown(*names)).any()


def test_noise_moves_what_is_told_by_no_more_and_nothing_else(bonds):
    true, rng = path(), np.random.default_rng(0)
    seen = true + 1e-3 * rng.standard_normal(true.shape)
    seen[:, 1] = 0.0
    found = bonds.filled(seen, unknown("rod_qpos"))
    assert np.abs(found[:, 1] - true[:, 1]).max() < 6e-3
    assert (np.delete(found, 1, axis=1) == np.delete(seen, 1, axis=1)).all()
