"""A run's page without a browser: what is recorded, what the player does, and what is refused."""

import json
import os
import shutil
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
from support.training.learning_fakes import Still
from support.training.workbench_runs import dqn, record

import cartpole  # noqa: F401 - registers its environments
from rl_workbench.tools import recording
from rl_workbench.tools.policies import TEST_SEED, episode_steps, load_learned
from rl_workbench.tools.recording import EpisodeFrame, EpisodeRecorder, RecordedEpisode
from rl_workbench.tools.run_page import LINGER, Playback
from rl_workbench.tools.runs import open_run
from rl_workbench.training.folder import held
from robot_envs.errors import SimulatorError

BOUND = 180.0  # [s]
TICK = 0.1  # [s]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return dqn(tmp_path_factory.mktemp("runs") / "run", env_id="CartPole-v1", env_kwargs=None)


@pytest.fixture
def make_recorder(server, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    made = []

    def make(folder: Path, env_options: dict[str, Any] | None = None) -> EpisodeRecorder:
        made.append(EpisodeRecorder(folder, server, env_options or {}))
        return made[-1]

    yield make
    for each in made:
        each.close()


def begun(episode: RecordedEpisode) -> RecordedEpisode:
    return waited(episode, lambda: bool(episode.frames))


def whole(episode: RecordedEpisode) -> RecordedEpisode:
    return waited(episode, lambda: episode.is_over)


def waited(episode: RecordedEpisode, is_there: Callable[[], bool]) -> RecordedEpisode:
    deadline = time.monotonic() + BOUND
    while not is_there():
        assert time.monotonic() < deadline, episode.note
        time.sleep(0.01)
    return episode


def returns(folder: Path, which: str, seed: int) -> list[float]:
    """Of an episode as `record --seed` plays it, after each step."""
    learned = load_learned(open_run(folder), which)
    try:
        steps = episode_steps(learned.env, learned.act, TEST_SEED + seed)
        rewards = [each.reward for each in steps]
    finally:
        learned.env.close()
    return np.cumsum(rewards).tolist()


@pytest.mark.slow
def test_an_episode_is_that_of_record_with_pictures(run, make_recorder) -> None:
    recorder = make_recorder(run)
    for which, seed in (("best", 0), ("last", 3)):
        episode = whole(recorder.play(which, seed))
        assert not episode.note
        assert [each.total_reward for each in episode.frames] == returns(run, which, seed)
        assert episode.frames[0].action == "" and episode.frames[1].action in ("0", "1")
        assert all(each.seen.startswith(b"\x89PNG") for each in episode.frames)
        assert episode.rate == 50.0
    assert whole(recorder.play("best", 0)).frames[5].seen != episode.frames[5].seen


def test_a_robot_is_recorded_by_where_its_links_are(robot_run, make_recorder, server) -> None:
    recorder = make_recorder(robot_run)
    episode = whole(recorder.play("last", 1))
    assert not episode.note
    assert [each.total_reward for each in episode.frames] == returns(robot_run, "last", 1)
    places = np.array([each.seen.links for each in episode.frames])
    assert places.shape[0] == episode.length + 1 and places.shape[2] == 7
    assert np.ptp(places, axis=0).max() > 0.01
    recorder.view.show(episode.frames[3].seen)


def test_another_wish_ends_the_episode_before(run, make_recorder, monkeypatch) -> None:
    monkeypatch.setattr(recording, "MAX_STEPS", 10**9)
    monkeypatch.setattr(recording, "MAX_BYTES", 2**60)
    recorder = make_recorder(endless(run.parent))
    first = begun(recorder.play("random", 0))
    second = recorder.play("random", 1)
    whole(first)
    assert not first.note
    begun(second)


def registered(name: str, kind: type) -> None:
    """Registers an environment, also in place of another test's."""
    gymnasium.registry.pop(name, None)
    gymnasium.register(name, kind)


def endless(place: Path) -> Path:
    registered("Endless-v0", Endless)
    folder = place / "endless"
    return folder if folder.exists() else record(folder, [1.0], env_id="Endless-v0")


class Blind(Still):
    """One that draws nothing."""

    def __init__(self) -> None:
        super().__init__()


class Endless(Still):
    """One that is drawn."""

    metadata: ClassVar = {"render_modes": ["rgb_array"], "render_fps": 10}

    def render(self):
        return np.zeros((16, 16, 3), np.uint8)


def test_one_without_an_end_is_cut_off(run, make_recorder, monkeypatch) -> None:
    monkeypatch.setattr(recording, "MAX_STEPS", 50)
    recorder = make_recorder(endless(run.parent))
    episode = whole(recorder.play("random", 0))
    assert (episode.length, episode.note, episode.rate) == (50, "cut off after 50 steps", 10.0)
    monkeypatch.setattr(recording, "MAX_BYTES", 500)
    assert whole(recorder.play("random", 0)).length < 50


def test_what_cant_be_shown_is_said_and_may_come_later(run, tmp_path, make_recorder) -> None:
    folder = tmp_path / "later"
    recorder = make_recorder(folder)
    assert "there is no such folder" in whole(recorder.play("best", 0)).note
    folder.mkdir()
    assert "no config.json" in whole(recorder.play("best", 0)).note
    shutil.copy(run / "config.json", folder)
    assert recorder.newest("best") == () != recorder.newest("random")
    assert "it has no checkpoint yet" in whole(recorder.play("best", 0)).note
    (folder / "last.pt").write_bytes(b"half")
    assert "none of its checkpoints can be read" in whole(recorder.play("best", 0)).note
    damaged = recorder.newest("last")
    os.replace(shutil.copy(run / "last.pt", folder / "new"), folder / "last.pt")
    assert recorder.newest("last") != damaged
    episode = whole(recorder.play("best", 0))
    assert episode.frames and not episode.note
    assert episode.policy.startswith("best, of step ")


def test_an_environment_that_draws_nothing_is_said(tmp_path, make_recorder) -> None:
    registered("Blind-v0", Blind)
    recorder = make_recorder(record(tmp_path / "blind", [1.0], env_id="Blind-v0"))
    assert "the environment draws no pictures" in whole(recorder.play("random", 0)).note
    recorder = make_recorder(record(tmp_path / "none", [1.0], env_id="NoSuch-v0"))
    words = "can't make NoSuch-v0: Environment `NoSuch` doesn't exist."
    assert words in whole(recorder.play("random", 0)).note


class Shared(Endless):
    """One that moves a robot, which its options name."""

    made: ClassVar[list[str]] = []

    def __init__(self, render_mode=None, backend="bullet") -> None:
        super().__init__(render_mode)
        self.made.append(backend)


@pytest.mark.parametrize(
    ("shared", "wanted", "played"),
    [
        ({"backend": ["ros", "ros-realtime"]}, {}, None),
        ({"backend": ["ros", "ros-realtime"]}, {"backend": "ros-realtime"}, None),
        ({"backend": ["ros", "ros-realtime"]}, {"backend": "bullet"}, "bullet"),
        ({}, {"backend": "bullet"}, None),
        (None, {}, "ros"),
    ],
)
def test_the_robot_of_a_training_isnt_moved(
    tmp_path, make_recorder, monkeypatch, shared, wanted, played
) -> None:
    monkeypatch.setattr(recording, "MAX_STEPS", 5)
    monkeypatch.setattr(Shared, "made", [])
    registered("Shared-v0", Shared)
    given = {"env_kwargs": {"backend": "ros"}}
    folder = record(tmp_path / "shared", [1.0], env_id="Shared-v0", **given)
    content = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps({**content, "shared_robot": shared}))
    recorder = make_recorder(folder, wanted)
    with held(folder):
        episode = whole(recorder.play("random", 0))
        assert Shared.made == ([played] if played else [])
        assert bool(episode.frames) == bool(played)
        assert ("is the training's own robot" in episode.note) == (not played)
    assert whole(recorder.play("random", 0)).frames  # it is over


class Broken(Endless):
    """One that fails when it is drawn in a picture."""

    trouble: ClassVar[Exception | None] = None

    def render(self):
        if self.trouble is not None:
            raise self.trouble
        return super().render()


class Lost(Broken):
    """One that fails when it is drawn on the page itself, as where its simulator doesn't answer any more."""

    def draw_on(self, server):
        return self

    def look(self):
        return self.render()


@pytest.mark.parametrize(
    ("kind", "trouble"),
    [
        (Broken, SimulatorError("it is gone")),
        (Broken, KeyError("it is gone")),
        (Lost, SimulatorError("it is gone")),
    ],
)
def test_one_that_fails_while_it_is_drawn_is_said_and_made_anew(
    tmp_path, make_recorder, monkeypatch, kind, trouble
) -> None:
    monkeypatch.setattr(recording, "MAX_STEPS", 5)
    registered("Broken-v0", kind)
    monkeypatch.setattr(kind, "trouble", trouble)
    recorder = make_recorder(record(tmp_path / "broken", [1.0], env_id="Broken-v0"))
    assert "it is gone" in whole(recorder.play("random", 0)).note
    monkeypatch.setattr(kind, "trouble", None)
    assert whole(recorder.play("random", 0)).length == 5


def test_record_says_it_in_one_line(tmp_path, monkeypatch, refused) -> None:
    """As with MuJoCo's environments where there is no OpenGL."""
    registered("Broken-v0", Broken)
    monkeypatch.setattr(Broken, "trouble", RuntimeError("no\nOpenGL here"))
    folder = record(tmp_path / "broken", [1.0], env_id="Broken-v0")
    told = refused("record", folder, "--checkpoint=random", "--out", tmp_path / "a.gif")
    assert "can't be drawn: Broken-v0 failed in render(): RuntimeError: no OpenGL here" in told


# The player.


class Shelf:
    """A recorder whose episodes are over at once."""

    def __init__(self, length: int = 10) -> None:
        self.length, self.checkpoint = length, (1,)
        self.played: list[tuple[str, int]] = []
        self.shown: list[int] = []
        self.view = self

    def play(self, which: str, seed: int) -> RecordedEpisode:
        self.played.append((which, seed))
        frames = [EpisodeFrame(index, index, float(index), "1") for index in range(self.length + 1)]
        return RecordedEpisode(which, seed, frames, which, rate=10.0, is_over=True)

    def newest(self, which: str) -> tuple[int, ...]:
        return self.checkpoint

    def show(self, seen: int) -> None:
        self.shown.append(seen)


def tick(player: Playback, seconds: float) -> None:
    for _ in range(round(seconds / TICK)):
        player.tick(TICK)


def test_it_plays_in_the_robots_own_time_and_begins_anew(server) -> None:
    shelf = Shelf()
    player = Playback(server.gui, shelf, ("best", "random"), seed=2)
    tick(player, 0.5)
    assert shelf.shown == [1, 2, 3, 4, 5]
    tick(player, 0.5 + LINGER + 0.1)
    assert shelf.shown[:11] == [*range(1, 11), 0]
    assert shelf.played == [("best", 2)]


def test_a_newer_checkpoint_is_played_after_the_end(server) -> None:
    shelf = Shelf()
    player = Playback(server.gui, shelf, ("last",), seed=0)
    shelf.checkpoint = (2,)
    tick(player, 0.9)
    assert len(shelf.played) == 1
    tick(player, 0.3)
    assert len(shelf.played) == 2
    tick(player, 5.0)
    assert len(shelf.played) == 2


@pytest.mark.parametrize("paused", [False, True])
def test_one_that_comes_after_a_failure_is_shown_at_once(server, paused) -> None:
    shelf = Shelf(length=-1)
    shelf.checkpoint = ()
    player = Playback(server.gui, shelf, ("last",), seed=0)
    if paused:
        player.toggle()
    tick(player, 3.0)
    assert len(shelf.played) == 1 and not shelf.shown
    shelf.length, shelf.checkpoint = 10, (1,)
    tick(player, 0.5)
    assert len(shelf.played) == 2 and shelf.shown


def test_what_is_no_run_is_one_line(tmp_path, run, refused) -> None:
    assert "there is no such folder" in refused("view", tmp_path / "none")
    assert "it has no config.json" in refused("view", tmp_path)
    (tmp_path / "config.json").write_text("{]")
    assert "isn't JSON" in refused("view", tmp_path)
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = held.getsockname()[1]
        assert f"port {port}: Address already in use" in refused("view", run, f"--port={port}")
    assert "choose others with --host, --port" in refused("view", run, "--host=192.0.2.1")
