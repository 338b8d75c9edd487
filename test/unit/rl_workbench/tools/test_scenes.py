"""Episodes of robots in 3-D: what the file holds. That a browser plays it: test/ros/bullet_gazebo/window."""

from pathlib import Path

import pytest
from support.pages import viser_recording
from support.training import workbench_runs

import cartpole  # noqa: F401 - registers the environments
from rl_workbench import cli

pytestmark = pytest.mark.usefixtures("signals")
LARGEST = 1_000_000  # [bytes]


def record(run: Path, out: Path, *words: str) -> int:
    return cli.main(["record", str(run), "--out", str(out), "--max-steps", "12", *words])


def test_a_robots_page_is_in_3d_and_holds_all_that_it_shows(
    robot_run: Path, tmp_path: Path, capsys
):
    out = tmp_path / "a.html"
    assert record(robot_run, out) == 0
    steps = int(capsys.readouterr().out.split(" steps")[0].split()[-1])
    text = out.read_text()
    assert len(text) < LARGEST
    assert 'src="http' not in text and 'href="http' not in text
    found = viser_recording.of_page(text)
    frames = len({time for time, _ in found.messages})
    assert frames == pytest.approx(steps / 5, abs=1.1)  # 125 steps a second, 25 frames
    assert found.duration == pytest.approx(1.0 + (frames - 1) / 25)
    labels = {when: found.at(when)["/caption0"]["text"] for when in (0.0, found.duration)}
    assert labels[0.0].startswith("step 0   return 0.0")
    assert labels[found.duration].startswith(f"step {steps}   return {steps:.1f}   action ")
    before, after = ([part["wxyz"] for part in found.parts(when)] for when in (0.0, 9e9))
    assert before != after


def test_several_are_seen_beside_each_other(robot_run: Path, tmp_path: Path, capsys):
    out = tmp_path / "a.html"
    assert record(robot_run, out, "--checkpoint", "best", "last", "random", "--fps", "10") == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in told] == ["best", "last", "random", str(out)]
    nodes = viser_recording.of_page(out.read_text()).at()
    captions = [nodes[f"/caption{number}"]["text"] for number in range(3)]
    assert [each.split()[0] for each in captions] == ["best", "last", "random"]


def test_captions_may_be_left_out(robot_run: Path, tmp_path: Path):
    out = tmp_path / "a.html"
    assert record(robot_run, out, "--no-captions") == 0
    assert "/caption0" not in viser_recording.of_page(out.read_text()).at()


def test_a_size_is_refused_where_it_has_none(robot_run: Path, tmp_path: Path, capsys):
    assert record(robot_run, tmp_path / "a.html", "--size", "64x48") == 1
    assert "as large as the browser's window" in capsys.readouterr().err


def test_what_is_no_robot_of_ours_is_played_as_pictures(tmp_path: Path):
    folder = tmp_path / "classic"
    workbench_runs.dqn(folder, env_id="CartPole-v1", total_timesteps=200)
    out = tmp_path / "a.html"
    assert record(folder, out, "--size", "64x48") == 0
    assert 'width="64"' in out.read_text()
