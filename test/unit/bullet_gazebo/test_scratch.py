"""Folders for a moment: none stays behind for good, and nobody loses one that is in use."""

import os
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import pytest

from bullet_gazebo import scratch
from bullet_gazebo.physics.engines import make_engine
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.scratch import PREFIX, scratch_folder, sweep

HOLDER = """
import sys
from bullet_gazebo.scratch import scratch_folder
with scratch_folder() as folder:
    (folder / "model.urdf").write_text("<robot/>")
    print(folder.name, flush=True)
    sys.stdin.read()
"""
BOX = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """The temporary folder, and a process in which nothing has been swept yet."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    scratch.sweep_once.cache_clear()
    yield tmp_path
    scratch.sweep_once.cache_clear()


@pytest.fixture
def holder(place):
    """Starts processes, each of which holds a folder."""
    started = []

    def start():
        process = subprocess.Popen(
            [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_nothing_is_left_after_the_block(place) -> None:
    with pytest.raises(KeyError), scratch_folder() as folder:
        (folder / "file").write_text("x")
        assert [folder.name] == os.listdir(place)
        raise KeyError
    assert os.listdir(place) == []


def test_what_a_killed_process_left_is_swept_and_a_living_ones_is_not(place, holder) -> None:
    (dead, left), (_, held) = holder(), holder()
    dead.send_signal(signal.SIGKILL)
    dead.wait()
    assert set(os.listdir(place)) == {left, held}
    make_engine().load(parse_urdf(BOX), Pose())  # the first model that this process loads
    assert os.listdir(place) == [held]


def test_nor_is_one_that_is_older_than_everything(place, holder) -> None:
    _, held = holder()
    os.utime(place / held, (0, 0))
    sweep(place)
    assert os.listdir(place / held) == ["model.urdf"]


def test_what_only_has_the_name_stays(place, tmp_path_factory) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "mine").write_text("x")
    (place / f"{PREFIX}link").symlink_to(elsewhere)
    (place / f"{PREFIX}file").write_text("x")
    (place / "bullet_gazebo_results").mkdir()
    sweep(place)
    assert len(os.listdir(place)) == 3 and (elsewhere / "mine").exists()
    sweep(place / "nowhere")


def test_another_users_stays(place, monkeypatch) -> None:
    (place / f"{PREFIX}theirs").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: 12345678)
    sweep(place)
    assert os.listdir(place) == [f"{PREFIX}theirs"]


def test_a_folder_that_is_swept_before_it_was_locked_is_made_anew(place, monkeypatch) -> None:
    opened, lost = os.open, []

    def lose_twice(path, *flags):
        handle = opened(path, *flags)
        if PREFIX in str(path) and len(lost) < 2:
            lost.append(path)
            os.rmdir(path)
            if len(lost) == 2:
                os.mkdir(path)  # somebody else's, by chance of the same name
        return handle

    scratch.sweep_once()
    monkeypatch.setattr(os, "open", lose_twice)
    with scratch_folder() as folder:
        (folder / "file").write_text("x")
        assert folder not in lost
    assert len(lost) == 2


def test_sweepers_and_owners_at_once_disturb_nobody(place) -> None:
    def work(_number: int) -> None:
        for _ in range(50):
            sweep(place)
            with scratch_folder() as folder:
                (folder / "file").write_text("x")
                sweep(place)
                assert (folder / "file").read_text() == "x"

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))
    assert os.listdir(place) == []
