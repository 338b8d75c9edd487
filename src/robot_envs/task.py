"""Tasks: actions, observations, rewards, episodes; they know neither ROS nor simulators nor learners."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import gymnasium
import numpy as np

from robot_envs.files import Source
from robot_envs.snapshot import EnvSnapshot
from robot_envs.world_state import Commands, InitialState, Pose, StateQuery, WorldState
from robot_sim.physics.pose import Vector
from robot_sim.state_dict import Stateful


@dataclass(frozen=True)
class Object:
    """An obstacle or an object to handle, in addition to a task's robots.

    Args:
        name: Name of the model in the world.
        file: Its SDF or URDF: a path, "package://PACKAGE/PLACE", or the text itself.
        pose: Where it is spawned; an `InitialState` may put it somewhere else for an episode.
    """

    name: str
    file: Source
    pose: Pose = Pose()


class Task(Stateful, ABC):
    """One thing to learn.

    A subclass defines at least the spaces of actions and observations, what they mean, and the reward:

    | attribute | meaning |
    |---|---|
    | `max_steps` | after how many steps an episode is truncated; None: never |
    | `query` | links, models and contacts that a `state` has besides joints; others cost nothing |
    | `reward_query` | further ones that only `reward`, `is_terminal` and `info` see |
    | `objects` | what is spawned besides the robots |
    | `world` | a world file in place of the first robot's; None: that one |
    | `action_names` | of an action's numbers, for who drives them by hand; by default 1, 2, … |
    | `aims_at_velocity` | whether `aim` takes a velocity (ahead, to the left, about), as `cmd_vel` has it |

    Names of joints in states and of controllers in commands are plain in a world with one robot; see
    `WorldState` for several. A world of joints alone, as a real robot's, can't tell what the `reward_query`
    names: there those three methods aren't called, nothing is rewarded, and nothing terminates. A task may
    store data between calls, if `initial_state`, which begins an episode, resets it.
    """

    non_persistent: ClassVar[tuple[str, ...]] = ("query", "reward_query", "objects", "world", "action_names")
    max_steps: int | None = None
    query: StateQuery = StateQuery()
    reward_query: StateQuery = StateQuery()
    objects: Sequence[Object] = ()
    world: Source | None = None
    action_names: Sequence[str] = ()
    aims_at_velocity: ClassVar[bool] = False

    @abstractmethod
    def action_space(self) -> gymnasium.Space[Any]:
        """Makes the action space."""

    @abstractmethod
    def observation_space(self) -> gymnasium.Space[Any]:
        """Makes the observation space."""

    def initial_state(self, rng: np.random.Generator) -> InitialState | EnvSnapshot:
        """Draws the state in which an episode begins; by default as spawned, with all joints at 0.

        It may be a snapshot of an environment with the same robots, such as one of `InitialStates`.
        """
        return InitialState()

    @abstractmethod
    def apply(self, action: Any, state: WorldState) -> Commands:
        """Converts an action to commands by controller; those that aren't named keep theirs.

        `state` is that before the action; its `commands` are what the controllers hold.
        """

    @abstractmethod
    def observe(self, state: WorldState) -> Any:
        """Returns the observation of a state, in the observation space's shape."""

    @abstractmethod
    def reward(self, state: WorldState, action: Any) -> float:
        """Returns the reward for reaching a state by an action."""

    def aim(self, goal: Any) -> None:
        """Sets the goal of a deployed policy; raises ValueError if it isn't one.

        By default there are none; a `GoalTask`'s are those of its `goals`.
        """
        raise ValueError(f"{type(self).__name__} has no goal")

    def goal_mark(self) -> tuple[Vector, float] | None:
        """Returns place and radius [m] of the goal's mark in pictures; None: no mark."""
        return None

    def is_terminal(self, state: WorldState) -> bool:
        """Returns whether the state terminates the episode; by default none does."""
        return False

    def info(self, state: WorldState) -> dict[str, Any]:
        """Returns the info dict of a state."""
        return {}


class Unrewarded:
    """Evaluator for a task whose `reward_query` the world can't answer: no reward, and no end."""

    def is_terminal(self, state: WorldState) -> bool:
        return False

    def reward(self, state: WorldState, action: Any) -> float:
        return 0.0

    def info(self, state: WorldState) -> dict[str, Any]:
        return {}


class GoalTask(Task):
    """A task with a goal that each episode draws, also for hindsight experience replay.

    Observations are dicts of "observation" (`observe`), "achieved_goal" and "desired_goal", as in
    Gymnasium-Robotics; the environment has `compute_reward`. The info has "is_success".
    """

    desired: np.ndarray
    """The goal of the present episode."""

    @abstractmethod
    def goals(self) -> gymnasium.spaces.Box:
        """Makes the space of goals."""

    @abstractmethod
    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        """Draws the goal of an episode that begins in `state`."""

    @abstractmethod
    def achieved(self, state: WorldState) -> np.ndarray:
        """Returns the goal that a state achieves."""

    @abstractmethod
    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> Any:
        """Returns whether goals are reached: bool of shape (...) from goals of shape (..., n)."""

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> Any:
        """Returns the rewards, of shape (...), for achieving one goal when another is desired (..., n).

        By default 0 for a success, and -1 otherwise.
        """
        return np.where(self.is_success(achieved, desired), 0.0, -1.0)

    def reward(self, state: WorldState, action: Any) -> float:
        """`compute_reward` of the goal that the state achieves."""
        return float(self.compute_reward(self._reached(state), self.desired, {}))

    def info(self, state: WorldState) -> dict[str, Any]:
        """Has `is_success`."""
        return {"is_success": bool(self.is_success(self._reached(state), self.desired))}

    def _reached(self, state: WorldState) -> np.ndarray:
        # In the observation's type, so that a reward computed from either is the same.
        return np.asarray(self.achieved(state), self.desired.dtype)
