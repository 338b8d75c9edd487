"""Demonstrations: recorded by a policy, replayed to the bit, and rendered later; one line for bad ones."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.training import workbench_runs
from support.training.learning_fakes import POLE
from support.training.workbench_runs import work

import robot_envs.robots  # noqa: F401 - registers the environments
from rl_workbench.errors import WorkbenchError
from rl_workbench.training import demonstrations
from rl_workbench.training.demonstrations import Origin, Recorder, load, load_all, paths, replay

PICK, CUBE = "robot_envs.robots.gripper_arm:pick", "robot_envs/PickCube-v0"
SHORT = {"max_steps": 6}
DRIVEN = {"max_steps": 8}


def demonstrating(folder: Path, *more: str, env_id: str = CUBE, steps: int = 6) -> list[str]:
    return ["demonstrate", f"--env-id={env_id}", f"--policy={PICK}", f"--out={folder}",
            "--env-kwargs", f"max_steps={steps}", *more]  # fmt: skip


def dataset(demos: Path, out: Path, *more: str) -> int:
    return work("dataset", demos, f"--out={out}", *more)


@pytest.fixture(scope="module")
def cube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two short episodes; not to be changed."""
    folder = tmp_path_factory.mktemp("demos") / "cube"
    assert work(*demonstrating(folder, "--episodes=2")) == 0
    return folder


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rover with a camera, a laser and an IMU, whose driver has stopped before the episode ended."""
    folder = tmp_path_factory.mktemp("demos") / "driven"
    origin = Origin("robot_envs/Navigate-v0", DRIVEN)
    folder.mkdir()
    env = origin.make()
    recorder = Recorder(env, origin)
    recorder.begin(3)
    for _ in range(5):
        recorder.step([0.4, -0.2])
    demonstrations.save(folder, recorder.episode(success=True))
    env.close()
    return folder


def test_an_episode_is_a_small_file_that_says_how_it_was_made(cube: Path) -> None:
    first, second = (load(path) for path in paths(cube))
    assert (first.env_id, first.env_kwargs, first.seed, second.seed) == (CUBE, SHORT, 0, 1)
    assert first.actions.shape == (6, 4) and first.truncated and first.success is False
    assert first.versions["numpy"] == np.__version__
    assert all(path.stat().st_size < 5000 for path in paths(cube))


def test_more_episodes_come_behind_with_further_seeds(cube: Path, tmp_path: Path) -> None:
    whole = Path(shutil.copytree(cube, tmp_path / "demos"))
    assert work(*demonstrating(whole, "--episodes=1")) == 0
    assert [load(path).seed for path in paths(whole)] == [0, 1, 2]


def test_undone_steps_leave_no_trace() -> None:
    origin = Origin(CUBE, SHORT)
    env = origin.make()
    recorder, action = Recorder(env, origin), np.array([0.5, -0.5, -1.0, 1.0], np.float32)
    recorder.begin(4)
    seen = [recorder.step(action) for _ in range(3)]
    recorder.step(-action)
    assert np.array_equal(recorder.undo(2), seen[1])
    recorder.step(action)
    episode = recorder.episode(success=True)
    assert episode.success and len(episode.actions) == 3
    played = list(replay(Path("episode"), episode, env))
    assert np.array_equal(played[3].observation, seen[2])
    env.close()


def test_the_policy_of_a_run_demonstrates_in_its_own_environment(tmp_path: Path) -> None:
    run = workbench_runs.dqn(tmp_path / "run", env_id=POLE, total_timesteps=100)
    out = tmp_path / "demos"
    assert work("demonstrate", f"--policy={run}", "--episodes=2", f"--out={out}") == 0
    assert dataset(out, tmp_path / "data") == 0
    (path, _) = sorted((tmp_path / "data").glob("*.npz"))
    with np.load(path) as data:
        assert data["observations"].shape == (len(data["actions"]) + 1, 4)
        assert data["terminations"][-1] or data["truncations"][-1]


def test_sensors_and_pictures_are_rendered_later(driven: Path, tmp_path: Path) -> None:
    out, sensors = tmp_path / "data", "camera@32x24,laser,imu,render@48x40"
    assert dataset(driven, out, "--sensors", sensors) == 0
    with np.load(out / "episode_00000.npz") as data:
        shapes = {name: data[name].shape for name in data}
        assert data["truncations"].tolist() == [False] * 4 + [True]
    assert shapes["camera.depth"] == (6, 24, 32) and shapes["render"] == (6, 40, 48, 3)
    assert shapes["laser.ranges"] == (6, 360) and shapes["imu.orientation"] == (6, 4)
    metadata = json.loads((out / "metadata.json").read_text())
    assert metadata["replay"]["equal_to_the_bit"] == ["rewards", "ends", "observations"]
    (episode,) = metadata["episodes"]
    assert episode == {"file": "episode_00000.npz", "seed": 3, "success": True, "steps": 5}


@pytest.mark.extras("minari")
def test_a_dataset_of_minaris_is_loaded_there(driven: Path, tmp_path: Path, monkeypatch) -> None:
    import minari

    sensors = "--sensors=laser,render@48x40"
    assert dataset(driven, tmp_path / "rover-v0", "--format=minari", sensors) == 0
    assert dataset(driven, tmp_path / "plain", "--sensors=laser,render@48x40") == 0
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    found = minari.load_dataset("rover-v0")
    (episode,) = found
    with np.load(tmp_path / "plain" / "episode_00000.npz") as data:
        for name, place in (("laser.ranges", "laser.ranges"), ("render", "render"),
                            ("observations", "observation")):  # fmt: skip
            assert np.array_equal(data[name], episode.observations[place])
        assert np.array_equal(data["actions"], episode.actions)
    assert "equal_to_the_bit" in found.storage.metadata["demonstrations"]
    found.recover_environment().close()


def test_options_that_keep_the_trajectory_may_differ(cube: Path, tmp_path: Path, refused) -> None:
    noisy, late = tmp_path / "noisy", tmp_path / "late"
    assert dataset(cube, noisy, "--env-kwargs", "sensor_noise=0.01") == 0
    assert json.loads((noisy / "metadata.json").read_text())["replay"]["equal_to_the_bit"] == [
        "rewards", "ends",
    ]  # fmt: skip
    line = refused("dataset", cube, f"--out={late}", "--env-kwargs", "action_delay=1")
    assert "episode_00000.npz goes another way in step 1: other rewards" in line
    assert [path.name for path in tmp_path.iterdir()] == ["noisy"]


def changed(path: Path, **arrays: object) -> None:
    with np.load(path) as content:
        kept = dict(content)
    header = json.loads(str(kept["header"]))
    header |= {name: value for name, value in arrays.items() if name in header}
    kept |= {name: value for name, value in arrays.items() if name not in header}
    np.savez(path, **{**kept, "header": np.array(json.dumps(header))})


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-400])


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (cut, "isn't a demonstration, or it is damaged"),
        (lambda path: path.write_bytes(b""), "isn't a demonstration, or it is damaged"),
        (lambda path: changed(path, rewards=np.zeros(3)), "it is not whole"),
        (lambda path: changed(path, actions=np.zeros((0, 4))), "it is not whole"),
        (lambda path: changed(path, form=9), "it is of another version of this program"),
        (lambda path: changed(path, seed="3"), "its seed is '3'"),
        (lambda path: changed(path, env_id=POLE), "is of another environment, or other options"),
        (lambda path: changed(path, rewards=np.zeros(6), versions={"numpy": "1.0"}),
         f"in step 1: other rewards (numpy 1.0 is now {np.__version__})"),
        (lambda path: changed(path, seen=np.zeros(7, np.uint64)), "in step 0: other observations"),
    ],
)  # fmt: skip
def test_damaged_and_foreign_episodes_are_one_line(cube, tmp_path, refused, damage, text) -> None:
    demos = Path(shutil.copytree(cube, tmp_path / "demos"))
    damage(paths(demos)[1])
    line = refused("dataset", demos, f"--out={tmp_path / 'data'}")
    assert text in line and "episode_00001.npz" in line
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("sensors", "text"),
    [
        ("front", "there is no sensor 'front'"),
        ("camera@9", "WIDTHxHEIGHT, not '9'"),
        ("laser@9x9", "'laser' is none"),
        ("laser,laser", "names one twice"),
        ("render@9", "WIDTHxHEIGHT, as in render@640x480"),
    ],
)
def test_sensors_that_there_are_not(driven: Path, tmp_path, refused, sensors, text) -> None:
    assert text in refused("dataset", driven, f"--out={tmp_path / 'd'}", f"--sensors={sensors}")
    assert not list(tmp_path.iterdir())


def test_a_folder_of_another_environment_gets_none(cube: Path, refused) -> None:
    for other in ({"env_id": "robot_envs/PickCubeGoal-v0"}, {"steps": 7}):
        line = refused(*demonstrating(cube, "--episodes=1", **other))
        assert "another --out keeps them apart" in line
    assert len(load_all(cube)) == 2


def test_a_full_disk_loses_nothing(cube: Path, tmp_path: Path, refused, monkeypatch) -> None:
    demos, write, written = Path(shutil.copytree(cube, tmp_path / "demos")), os.fsync, []

    def full(number: int) -> None:
        written.append(number)
        if len(written) > 2:  # the first file and its folder
            raise OSError(28, os.strerror(28))
        write(number)

    monkeypatch.setattr(os, "fsync", full)
    line = refused(*demonstrating(demos, "--episodes=3"))
    assert "episode_00003.npz: No space left on device" in line
    assert len(load_all(demos)) == 3


def test_a_folder_without_demonstrations(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="has no demonstrations"):
        load_all(tmp_path)
