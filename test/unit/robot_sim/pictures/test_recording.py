"""A simulation recorded while it runs: pictures at simulated times, of who comes and goes."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.robots.cartpole import cartpole_urdf
from support.robots.snippets import link, robot

from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.pictures import recording
from robot_sim.pictures.recording import RecordingError, RecordingOptions, SimulationRecorder
from robot_sim.simulator import Simulator

LIMIT = 120.0  # [s] for the other process to end
RED = """<visual><geometry><sphere radius="0.2"/></geometry>
  <material name="red"><color rgba="1 0 0 1"/></material></visual>"""
BALL = robot(link("base", more=RED))


@pytest.fixture
def sim(sim: Simulator) -> Simulator:
    """With ground, which is drawn."""
    sim.world.spawn("ground_plane", ground_plane(), Pose())
    return sim


def frames(path: Path) -> list[np.ndarray]:
    import imageio_ffmpeg

    read = imageio_ffmpeg.read_frames(str(path))
    width, height = next(read)["size"]
    return [np.frombuffer(each, np.uint8).reshape(height, width, 3).astype(int) for each in read]


def red(frame: np.ndarray) -> int:
    """How many pixels are red."""
    return int((frame[..., 0] > 60 + frame[..., 1:].max(axis=-1)).sum())


def options(path: Path, **changed: object) -> RecordingOptions:
    return RecordingOptions(path / "a.mp4", **{"rate": 20.0, "width": 64, "height": 48, **changed})


def finish(*recorders: SimulationRecorder) -> None:
    for recorder in recorders:
        recorder.close(LIMIT)
        assert recorder._process.wait(LIMIT) == 0


@pytest.mark.slow
def test_pictures_come_at_simulated_times_and_show_who_comes_and_goes(sim, tmp_path):
    recorder = SimulationRecorder(sim, options(tmp_path))
    sim.advance(200)
    sim.world.spawn("ball", parse_urdf(BALL), Pose((0.0, 0.0, 1.0)))
    sim.advance(200)
    sim.world.delete("ball")
    sim.advance(200)
    finish(recorder)
    there = [red(frame) > 20 for frame in frames(tmp_path / "a.mp4")]
    assert there == [False] * 5 + [True] * 4 + [False] * 4


def test_time_that_begins_anew_is_recorded_on(sim, tmp_path):
    recorder = SimulationRecorder(sim, options(tmp_path))
    for _ in range(3):
        sim.advance(100)
        sim.reset(everything=True)
    finish(recorder)
    assert len(frames(tmp_path / "a.mp4")) == 9


def test_recording_changes_no_bit_of_the_simulation(tmp_path):
    finals = []
    for looking in (False, True):
        sim = Simulator(World(make_engine()), lockstep=True)
        model = sim.world.spawn("it", parse_urdf(cartpole_urdf()), Pose())
        model.set_joint_positions({"cart_pole": 0.1})
        recorders = [SimulationRecorder(sim, options(tmp_path))] if looking else []
        sim.advance(300)
        finals.append(model.joint_states())
        sim.world.close()
        finish(*recorders)
    assert finals[0] == finals[1]


def test_a_simulator_that_is_killed_leaves_a_video(tmp_path):
    """The pipe ends, whatever the way."""
    script = f"""
import os, signal
from robot_sim.physics.engines import make_engine
from robot_sim.physics.world import World
from robot_sim.pictures.recording import RecordingOptions, SimulationRecorder
from robot_sim.simulator import Simulator
from pathlib import Path
sim = Simulator(World(make_engine()), lockstep=True)
recorder = SimulationRecorder(sim, RecordingOptions(Path({str(tmp_path / "a.mp4")!r}), 20.0, 64, 48))
sim.advance(500)
while not recorder._waiting.empty():
    pass
os.kill(os.getpid(), signal.SIGKILL)
"""
    # This returns once nobody has its standard output any more: the other process neither.
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=LIMIT, check=False)
    assert done.returncode == -signal.SIGKILL and " frames, " in done.stdout
    assert 9 <= len(frames(tmp_path / "a.mp4")) <= 11


def test_the_other_process_may_end_first(sim, tmp_path, caplog):
    recorder = SimulationRecorder(sim, options(tmp_path))
    sim.advance(100)
    recorder._process.kill()
    recorder._process.wait(LIMIT)
    while not recorder._ending:
        sim.advance(100)
    recorder.close(LIMIT)
    sim.advance(100)
    assert "the recording has ended before the simulation" in caplog.text


def test_what_the_other_process_cannot_take_in_time_is_left_out(sim, tmp_path, monkeypatch, caplog):
    recorder = SimulationRecorder(sim, options(tmp_path))
    sim.advance(100)
    monkeypatch.setattr(recording, "MOST_WAITING", -1)
    sim.advance(100)
    finish(recorder)
    assert "2 frames of the recording were dropped" in caplog.text
    assert len(frames(tmp_path / "a.mp4")) == 3


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"path": Path("a.avi")}, r"ends in \.mp4 or \.png"),
        ({"path": Path("/nowhere/a.mp4")}, "can't be written"),
        ({"rate": 0.0}, "frames a second"),
        ({"rate": float("nan")}, "frames a second"),
        ({"width": 1}, "pixels"),
        ({"height": 100_000}, "pixels"),
    ],
)
def test_what_cannot_be_recorded_is_refused(tmp_path, changed, text):
    with pytest.raises(RecordingError, match=text):
        RecordingOptions(**{"path": tmp_path / "a.mp4", **changed}).check()


def test_a_video_without_its_encoder_is_refused_with_the_command_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(RecordingError, match=r"needs imageio-ffmpeg, .*/ws extras' installs"):
        options(tmp_path).check()
    RecordingOptions(tmp_path / "a.png").check()


def test_a_folder_that_goes_is_said_in_one_line(sim, tmp_path, capfd):
    folder = tmp_path / "gone"
    folder.mkdir()
    recorder = SimulationRecorder(sim, RecordingOptions(folder / "a.png", 20.0, 64, 48))
    sim.advance(10)
    folder.rmdir()
    recorder.close(LIMIT)
    assert recorder._process.wait(LIMIT) == 1
    assert f"recording: {folder}/a.png: [Errno 2]" in capfd.readouterr().err


@pytest.mark.slow
def test_a_picture_shows_the_last_moment(sim, tmp_path):
    path = tmp_path / "a.png"
    recorder = SimulationRecorder(sim, RecordingOptions(path, 20.0, 64, 48))
    sim.world.spawn("ball", parse_urdf(BALL), Pose((0.0, 0.0, 3.0)))
    sim.advance(500)
    finish(recorder)
    with Image.open(path) as picture:
        assert picture.size == (64, 48)
        assert red(np.asarray(picture).astype(int)) > 20
