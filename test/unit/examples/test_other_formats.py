"""Examples that write others' formats hand on all of a dataset or bag; the libraries are stand-ins."""

import sys
from unittest.mock import MagicMock

import numpy as np
import rosbag
from genpy import Time
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Header
from support.training.workbench_runs import work

from rl_workbench.training.demonstrations import Origin, Recorder, save


def test_lerobot_gets_each_action_with_what_was_seen_before(imported, tmp_path, monkeypatch) -> None:
    origin, data = Origin("robot_envs.robots:robot_envs/Navigate-v0", {}), tmp_path / "data"
    recorder = Recorder(origin.make(), origin)
    recorder.begin(3)
    for _ in range(3):
        recorder.step([0.4, -0.2])
    save(tmp_path, recorder.episode(success=True))
    assert work("dataset", tmp_path, f"--out={data}", "--sensors=laser,render@48x40") == 0
    monkeypatch.setitem(sys.modules, "lerobot.datasets.lerobot_dataset", lerobot := MagicMock())
    monkeypatch.setattr(sys, "argv", ["", str(data), "new", "--task=go"])
    imported("lerobot_dataset").main()
    _, fps, features, _ = lerobot.LeRobotDataset.create.call_args.args
    calls = lerobot.LeRobotDataset.create.return_value.method_calls
    assert fps == 5 and [each[0] for each in calls] == ["add_frame"] * 3 + ["save_episode", "finalize"]
    frames = [each.args[0] for each in calls[:3]]
    assert [(each.pop("task"), *each["next.success"]) for each in frames] == [
        ("go", n == 2) for n in range(3)
    ]
    for key, feature in features.items():  # LeRobot refuses other frames
        kind = (feature["dtype"].replace("image", "uint8"), feature["shape"])
        assert {(str(each[key].dtype), each[key].shape) for each in frames} == {kind}
    keys = ("observation.state", "observation.laser.ranges", "observation.images.render", "action")
    with np.load(data / "episode_00000.npz") as arrays:
        for name, key in zip(("observations", "laser.ranges", "render", "actions"), keys, strict=True):
            assert np.array_equal([each[key] for each in frames], np.float32(arrays[name][:3]))


def test_mcap_and_rerun_get_a_bags_messages(imported, tmp_path, monkeypatch) -> None:
    source, header = str(tmp_path / "a.bag"), Header(stamp=Time(7))
    scan = LaserScan(header=header, angle_increment=np.pi / 2, ranges=[1.0, np.inf, 2.0])
    eye = Image(header=header, height=1, width=2, encoding="bgr8", data=bytes(range(6)))
    with rosbag.Bag(source, "w") as bag:
        for message in (JointState(header, ["a", "b"], [0.1, 0.2], [], []), scan, eye):
            bag.write(f"/{message._type}", message, Time(9))
    read = [(time.to_nsec(), each[1]) for _, each, time in rosbag.Bag(source).read_messages(raw=True)]
    monkeypatch.setattr(sys, "argv", ["", source, str(tmp_path / "out")])
    monkeypatch.setitem(sys.modules, "mcap.writer", mcap := MagicMock())
    imported("bag_to_mcap")
    assert [each.args[1:3] for each in mcap.Writer.return_value.add_message.call_args_list] == read
    monkeypatch.setitem(sys.modules, "rerun", rr := MagicMock())
    imported("to_rerun").main()
    assert {each.kwargs["duration"] for each in rr.set_time.call_args_list} == {7.0}
    assert [each.args[0] for each in rr.Scalars.call_args_list] == [0.1, 0.2]
    assert np.allclose(rr.Points3D.call_args.args[0], [[1, 0, 0], [-2, 0, 0]], atol=1e-6)
    assert rr.Image.call_args.args[0].tolist() == [[[0, 1, 2], [3, 4, 5]]]
