"""What is to be learned: observation, reward, end of an episode, initial state, and what an action does.

Knows neither ROS nor a simulator nor a learner; every backend runs the same tasks.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from robot_envs.files import Source
from robot_envs.world_state import Commands, InitialState, Pose, StateQuery, WorldState


@dataclass(frozen=True)
class Object:
    """An obstacle, or a thing to handle, that a task needs beside its robots.

    Args:
        name: of the model in the world.
        file: its SDF or URDF: a path, "package://PACKAGE/PLACE", or the text itself.
        pose: where it is spawned; an `InitialState` may put it elsewhere for an episode.
    """

    name: str
    file: Source
    pose: Pose = Pose()


class Task(ABC):
    """One thing to learn.

    A class of one's own says at least what actions and observations are, what they mean, and the reward:

    | attribute | what it says |
    |---|---|
    | `max_steps` | after how many steps an episode is cut off (truncated); None: never |
    | `query` | links, models and contacts that a `state` tells beside joints; others cost nothing |
    | `objects` | what is spawned beside the robots |

    Names that a state has for joints, and commands for controllers, are plain where a world has one robot;
    see `WorldState` for several. A task may keep what it likes from one call to the next, if
    `initial_state`, which begins an episode, sets it anew.
    """

    max_steps: int | None = None
    query: StateQuery = StateQuery()
    objects: Sequence[Object] = ()

    @abstractmethod
    def action_space(self) -> gymnasium.Space[Any]:
        """A new space of the actions."""

    @abstractmethod
    def observation_space(self) -> gymnasium.Space[Any]:
        """A new space of the observations."""

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws where an episode begins; as spawned, with all joints at 0, unless overridden."""
        return InitialState()

    @abstractmethod
    def apply(self, action: Any, state: WorldState) -> Commands:
        """What an action, which lies in its space, commands.

        Args:
            action: of the action space.
            state: before the action; `state.commands` is what the controllers hold.

        Returns:
            Commands by controller; those that aren't named keep theirs.
        """

    @abstractmethod
    def observe(self, state: WorldState) -> Any:
        """The state as the learner sees it: of the observation space's shape."""

    @abstractmethod
    def reward(self, state: WorldState, action: Any) -> float:
        """The reward for arriving in a state by an action."""

    def is_terminal(self, state: WorldState) -> bool:
        """Whether the state ends the episode; none does, unless overridden."""
        return False

    def info(self, state: WorldState) -> dict[str, Any]:
        """What else is told of a state, beside the observation."""
        return {}


class GoalTask(Task):
    """A task with a goal that each episode draws: for hindsight experience replay, too.

    Observations are dicts of "observation" (`observe`), "achieved_goal" and "desired_goal", as
    Gymnasium-Robotics has them; `compute_reward` is the environment's, too. The infos tell
    "is_success".
    """

    desired: np.ndarray
    """The goal of this episode."""

    @abstractmethod
    def goals(self) -> gymnasium.spaces.Box:
        """A new space of the goals."""

    @abstractmethod
    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        """Draws the goal of an episode that begins in a state."""

    @abstractmethod
    def achieved(self, state: WorldState) -> np.ndarray:
        """The goal that a state reaches."""

    @abstractmethod
    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> Any:
        """Whether goals are reached: (..., n) and (..., n) to (...) of bool."""

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> Any:
        """The reward for achieving one goal where another one is desired: (..., n) and (..., n) to (...).

        0 for a success, and -1, unless overridden.
        """
        return np.where(self.is_success(achieved, desired), 0.0, -1.0)

    def reward(self, state: WorldState, action: Any) -> float:
        """`compute_reward` of what the state achieves."""
        return float(self.compute_reward(self._reached(state), self.desired, {}))

    def info(self, state: WorldState) -> dict[str, Any]:
        """Tells `is_success`."""
        return {"is_success": bool(self.is_success(self._reached(state), self.desired))}

    def _reached(self, state: WorldState) -> np.ndarray:
        """As the observation tells it, so that a reward that is computed of it is the same."""
        return np.asarray(self.achieved(state), self.desired.dtype)
