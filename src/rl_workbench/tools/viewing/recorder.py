"""Episodes as they are played, in a thread of their own: where an environment lives that its page shows."""

import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import viser

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.pictures.filming import DEFAULT_RATE, Act, action_text
from rl_workbench.tools.runs.episodes import TEST_SEED, episode_steps
from rl_workbench.tools.runs.policies import environment_of, load_learned
from rl_workbench.tools.runs.runs import Run, open_run
from rl_workbench.tools.viewing.views import View, make_view
from rl_workbench.training import checkpoints
from rl_workbench.training.folder import is_held

BEST, LAST, RANDOM = POLICIES = ("best", "last", "random")
BACKEND = "backend"  # the option by which an environment may move a robot outside of its process
IN_PROCESS = ("bullet", "mujoco")
MOST_STEPS = 20_000  # of an episode; some have no end
MOST_BYTES = 2**28  # of its pictures


class Frame(NamedTuple):
    """The environment after a step; the first one is the reset."""

    seen: Any  # of its view
    total_reward: float
    action: str


@dataclass
class Episode:
    """One episode; it grows while it is played."""

    which: str  # policy
    seed: int
    frames: list[Frame] = field(default_factory=list)
    policy: str = ""  # in words
    rate: float = DEFAULT_RATE  # [Hz] of its steps
    is_over: bool = False
    note: str = ""  # what went wrong, or that it was cut off

    @property
    def length(self) -> int:
        """Steps so far."""
        return max(0, len(self.frames) - 1)


class Stopped(Exception):
    """Nobody wants the episode any more."""


class Recorder:
    """Plays episodes of a run one after the other; all that touches the environment is in one thread.

    Args:
        folder: the run's; its training needn't have begun.
        server: of the page.
        env_options: of the environment, on top of the training's own.
    """

    def __init__(
        self, folder: Path, server: viser.ViserServer, env_options: dict[str, Any]
    ) -> None:
        self._folder, self._server, self._env_options = folder, server, env_options
        self._env: gymnasium.Env[Any, Any] | None = None
        self.view: View | None = None
        self._wanted: Episode | None = None
        self._changed = threading.Condition()
        self._is_closed = False
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def play(self, which: str, seed: int) -> Episode:
        """Returns an episode that is played from now on; the one before it goes no further."""
        episode = Episode(which, seed)
        with self._changed:
            self._wanted = episode
            self._changed.notify()
        return episode

    def close(self, patience: float) -> None:
        """Ends the thread, within `patience` [s]."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        self._thread.join(patience)

    def newest(self, which: str) -> tuple[int, ...]:
        """What changes when there is another checkpoint to play; empty if there is none."""
        if which == RANDOM:
            return (0,)
        for path in checkpoints.candidates(self._folder, best_first=which == BEST):
            try:
                status = path.stat()
            except OSError:  # it has just made place for a newer one
                continue
            return status.st_ino, status.st_mtime_ns
        return ()

    def _work(self) -> None:
        try:
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self._wanted is not None or self._is_closed)
                    episode, self._wanted = self._wanted, None
                    if self._is_closed or episode is None:
                        return
                try:
                    self._play(episode)
                except Stopped:
                    continue
                except (WorkbenchError, gymnasium.error.Error) as error:  # the latter of its view
                    episode.note = str(error) or type(error).__name__
                    self._forget()
                finally:
                    episode.is_over = True
        finally:
            self._forget()

    def _forget(self) -> None:
        """An environment that has failed is made anew for the next episode."""
        if self._env is not None:
            env, self._env = self._env, None
            try:
                env.close()
            except WorkbenchError:
                return  # it is the failure that was told already

    def _play(self, episode: Episode) -> None:
        run = open_run(self._folder)
        check_robot_is_free(run, {**run.env_kwargs, **self._env_options})
        env, view = self._made(run)
        act = self._policy(run, episode, env)
        episode.rate = float(env.metadata.get("render_fps") or DEFAULT_RATE)
        try:
            self._play_steps(episode, env, act, view)
        except WorkbenchError:
            raise
        except (ValueError, AssertionError, RuntimeError) as error:
            raise WorkbenchError(f"the policy doesn't fit the environment: {error}") from error

    def _play_steps(
        self, episode: Episode, env: gymnasium.Env[Any, Any], act: Act, view: View
    ) -> None:
        total, size = 0.0, 0
        for step in episode_steps(env, act, TEST_SEED + episode.seed, MOST_STEPS):
            if self._wanted is not None or self._is_closed:
                raise Stopped
            total += step.reward
            seen = view.take()
            size += len(seen) if isinstance(seen, bytes) else 0
            action = "" if step.action is None else action_text(step.action)
            episode.frames.append(Frame(seen, total, action))
            if size > MOST_BYTES:
                break
        if not step.finished or episode.length >= MOST_STEPS:
            episode.note = f"cut off after {episode.length} steps"

    def _made(self, run: Run) -> tuple[gymnasium.Env[Any, Any], View]:
        """The environment, and what shows it on the page: one for all episodes."""
        if self._env is None or self.view is None:
            self._env = _environment(run, self._env_options)
            self._server.scene.reset()  # of one that has failed
            self.view = make_view(self._server, self._env)
        return self._env, self.view

    def _policy(self, run: Run, episode: Episode, env: gymnasium.Env[Any, Any]) -> Act:
        if episode.which == RANDOM:
            env.action_space.seed(episode.seed)
            episode.policy = RANDOM
            return lambda _: env.action_space.sample()
        passed_over: list[str] = []
        learned = load_learned(run, episode.which, say=passed_over.append, env=env)
        episode.policy = f"{episode.which}, of step {learned.steps}"
        episode.note = "; ".join(passed_over)
        return learned.act


def check_robot_is_free(run: Run, options: dict[str, Any]) -> None:
    """Makes sure that an episode doesn't move the robot of a training that runs.

    An environment says so itself by `shares_robot`, but only once it is made, and has joined the
    training's world. So this goes by the name of its backend.

    Args:
        options: of the environment that is to be played.

    Raises:
        WorkbenchError: if it would.
    """
    given = run.config["run"]
    training = {**given["env_kwargs"], **given.get("train_env_kwargs", {})}
    own = (None, *IN_PROCESS)
    if options.get(BACKEND) in own or training.get(BACKEND) in own or not is_held(run.folder):
        return
    raise WorkbenchError(
        f"no episodes while it trains: {BACKEND}={options[BACKEND]} is the training's own robot. "
        f"`view --env-kwargs {BACKEND}={IN_PROCESS[0]}` plays another one, and so does --gui of a training "
        f"with --train-env-kwargs {BACKEND}={training[BACKEND]} in place of --env-kwargs"
    )


def _environment(run: Run, options: dict[str, Any]) -> gymnasium.Env[Any, Any]:
    """One that draws pictures.

    Raises:
        WorkbenchError: if there is none.
    """
    try:
        return environment_of(run, {**options, "render_mode": "rgb_array"})
    except WorkbenchError as error:
        environment_of(run, options).close()  # raises what else is wrong
        raise WorkbenchError(f"the environment draws no pictures: {error}") from error
