"""What stands in a world beside its first robot: other robots, a task's objects, the world file's models."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from bullet_gazebo.physics.description import ModelDescription, Shape
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.visuals import visible_shapes
from robot_envs.backends.world_files import object_model, world_models
from robot_envs.robot import Robot
from robot_envs.scene import Scene

Shapes = list[tuple[str, Shape]]  # each with its link


class Surroundings:
    """Knows what is seen beside the first robot, and asks a backend where it is.

    Where the first robot has joints that a state doesn't tell, their links are asked for, too.

    Args:
        scene: the robots and objects.
        ask: where the frames of links are in the world, each named model::link.
    """

    def __init__(self, scene: Scene, ask: Callable[[Sequence[str]], Sequence[Pose]]) -> None:
        self._scene, self._ask = scene, ask

    @cached_property
    def shapes(self) -> Mapping[str, Shapes]:
        """What is seen of each model, by its name.

        Raises:
            RobotEnvError: if a file can't be read.
        """
        first, *others = self._scene.robots
        models: dict[str, ModelDescription] = {robot.model: robot.links for robot in others}
        models |= {each.name: object_model(each) for each in self._scene.objects}
        models |= world_models(first.world)
        shapes = {name: visible_shapes(model) for name, model in models.items()}
        return {name: seen for name, seen in shapes.items() if seen}

    @property
    def robots(self) -> Sequence[Robot]:
        """Those beside the first one."""
        return self._scene.robots[1:]

    def poses(self) -> dict[str, dict[str, Pose]]:
        """Where the links are, by model.

        Raises:
            SimulatorError: if the backend has to be asked, and doesn't answer.
        """
        asked = self._asked
        found: dict[str, dict[str, Pose]] = {model: {} for model, _ in asked}
        if asked:
            names = [f"{model}::{link}" for model, link in asked]
            for (model, link), pose in zip(asked, self._ask(names), strict=True):
                found[model][link] = pose
        return found

    @cached_property
    def _asked(self) -> list[tuple[str, str]]:
        first = self._scene.robots[0]
        moved = {joint.name for joint in first.links.movable_joints}
        own = list(first.links.links) if moved - set(first.joints) else []
        links = [(first.model, link) for link in own]
        for model, shapes in self.shapes.items():
            links += [(model, link) for link in dict.fromkeys(link for link, _ in shapes)]
        return links
