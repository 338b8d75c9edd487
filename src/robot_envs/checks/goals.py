"""What a goal adds to an environment: its space, an episode's goal, and observations with both goals."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.checks import task_checks
from robot_envs.errors import TaskError
from robot_envs.task import GoalTask
from robot_envs.world_state import WorldState


def goal_space(task: GoalTask, observations: gymnasium.Space[Any]) -> gymnasium.spaces.Dict:
    """Of the observations of a goal environment.

    Raises:
        TaskError: if the task's goals are no Box.
    """
    goals = task_checks.space(task, "goals"), task_checks.space(task, "goals")
    if not isinstance(goals[0], gymnasium.spaces.Box):
        raise task_checks.wrong(task, "goals", goals[0], "a gymnasium.spaces.Box")
    return gymnasium.spaces.Dict(
        {"observation": observations, "achieved_goal": goals[0], "desired_goal": goals[1]}
    )


def aim(task: GoalTask, state: WorldState, rng: np.random.Generator, wanted: Any = None) -> None:
    """Gives a task the goal of an episode.

    Args:
        task: the task.
        state: in which the episode begins.
        rng: of the environment; a goal is drawn in any case, so that the stream doesn't depend on it.
        wanted: another one than the task draws; None: that one.

    Raises:
        TaskError: if the goal isn't one of the task's.
    """
    drawn = task.goal(rng, state)
    given, space = drawn if wanted is None else wanted, task.goals()
    try:
        goal = np.asarray(given, space.dtype)
    except (TypeError, ValueError):  # no numbers
        goal = np.array(math.nan)
    if not space.contains(goal):
        raise TaskError(f"the goal {given} isn't one of {type(task).__name__}'s goals: {space}")
    task.desired = goal


def with_goals(task: GoalTask, seen: Any, state: WorldState) -> dict[str, Any]:
    """What an environment of this task observes.

    Args:
        task: whose episode has a goal.
        seen: what `observe` returned, in the form of its space.
        state: of which that is.

    Raises:
        TaskError: if what the state achieves is no goal.
    """
    achieved = task_checks.goal(task, "achieved", task.achieved(state), task.desired)
    return {
        "observation": seen,
        "achieved_goal": achieved,
        "desired_goal": task.desired.copy(),
    }
