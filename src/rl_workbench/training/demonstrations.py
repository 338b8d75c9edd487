"""Demonstrations: episodes as seeds and actions, a small file each; recording and replaying them."""

import copy
import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import NoneType
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from rl_workbench.env_ids import without_module
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import is_plain
from rl_workbench.storage import reading, write_file
from rl_workbench.training.checked import Env
from rl_workbench.training.environments import make_environment, succeeded
from rl_workbench.training.folder import library_versions, other_versions
from rl_workbench.training.options import RunOptions

FORM = 1  # of the files
NAMES = "episode_*.npz"
_HEADER = "header"


class Origin(NamedTuple):
    """What an episode was played in."""

    env_id: str
    env_kwargs: dict[str, Any]
    wrapper: str = ""  # module:function; empty for none

    def make(self, options: Mapping[str, Any] | None = None) -> Env:
        """Makes the environment, with further options; it keeps a Dict of arrays and images."""
        given = {**self.env_kwargs, **(options or {})}
        return make_environment(self.env_id, given, keep_dict=True, wrapper=self.wrapper)

    def same_id(self, env_id: str) -> bool:
        """Returns whether an id is that of this environment."""
        return without_module(self.env_id) == without_module(env_id)


@dataclass(frozen=True)
class Demonstration:
    """An episode. It need not have ended: a driver may stop it where it has succeeded."""

    env_id: str
    env_kwargs: dict[str, Any]
    wrapper: str
    seed: int
    success: bool | None  # None: nobody says
    terminated: bool
    truncated: bool
    versions: dict[str, str]
    actions: np.ndarray  # [steps, ...]
    rewards: np.ndarray  # [steps]
    seen: np.ndarray  # digests of the observations [steps + 1]

    @property
    def origin(self) -> Origin:
        """What it was played in."""
        return Origin(self.env_id, self.env_kwargs, self.wrapper)


class Played(NamedTuple):
    """A step of a replay; the first one is the reset, which has no action."""

    observation: Any
    action: Any
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]


class Recorder:
    """Records an episode step by step, whoever chooses the actions. The environment is made by `origin`."""

    def __init__(self, env: Env, origin: Origin) -> None:
        if not isinstance(env.action_space, spaces.Box | spaces.Discrete | spaces.MultiDiscrete
                          | spaces.MultiBinary):  # fmt: skip
            raise WorkbenchError(
                f"{origin.env_id} takes actions of {env.action_space}; demonstrations hold numbers, or "
                "arrays of them"
            )
        if not is_plain(origin.env_kwargs):
            raise WorkbenchError(f"env_kwargs has values that JSON can't hold: {origin.env_kwargs}")
        self._env, self._origin = env, origin
        self._versions = library_versions()

    def begin(self, seed: int) -> Any:
        """Begins an episode, and discards one under way; returns its first observation."""
        self._seed = seed
        self._actions: list[np.ndarray] = []
        self._rewards: list[float] = []
        self._terminated = self._truncated = False
        self.success: bool | None = None  # what the environment says in its last info
        observation, _ = self._env.reset(seed=seed)
        self._seen = [_digest(self._env, observation)]
        return observation

    @property
    def has_ended(self) -> bool:
        """Whether the environment has ended the episode."""
        return self._terminated or self._truncated

    @property
    def length(self) -> int:
        """The number of steps so far."""
        return len(self._actions)

    @property
    def total_reward(self) -> float:
        """The sum of the rewards so far."""
        return sum(self._rewards)

    def step(self, action: Any) -> Any:
        """Carries out an action; returns what is observed then."""
        taken = np.array(action, self._env.action_space.dtype)
        observation, reward, terminated, truncated, info = self._env.step(_as_taken(self._env, taken))
        self._actions.append(taken)
        self._rewards.append(float(reward))
        self._seen.append(_digest(self._env, observation))
        self._terminated, self._truncated = bool(terminated), bool(truncated)
        self.success = succeeded(info)
        return observation

    def undo(self, steps: int = 1) -> Any:
        """Takes back the last steps, by playing those before them again; returns what was observed there.

        A snapshot would do so faster, but to take one changes the bits of what follows.
        """
        kept = self._actions[: max(len(self._actions) - steps, 0)]
        observation = self.begin(self._seed)
        for action in kept:
            observation = self.step(action)
        return observation

    def episode(self, success: bool | None = None) -> Demonstration:
        """Returns the episode so far; `success` overrides what the environment says in its last info."""
        success = self.success if success is None else success
        return Demonstration(
            *self._origin, self._seed, success, self._terminated, self._truncated, self._versions,
            np.array(self._actions), np.array(self._rewards), np.array(self._seen, np.uint64),
        )  # fmt: skip


def _as_taken(env: Env, action: np.ndarray) -> Any:
    return int(action) if isinstance(env.action_space, spaces.Discrete) else action


def _digest(env: Env, observation: Any) -> int:
    """Returns the same for an observation, and for what FlattenObservation makes of it."""
    flat = np.asarray(spaces.flatten(env.observation_space, observation), np.float64)
    return int.from_bytes(hashlib.blake2b(flat.tobytes(), digest_size=8).digest(), "little")


def save(folder: Path, episode: Demonstration) -> Path:
    """Adds an episode to a folder; returns its file."""
    taken = [int(path.stem.rpartition("_")[2]) for path in paths(folder)]
    path = folder / f"episode_{max(taken, default=-1) + 1:05d}.npz"
    values = {each.name: getattr(episode, each.name) for each in fields(Demonstration)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    header = {name: value for name, value in values.items() if name not in arrays}
    text, memory = json.dumps({"form": FORM, **header}), io.BytesIO()
    np.savez_compressed(memory, allow_pickle=False, **{_HEADER: np.array(text)}, **arrays)
    write_file(path, lambda stream: stream.write(memory.getbuffer()))
    return path


def paths(folder: Path) -> list[Path]:
    """Returns a folder's files of episodes, in order."""
    return sorted(path for path in folder.glob(NAMES) if path.stem[8:].isdecimal())


def load(path: Path) -> Demonstration:
    """Reads an episode."""
    with reading(path, "isn't a demonstration, or it is damaged: {}"), np.load(path) as content:
        header = json.loads(str(content[_HEADER]))
        if header.pop("form", None) != FORM:
            raise ValueError("it is of another version of this program")
        episode = Demonstration(**header, **{name: content[name] for name in set(content) - {_HEADER}})
        kinds = (str, dict, str, int, bool | NoneType, bool, bool, dict)
        for field, kind in zip(fields(Demonstration), kinds, strict=False):
            if not isinstance(getattr(episode, field.name), kind):
                raise ValueError(f"its {field.name} is {getattr(episode, field.name)!r:.50}")
        steps = len(episode.actions)
        if not steps or (len(episode.rewards), len(episode.seen)) != (steps, steps + 1):
            raise ValueError("it is not whole")
    return episode


def load_all(folder: Path) -> dict[Path, Demonstration]:
    """Reads the episodes of a folder, which have to be of one environment."""
    found = {path: load(path) for path in paths(folder)}
    if not found:
        raise WorkbenchError(f"{folder} has no demonstrations: {NAMES}, as `demonstrate` writes them")
    (first, one), *others = found.items()
    for path, other in others:
        if other.origin != one.origin:
            raise WorkbenchError(f"{path} is of another environment, or other options, than {first}")
    return found


def replay(path: Path, episode: Demonstration, env: Env, exactly: bool = True) -> Iterator[Played]:
    """Plays an episode again, in an environment like its own, and compares it to the bit.

    Without `exactly` only rewards and ends must match: the environment may have other options.
    Raises WorkbenchError, naming file and step, at the first difference.
    """

    def compare(step: int, **pairs: tuple[Any, Any]) -> None:
        for name, (now, before) in pairs.items():
            if now != before:
                why = other_versions(episode.versions) or "were the robot's or the task's files changed?"
                raise WorkbenchError(f"{path} goes another way in step {step}: other {name} ({why})")

    if episode.actions.shape[1:] != env.action_space.shape:
        raise WorkbenchError(f"{path} has no actions of {env.action_space}: {episode.env_id} has changed")
    observation, info = env.reset(seed=episode.seed)
    played = Played(copy.deepcopy(observation), None, 0.0, False, False, info)
    steps = len(episode.actions)
    for step in range(steps + 1):
        if exactly:
            seen = _digest(env, observation), int(episode.seen[step])
            compare(step, observations=seen)
        yield played
        if step == steps:
            return
        action = _as_taken(env, episode.actions[step])
        observation, reward, *ended, info = env.step(action)
        last = (episode.terminated, episode.truncated) if step + 1 == steps else (False, False)
        compare(step + 1, rewards=(float(reward), float(episode.rewards[step])),
                ends=(tuple(map(bool, ended)), last))  # fmt: skip
        played = Played(copy.deepcopy(observation), action, float(reward), *last, info)


def replayed(folder: str, run: RunOptions, env: Env) -> Iterator[list[Played]]:
    """Replays demonstrations in a training's environment; leaves out those that are marked as failures.

    Its wrapper and options may show other observations than were recorded.
    """
    if not folder:
        raise WorkbenchError("--demos FOLDER names the demonstrations, as `demonstrate` writes them")
    here = Origin(run.env_id, run.training_environment, run.wrapper)
    found = load_all(Path(folder))
    good = {path: each for path, each in found.items() if each.success is not False}
    if not good:
        raise WorkbenchError(f"{folder}: none of the {len(found)} demonstrations succeeded")
    for path, episode in good.items():
        if not episode.origin.same_id(here.env_id):
            raise WorkbenchError(f"{path} is of {episode.env_id}, not of {here.env_id}")
        yield list(replay(path, episode, env, exactly=episode.origin[1:] == here[1:]))
