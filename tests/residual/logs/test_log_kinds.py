"""Logs of every kind give the same trajectories from the same numbers."""

import json

import h5py
import numpy as np
import pandas as pd
import pytest
from mcap.writer import Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as Ros2Writer

from residual.logs import Column, LogError, LogFormat, read_logs
from sims.simulator import Channel
from studies.log_info import main as log_info

STATES = (
    Channel("hip_qpos", "rad", "position"),
    Channel("knee_qpos", "rad", "position"),
    Channel("hip_qvel", "rad/s", "rate", rate_of="hip_qpos"),
)
ACTIONS = (Channel("motor", "N m", "input"),)
TIMES = 0.01 * np.arange(120)
HIP, KNEE = np.sin(3 * TIMES), 0.4 * np.cos(2 * TIMES)
MOTOR = np.round(2 * np.sin(5 * TIMES), 3)
NANO = 1_000_000_000
BEGIN = 1_700_000_000


def check(data, actions=MOTOR[:-1], samples=120):
    (run,) = data.trajectories
    assert len(run.times) == samples
    assert np.allclose(np.diff(run.times), 0.01, atol=1e-7)
    assert np.allclose(run.states[:, 0], HIP[-samples:])
    assert np.allclose(run.states[:, 1], KNEE[-samples:])
    assert np.isnan(run.states[:, 2]).all()
    assert np.allclose(run.actions[:, 0], actions, atol=1e-9)
    return data


MCAP = LogFormat(
    states={
        "hip_qpos": "/joint_states.position.hip",
        "knee_qpos": "/joint_states.position.knee",
    },
    actions={"motor": "/command.data.0"},
)


def joint_state(k):
    # The order of joints in a message is the robot's, not ours.
    return {"name": ["knee", "hip"], "position": [KNEE[k], HIP[k]], "velocity": []}


def json_mcap(path, late=0.0):
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        topics = {
            name: writer.register_channel(name, "json", schema)
            for name in ("/joint_states", "/command")
        }
        for k, t in enumerate(TIMES):
            stamp = BEGIN * NANO + round(t * NANO)
            for name, message, at in (
                ("/joint_states", joint_state(k), stamp),
                ("/command", {"data": [MOTOR[k]]}, stamp + round(late * NANO)),
            ):
                content = json.dumps(message).encode()
                writer.add_message(topics[name], log_time=at, data=content, publish_time=at)
        writer.finish()
    return path


def test_mcap_with_json(tmp_path):
    data = check(read_logs([json_mcap(tmp_path / "run.mcap")], STATES, ACTIONS, MCAP))
    assert "aligned" not in [finding.kind for finding in data.findings]


def test_commands_on_another_clock_are_averaged_by_their_time_stamps(tmp_path):
    path = json_mcap(tmp_path / "run.mcap", late=0.004)
    data = read_logs([path], STATES, ACTIONS, MCAP)
    # 4 ms of every interval still have the command before; the first interval has none.
    expected = 0.4 * MOTOR[:-2] + 0.6 * MOTOR[1:-1]
    check(data, expected, samples=119)
    assert "aligned" in [finding.kind for finding in data.findings]


def test_commands_that_never_come_while_something_is_measured(tmp_path):
    path = json_mcap(tmp_path / "run.mcap", late=1e4)
    with pytest.raises(LogError, match="are the clocks the same"):
        read_logs([path], STATES, ACTIONS, MCAP)


ROS2 = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def test_mcap_with_ros2_joint_states(tmp_path):
    path = tmp_path / "run.mcap"
    with path.open("wb") as stream:
        writer = Ros2Writer(stream)
        states = writer.register_msgdef("sensor_msgs/msg/JointState", ROS2)
        for k, t in enumerate(TIMES):
            whole, part = divmod(round(t * NANO), NANO)
            header = {"stamp": {"sec": BEGIN + whole, "nanosec": part}, "frame_id": ""}
            message = joint_state(k) | {"header": header, "effort": [0.0, MOTOR[k]]}
            # Recorded late and unevenly: the header's stamp counts.
            at = BEGIN * NANO + round((t + 0.003 * (k % 2)) * NANO)
            writer.write_message("/joint_states", states, message, log_time=at, publish_time=at)
        writer.finish()
    columns = LogFormat(states=MCAP.states, actions={"motor": "/joint_states.effort.hip"})
    check(read_logs([path], STATES, ACTIONS, columns))


def test_mcap_with_protobuf(tmp_path):
    from google.protobuf.struct_pb2 import ListValue, Value

    path = tmp_path / "run.mcap"
    with path.open("wb") as stream, ProtobufWriter(stream) as writer:
        for k, t in enumerate(TIMES):
            numbers = [Value(number_value=x) for x in (HIP[k], KNEE[k], MOTOR[k])]
            at = round(t * NANO)
            writer.write_message("/row", ListValue(values=numbers), log_time=at, publish_time=at)
    columns = LogFormat(
        states={
            "hip_qpos": "/row.values.0.number_value",
            "knee_qpos": "/row.values.1.number_value",
        },
        actions={"motor": "/row.values.2.number_value"},
    )
    check(read_logs([path], STATES, ACTIONS, columns))


def test_fields_of_an_mcap_are_listed_when_none_fits(tmp_path, capsys):
    path = json_mcap(tmp_path / "run.mcap")
    with pytest.raises(LogError, match=r"/joint_states\.position\.hip"):
        read_logs([path], STATES, ACTIONS)
    log_info([str(path)])
    listed = capsys.readouterr().out
    assert "/joint_states.position.hip" in listed
    assert "100" in listed
    (tmp_path / "broken.mcap").write_bytes(path.read_bytes()[:200])
    with pytest.raises(SystemExit):
        log_info([str(tmp_path / "broken.mcap")])
    assert "cannot be read as MCAP" in capsys.readouterr().err


def test_log_info_knows_the_clock_by_its_header(tmp_path, capsys):
    path = tmp_path / "run.csv"
    rows = [f"{10 * i},{value}" for i, value in enumerate(HIP)]
    path.write_text("\n".join(["Time (ms),hip", *rows]))
    log_info([str(path)])
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "hip" in line]
    assert line.split()[1:3] == ["120", "100"]


FLAT = {"time": TIMES, "hip_qpos": HIP, "knee_qpos": KNEE, "motor": MOTOR}


def test_hdf5_with_datasets_side_by_side(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["time"] = TIMES
        file["robot/qpos"] = np.stack([HIP, KNEE], axis=1)
        file["robot/tau"] = MOTOR[:, None]
    columns = LogFormat(
        states={"hip_qpos": "robot.qpos.0", "knee_qpos": "robot.qpos.1"},
        actions={"motor": "robot.tau.0"},
    )
    check(read_logs([tmp_path / "run.h5"], STATES, ACTIONS, columns))


def test_minari_episodes_have_one_action_less_and_no_times(tmp_path):
    (tmp_path / "set" / "data").mkdir(parents=True)
    with h5py.File(tmp_path / "set" / "data" / "main_data.hdf5", "w") as file:
        for k in (0, 1, 10):
            file[f"episode_{k}/observations"] = np.stack([HIP, KNEE], axis=1) + k
            file[f"episode_{k}/actions"] = MOTOR[:-1, None]
    columns = LogFormat(
        states={"hip_qpos": "observations.0", "knee_qpos": "observations.1"},
        actions={"motor": "actions.0"},
        period=0.01,
    )
    runs = read_logs([tmp_path / "set"], STATES, ACTIONS, columns).trajectories
    assert [round(run.states[0, 0]) for run in runs] == [0, 1, 10]
    assert all(np.allclose(run.actions[:, 0], MOTOR[:-1]) for run in runs)
    assert all(np.allclose(run.times, TIMES) for run in runs)


def test_lerobot_folder(tmp_path):
    (tmp_path / "meta").mkdir()
    names = {"motors": ["hip", "knee"]}
    features = {"observation.state": {"names": names}, "action": {"names": None}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps({"fps": 100, "features": features}))
    for episode in range(2):
        folder = tmp_path / "data" / "chunk-000"
        folder.mkdir(parents=True, exist_ok=True)
        frame = pd.DataFrame(
            {
                "observation.state": list(np.stack([HIP, KNEE], axis=1)),
                "action": list(MOTOR[:, None]),
                "timestamp": TIMES,
                "episode_index": episode,
            }
        )
        frame.to_parquet(folder / f"episode_{episode:06d}.parquet")
    columns = LogFormat(
        states={"hip_qpos": "observation.state.hip", "knee_qpos": "observation.state.knee"},
        actions={"motor": "action.0"},
    )
    runs = read_logs([tmp_path], STATES, ACTIONS, columns).trajectories
    assert len(runs) == 2
    assert np.allclose(runs[1].states[:, 1], KNEE)
    assert np.allclose(runs[1].actions[:, 0], MOTOR[:-1])


def test_data_frames_and_dictionaries(tmp_path):
    check(read_logs([FLAT], STATES, ACTIONS))
    check(read_logs([pd.DataFrame(FLAT)], STATES, ACTIONS))
    check(read_logs([pd.DataFrame(FLAT).set_index("time")], STATES, ACTIONS))
    pairs = {"time": TIMES, "q": np.stack([HIP, KNEE], axis=1), "motor": MOTOR}
    columns = LogFormat(states={"hip_qpos": "q.0", "knee_qpos": Column("q.1")})
    check(read_logs([pairs], STATES, ACTIONS, columns))
    with pytest.raises(LogError, match="one length"):
        read_logs([FLAT | {"motor": MOTOR[:-2]}], STATES, ACTIONS)
    with pytest.raises(LogError, match="no log"):
        read_logs([3.0], STATES, ACTIONS)


def test_what_is_missing_or_is_no_such_file(tmp_path):
    for name in ("none.mcap", "none.h5"):
        with pytest.raises(LogError, match="no such file"):
            read_logs([tmp_path / name], STATES, ACTIONS)
    (tmp_path / "bad.h5").write_bytes(b"nothing")
    with pytest.raises(LogError, match="cannot be read as HDF5"):
        read_logs([tmp_path / "bad.h5"], STATES, ACTIONS)
    with pytest.raises(LogError, match="LeRobot"):
        read_logs([tmp_path], STATES, ACTIONS)
