"""The commands of rl-workbench on small trainings: what they print, write and refuse."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.training import workbench_runs
from support.training.workbench_runs import work

import cartpole  # noqa: F401 - registers the environments

SB3 = pytest.mark.extras("stable_baselines3")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    workbench_runs.dqn(folder / "dqn_0", seed=0)
    workbench_runs.dqn(folder / "dqn_1", seed=1)
    workbench_runs.dqn(folder / "robot", env_id="cartpole/Classic-v0", total_timesteps=200)
    for algorithm in ("reinforce", "reinforce-document"):
        workbench_runs.policy_gradient(folder / algorithm, algorithm)
    return folder


@pytest.fixture
def own(runs: Path, tmp_path: Path) -> Path:
    """A copy of a run that a test may damage."""
    return Path(shutil.copytree(runs / "dqn_0", tmp_path / "own"))


ALL = ["dqn_0", "robot", "reinforce", "reinforce-document"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_eval_tells_every_episode_and_writes_json(runs: Path, tmp_path, name: str, capsys) -> None:
    out = tmp_path / "eval.json"
    assert work("eval", runs / name, "--episodes", 3, "--json", out) == 0
    found = json.loads(out.read_text())
    told = capsys.readouterr().out
    assert told.count("| return") == 3 and f"mean {found['mean']:.2f} ±" in told
    assert found["mean"] == pytest.approx(np.mean(found["returns"]))
    assert found["std"] == pytest.approx(np.std(found["returns"]))
    assert len(found["lengths"]) == 3 and Path(found["checkpoint"]).exists()


def test_eval_of_random_actions_is_a_baseline(runs: Path, capsys) -> None:
    found = []
    for seed in (0, 0, 1):
        wanted = ["--checkpoint", "random", "--episodes", 5, "--seed", seed, "--json", "-"]
        assert work("eval", runs / "dqn_0", *wanted) == 0
        told = capsys.readouterr()
        found.append(json.loads(told.out))
        assert "over 5 random episodes" in told.err
    assert {each["checkpoint"] for each in found} == {"random"}
    assert found[0] == found[1] and found[0]["returns"] != found[2]["returns"]
    assert len(set(found[0]["returns"])) > 1
    with pytest.raises(SystemExit, match="0"):
        work("eval", "--help")
    assert "or random actions" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("name", ["dqn_0", "robot"])
def test_record_writes_a_gif_without_a_display(runs: Path, tmp_path: Path, name: str) -> None:
    out = tmp_path / "video.gif"
    assert work("record", runs / name, "--out", out, "--max-steps", 40, "--size", "160x80") == 0
    with Image.open(out) as video:
        assert video.format == "GIF" and video.n_frames > 1
        seen = []
        for index in range(video.n_frames):
            video.seek(index)
            seen.append(np.array(video.convert("RGB")))
            assert video.info["duration"] >= 20
    assert any((seen[0] != each).any() for each in seen), "something moves"
    assert len(np.unique(seen[0].reshape(-1, 3), axis=0)) > 2, "there is something to see"


@pytest.mark.parametrize("name", ["dqn_0", "robot"])
def test_record_writes_an_mp4_that_can_be_read(runs: Path, tmp_path: Path, name: str) -> None:
    import imageio_ffmpeg

    out = tmp_path / "video.mp4"
    assert work("record", runs / name, "--out", out, "--max-steps", 20) == 0
    frames = imageio_ffmpeg.read_frames(str(out))
    about = next(frames)
    assert about["size"][0] > 100 and about["codec"] == "h264"
    assert len(list(frames)) >= 3


def test_enjoy_without_a_display_says_so(runs: Path, monkeypatch, refused) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    line = refused("enjoy", runs / "dqn_0")
    assert "DISPLAY isn't set" in line and "record" in line


def test_enjoy_shows_episodes_where_a_display_is_named(runs: Path, monkeypatch, capsys) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    assert work("enjoy", runs / "dqn_0", "--episodes", 2) == 0
    assert capsys.readouterr().out.count("| return") == 2


@pytest.mark.parametrize("over", ["episodes", "steps"])
def test_plot_draws_runs_of_every_kind(runs: Path, tmp_path: Path, over: str) -> None:
    out = tmp_path / "plot.png"
    chosen = [runs / name for name in ALL]
    assert work("plot", *chosen, "--over", over, "--out", out) == 0
    with Image.open(out) as picture:
        assert picture.format == "PNG" and picture.size[0] > 1000


def test_runs_in_a_picture_can_be_told_apart(tmp_path: Path) -> None:
    from rl_workbench.tools.plot import run_panels
    from rl_workbench.tools.runs import open_run

    kinds = [{}, {"seed": 1}, {"env_id": "cartpole/Classic-v0"}, {"env_id": "cartpole/Classic-v0"}]
    folders = [
        workbench_runs.record(tmp_path / f"run_{index}", [1.0, 2.0], **kind)
        for index, kind in enumerate(kinds)
    ]
    runs = [open_run(folder) for folder in folders]
    one, two, *same = ("dqn, seed 0", "dqn, seed 1", "dqn, seed 0 (run_2)", "dqn, seed 0 (run_3)")
    for chosen, names in (
        (runs[:2], {"CartPole-v1": [one, two]}),
        (runs[:3], {"CartPole-v1": [one, two], "cartpole/Classic-v0": [one]}),
        (runs, {"CartPole-v1": [one, two], "cartpole/Classic-v0": same}),
    ):
        panels = run_panels(chosen, "episodes")
        assert {panel.environment: list(panel.curves) for panel in panels} == names


def test_which_seeds_share_axes(tmp_path: Path) -> None:
    from rl_workbench.tools.plot import seed_panels, variant_panels
    from rl_workbench.tools.runs import open_run

    kinds = [{}, {"seed": 1}, {"env_id": "MountainCar-v0"}, {"exp_name": "other"}]
    runs = []
    for index, kind in enumerate(kinds):
        folder = workbench_runs.record(tmp_path / f"run_{index}", [1.0, 2.0], **kind)
        with (folder / "scalars.csv").open("a") as file:
            file.write("10,eval/mean_reward,5.0,0\n")
        runs.append(open_run(folder))
    (runs[1].folder / "summary.json").write_text('{"complete": true}')
    cart, car = seed_panels(runs)
    assert (cart.environment, cart.threshold) == ("CartPole-v1", 475.0)
    assert (car.environment, car.threshold) == ("MountainCar-v0", -110.0)
    assert {name: len(seeds) for name, seeds in cart.curves.items()} == {"dqn": 2, "other": 1}
    assert [seed.complete for seed in cart.curves["dqn"]] == [False, True]
    variants = [(each.environment, *each.curves) for each in variant_panels(runs)]
    assert variants == [
        ("CartPole-v1", "dqn"), ("MountainCar-v0", "dqn"), ("CartPole-v1", "other"),
    ]  # fmt: skip


def test_compare_has_every_run_in_its_table(runs: Path, tmp_path: Path, capsys) -> None:
    out, figures = tmp_path / "curves.png", tmp_path / "compare.json"
    assert work("compare", runs, "--episodes", 2, "--out", out, "--json", figures) == 0
    told = capsys.readouterr().out
    groups = json.loads(figures.read_text())["groups"]
    assert {row["run"] for group in groups.values() for row in group["runs"]} == {
        path.name for path in runs.iterdir()
    }
    both = groups["dqn in CartPole-v1"]
    assert [row["seed"] for row in both["runs"]] == [0, 1] and both["statistics"]["n"] == 2
    assert told.count("| IQM [95 %] |") == 1
    assert Image.open(out).format == "PNG"


def test_a_failed_run_stays_in_the_table(runs: Path, tmp_path: Path, capsys) -> None:
    workbench_runs.record(tmp_path / "lost", [5.0, 7.0], seed=3)
    patterns = [runs / "dqn_*", tmp_path / "lost"]
    assert work("compare", *patterns, "--episodes", 1) == 0
    told = capsys.readouterr().out
    row = next(line for line in told.splitlines() if "| 3 |" in line)
    assert "it has no checkpoint yet" in row
    assert "(2 of 3)" in told


def test_compare_by_training_needs_no_checkpoint(tmp_path: Path, capsys) -> None:
    for seed, value in enumerate((10.0, 20.0, 30.0, 400.0)):
        workbench_runs.record(tmp_path / f"run_{seed}", [value] * 5, seed=seed)
    assert work("compare", tmp_path, "--episodes", 0) == 0
    assert "| 115.0 ± 190.2 | 25.0 | 25.0 [" in capsys.readouterr().out


@SB3
def test_runs_of_stable_baselines_are_taken_by_all(tmp_path: Path) -> None:
    run = workbench_runs.sb3(tmp_path / "run", num_envs=2)
    assert work("eval", run, "--episodes", 2, "--checkpoint", "last") == 0
    assert work("record", run, "--out", tmp_path / "a.gif", "--max-steps", 10) == 0
    assert work("plot", run, "--out", tmp_path / "a.png") == 0
    assert work("compare", run, "--episodes", 1, "--out", tmp_path / "c.png") == 0


@SB3
def test_many_environments_of_training_are_one_when_playing(tmp_path: Path, recwarn) -> None:
    run = workbench_runs.sb3(tmp_path / "run", num_envs=8, n_steps=1, batch_size=8)
    recwarn.clear()
    assert work("eval", run, "--episodes", 1) == 0
    assert not [each for each in recwarn if "mini-batch" in str(each.message)]


def test_no_run_folder(tmp_path: Path, refused) -> None:
    assert "there is no such folder" in refused("eval", tmp_path / "nowhere")
    assert "it has no config.json" in refused("eval", tmp_path)
    assert "no run folder at" in refused("plot", tmp_path, "--out", tmp_path / "a.png")


@pytest.mark.parametrize(
    ("name", "value"), [("env_id", 5), ("seed", "x"), ("env_kwargs", [1]), ("eval_env_kwargs", 3)]
)
def test_a_record_of_other_types_is_one_line(own: Path, refused, name: str, value: object) -> None:
    content = json.loads((own / "config.json").read_text())
    content["run"][name] = value
    (own / "config.json").write_text(json.dumps(content))
    assert f"{own} is not a run folder: its record is damaged" in refused("eval", own)


@pytest.mark.parametrize("content", ["[1]", '{"returns": ["x"]}'])
def test_a_summary_of_other_types_is_a_fault_in_the_table(own: Path, capsys, content: str) -> None:
    (own / "summary.json").write_text(content)
    assert work("compare", own, "--episodes", 0) == 0
    assert f"{own / 'summary.json'} isn't the summary of a training" in capsys.readouterr().out


def test_a_damaged_checkpoint_gives_way_to_an_earlier_one(own: Path, capsys) -> None:
    (own / "best.pt").write_bytes(b"PK half a file")
    assert work("eval", own, "--episodes", 1, "--json", "-") == 0
    out, err = capsys.readouterr()
    assert "best.pt is damaged, or no checkpoint; taking an earlier one" in err
    assert json.loads(out)["checkpoint"].endswith("last.pt")


def test_a_checkpoint_of_another_run_is_refused(runs: Path, own: Path, refused) -> None:
    for other in ("dqn_1", "robot", "reinforce"):  # another seed, environment, algorithm
        shutil.copy(runs / other / "best.pt", own / "best.pt")
        assert "best.pt isn't a checkpoint of" in refused("eval", own)


def test_no_episodes_yet(tmp_path: Path, refused) -> None:
    run = workbench_runs.record(tmp_path / "run", [])
    assert "no episode has ended yet" in refused("plot", run, "--out", tmp_path / "a.png")
    out = tmp_path / "b.png"
    assert "no episode has ended" in refused("compare", run, "--out", out)
    assert not out.exists()


def test_a_line_that_is_only_half_written_is_left_out(tmp_path: Path) -> None:
    run = workbench_runs.record(tmp_path / "run", [1.0, 2.0])
    with (run / "scalars.csv").open("a") as file:
        file.write("30,charts/episodic_return,3")
    assert work("plot", run, "--out", tmp_path / "a.png") == 0


def test_a_picture_or_a_video_of_another_format(runs: Path, tmp_path: Path, refused) -> None:
    for name in ("video.avi", "video"):
        assert ".gif or .mp4" in refused("record", runs / "dqn_0", "--out", tmp_path / name)
    assert "PNG" in refused("plot", runs / "dqn_0", "--out", tmp_path / "a.jpg")


def test_an_extra_that_is_missing(runs: Path, tmp_path, monkeypatch, refused, capsys) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert "installs it" in refused("sweep", "--out", tmp_path / "sweep")
    line = refused("record", runs / "dqn_0", "--out", tmp_path / "a.mp4")
    assert "an MP4 needs imageio-ffmpeg, an extra: " in line
    with pytest.raises(SystemExit):
        work("train", "--algo", "ppo")
    assert "installs it" in capsys.readouterr().err


@pytest.mark.slow
def test_a_reader_that_goes_away_costs_no_file(runs: Path, tmp_path: Path) -> None:
    out, (reading, writing) = tmp_path / "x.json", os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "rl_workbench", "eval", runs / "dqn_0", "--json", out]
    subprocess.run([*command, "--episodes=9"], stdout=writing, check=True)
    os.close(writing)
    assert json.loads(out.read_text())["episodes"] == 9
