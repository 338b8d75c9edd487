"""Registration of environments with Gymnasium; imports neither robots nor physics."""

from typing import Any

import gymnasium

ENTRY_POINT = "robot_envs.making:make_environment"
VECTOR_ENTRY_POINT = "robot_envs.making:make_vector"


def register(
    identifier: str, robot: str, task: str, *, reward_threshold: float | None = None, **options: Any
) -> None:
    """Registers an environment with Gymnasium; registering it again with other options replaces it.

        register("my_arm/Reach-v0", "my_arm.robot:ARM", "my_arm.tasks:Reach")
        env = gymnasium.make("my_arm/Reach-v0", backend="ros")
        eight = gymnasium.make_vec("my_arm/Reach-v0", 8, backend="ros")

    Robot and task are given by name, so that other processes, such as workers, can make them as well.

    Args:
        identifier: Gymnasium's id: "namespace/Name-v0".
        robot: "module:attribute" of a `Robot`, a list of them, or a function that returns one.
        task: "module:attribute" of a class of `Task`, or a function that returns one.
        reward_threshold: The return from which on the task counts as solved.
        options: Options of `RobotEnv` or of the task; `gymnasium.make` may override them.
    """
    kwargs = {"robot": robot, "task": task, **options}
    known = gymnasium.registry.get(identifier)
    if known is None or (known.kwargs, known.reward_threshold) != (kwargs, reward_threshold):
        gymnasium.register(
            identifier,
            entry_point=ENTRY_POINT,
            vector_entry_point=VECTOR_ENTRY_POINT,
            reward_threshold=reward_threshold,
            kwargs=kwargs,
        )
