"""Recording of episodes frame by frame, for the files of `record` and the page of `view`.

For the page a thread records them, because an environment may be slower than real time, and some
environments have to stay in one thread.
"""

import contextlib
import ctypes.util
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import gymnasium
import numpy as np
from PIL import Image

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.flags import RANDOM
from rl_workbench.tools.policies import TEST_SEED, environment_of, load_learned, random_actions
from rl_workbench.tools.runs import Run, open_run
from rl_workbench.training import checkpoints
from rl_workbench.training.checked import Env
from rl_workbench.training.evaluator import Act, episode_steps
from rl_workbench.training.folder import is_held

if TYPE_CHECKING:
    import viser

Size = tuple[int, int]  # width and height [pixels]

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
DEFAULT_RATE = 30.0  # [Hz], for an environment that doesn't state its own
MAX_NUMBERS = 3  # of an action, in a caption
DRAW = "draw_on"  # the method of an environment that draws itself on viser's pages
CAMERA, LOOK_AT = (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)  # in front of a picture on a page
HEIGHT, WIDTH = 1.2, 1.8  # of a picture on a page, at most
FACING = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)  # turns a picture's down to the page's, wxyz
QUALITY = 85  # of JPEG on a page
RECORDER_PATIENCE = 10.0  # [s] to wait for the recording thread to end
MAX_STEPS = 20_000  # of an episode on a page; some never end
MAX_BYTES = 2**28  # of an episode's pictures


class EpisodeFrame(NamedTuple):
    """A moment of an episode; the first one is the reset."""

    step: int
    seen: Any  # what `View.look` returned
    total_reward: float
    action: str  # empty at the reset
    success: bool | None = None  # at the end, if the environment says
    ended: bool = False  # the episode, which wasn't cut off

    def caption(self, title: str = "") -> str:
        """Returns a line of text for below the picture."""
        action = [f"action {self.action}"] if self.action else []
        parts = [title] if title else []
        parts += [f"step {self.step}", f"return {self.total_reward:.1f}", *action]
        return "   ".join([*parts, "ended"] if self.ended else parts)


class PictureView:
    """Takes the pictures of `render`, scaled to a size, and shows them on a page if there is one."""

    def __init__(self, env: Env, server: "viser.ViserServer | None" = None, size: Size | None = None) -> None:
        if env.render_mode != "rgb_array":
            raise WorkbenchError("the environment draws no pictures")
        self._env, self._server, self._size = env, server, size
        self._image: viser.ImageHandle | None = None

    def look(self) -> bytes:
        """Returns a PNG, because thousands are kept."""
        try:
            drawn: Any = self._env.render()
        except (gymnasium.error.Error, WorkbenchError) as error:
            raise WorkbenchError(f"the environment can't be drawn: {error}") from error
        if not isinstance(drawn, np.ndarray):
            raise WorkbenchError("the environment draws no pictures")
        picture = Image.fromarray(drawn)
        if self._size not in (None, picture.size):
            picture = picture.resize(self._size, Image.Resampling.LANCZOS)
        stream = BytesIO()
        picture.convert("RGB").save(stream, "PNG", compress_level=1)
        return stream.getvalue()

    def show(self, seen: bytes) -> None:
        """Shows it in the middle of the page, at most WIDTH by HEIGHT; all have the same size."""
        picture = np.asarray(Image.open(BytesIO(seen)))
        if self._image is not None:
            self._image.image = picture
            return
        assert self._server is not None
        high, wide = picture.shape[:2]
        scale = min(HEIGHT / high, WIDTH / wide)
        self._image = self._server.scene.add_image(
            "/picture", picture, wide * scale, high * scale, format="jpeg", jpeg_quality=QUALITY,
            wxyz=FACING, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip


class View(Protocol):
    """Captures an environment by `look`, and shows what that returned on a page, maybe in another thread."""

    def look(self) -> Any: ...

    def show(self, seen: Any) -> None: ...


def draws_itself(env: Env) -> bool:
    """Returns whether an environment can be seen in 3-D."""
    return hasattr(env.unwrapped, DRAW)


def make_view(server: "viser.ViserServer", env: Env) -> View:
    """Makes the best view that the environment has, and points the open pages' cameras at its front."""
    if not draws_itself(env):
        return PictureView(env, server)
    try:
        view: View = getattr(env.unwrapped, DRAW)(server)
    except gymnasium.error.Error as error:
        raise WorkbenchError(f"the environment can't be drawn: {error}") from error
    front = server.initial_camera
    for client in server.get_clients().values():
        with client.atomic():
            client.camera.position, client.camera.look_at = front.position, front.look_at
            client.camera.fov = front.fov
    return view


def record_episode(
    env: Env, act: Act, view: View, seed: int, *, stride: float = 1.0, max_steps: int = 0
) -> Iterator[EpisodeFrame]:
    """Plays an episode; yields its frames, one in `stride` steps on average, and the last."""
    total, due = 0.0, 0.0
    for length, step in enumerate(episode_steps(env, act, seed, max_steps)):
        total += step.reward
        if length < due and not step.finished:
            continue
        action = "" if step.action is None else _action_text(step.action)
        ended = step.finished and length != max_steps
        yield EpisodeFrame(length, view.look(), total, action, step.success, ended)
        while due <= length:
            due += stride


def _action_text(action: Any) -> str:
    numbers = np.ravel(action)
    if np.issubdtype(numbers.dtype, np.integer):
        words = [str(each) for each in numbers[:MAX_NUMBERS]]
    else:
        words = [f"{each:+.2f}" for each in numbers[:MAX_NUMBERS]]
    return " ".join([*words, *(["..."] if len(numbers) > MAX_NUMBERS else [])])


def step_rate(env: Env) -> float:
    """Returns the steps per second of simulated time [Hz]."""
    return float(env.metadata.get("render_fps") or DEFAULT_RATE)


def draw_without_display() -> None:
    """Makes pygame, and MuJoCo where there is no display, draw off screen; call it before importing them."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    # Without that library MuJoCo couldn't be imported any more, whether it draws or not.
    if not any(os.environ.get(name) for name in DISPLAYS) and ctypes.util.find_library("EGL"):
        os.environ.setdefault("MUJOCO_GL", "egl")


@dataclass
class RecordedEpisode:
    """An episode, whose frames grow while it is played."""

    which: str  # the checkpoint, or "random"
    seed: int
    frames: list[EpisodeFrame] = field(default_factory=list)
    policy: str = ""  # its description
    rate: float = DEFAULT_RATE  # steps per second of simulated time [Hz]
    is_over: bool = False
    note: str = ""  # what failed, or that it was cut off

    @property
    def length(self) -> int:
        """The number of steps so far."""
        return max(0, len(self.frames) - 1)


class EpisodeRecorder:
    """Plays and records episodes of a run, which may begin later; only its thread touches the environment."""

    def __init__(self, folder: Path, server: "viser.ViserServer", env_options: dict[str, Any]) -> None:
        self._folder, self._server, self._env_options = folder, server, env_options
        self._env: Env | None = None
        self.view: View | None = None
        self._wanted: RecordedEpisode | None = None
        self._changed = threading.Condition()
        self._is_closed = False
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def play(self, which: str, seed: int) -> RecordedEpisode:
        """Starts an episode and returns it; abandons the one before."""
        episode = RecordedEpisode(which, seed)
        with self._changed:
            self._wanted = episode
            self._changed.notify()
        return episode

    def close(self) -> None:
        """Ends the thread, or abandons it if its environment doesn't answer."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        self._thread.join(RECORDER_PATIENCE)

    def newest(self, which: str) -> tuple[int, ...]:
        """Returns an identity of the checkpoint that `play` would load; empty if there is none."""
        if which == RANDOM:
            return (0,)
        for path in checkpoints.candidates(self._folder, best_first=which == "best"):
            try:
                status = path.stat()
            except OSError:  # the training may just have replaced it
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
                except (WorkbenchError, gymnasium.error.Error) as error:
                    episode.note = str(error) or type(error).__name__
                    self._close_environment()
                finally:
                    episode.is_over = True
        finally:
            self._close_environment()

    def _close_environment(self) -> None:
        """Closes the environment; the next episode makes a new one."""
        if self._env is not None:
            env, self._env = self._env, None
            with contextlib.suppress(WorkbenchError):  # the failure was already reported
                env.close()

    def _play(self, episode: RecordedEpisode) -> None:
        run = open_run(self._folder)
        check_robot_is_free(run, {**run.env_kwargs, **self._env_options})
        if self._env is None or self.view is None:
            try:
                drawn = {**self._env_options, "render_mode": "rgb_array"}
                self._env = environment_of(run, drawn)
            except WorkbenchError as error:
                environment_of(run, self._env_options).close()  # raises if it isn't the drawing
                raise WorkbenchError(f"the environment draws no pictures: {error}") from error
            self._server.scene.reset()  # removes the view of a failed environment
            self.view = make_view(self._server, self._env)
        act = self._policy(run, episode, self._env)
        episode.rate = step_rate(self._env)
        try:
            self._record(episode, self._env, act, self.view)
        except WorkbenchError:
            raise
        except (ValueError, AssertionError, RuntimeError) as error:
            raise WorkbenchError(f"the policy doesn't fit the environment: {error}") from error

    def _record(self, episode: RecordedEpisode, env: Env, act: Act, view: View) -> None:
        size = 0
        seed = TEST_SEED + episode.seed
        for frame in record_episode(env, act, view, seed, max_steps=MAX_STEPS):
            if self._wanted is not None or self._is_closed:  # another episode was requested
                return
            episode.frames.append(frame)
            size += len(frame.seen) if isinstance(frame.seen, bytes) else 0
            if frame.step == MAX_STEPS or size > MAX_BYTES:
                episode.note = f"cut off after {frame.step} steps"
                return

    def _policy(self, run: Run, episode: RecordedEpisode, env: Env) -> Act:
        if episode.which == RANDOM:
            episode.policy = RANDOM
            return random_actions(env, episode.seed)
        skipped: list[str] = []
        learned = load_learned(run, episode.which, say=skipped.append, env=env)
        episode.policy = f"{episode.which}, of step {learned.steps}"
        episode.note = "; ".join(skipped)
        return learned.act


def check_robot_is_free(run: Run, options: dict[str, Any]) -> None:
    """Checks that an episode with these options won't move the robot of a running training."""
    shared = run.config.get("shared_robot")
    if shared is None or not is_held(run.folder):
        return
    if not all(options.get(name) in values for name, values in shared.items()):
        return
    names = ", ".join(f"{name}={options.get(name)}" for name in shared) or run.env_id
    raise WorkbenchError(
        f"no episodes while it trains: {names} is the training's own robot. `view --env-kwargs` with "
        "another one plays that, and so does --gui of a training with --train-env-kwargs instead of "
        "--env-kwargs"
    )
