"""What the tasks of a session need beside robots, in the simulator's world: spawned, and taken away again."""

from collections.abc import Sequence

from robot_envs.backends.ros.bringup import world
from robot_envs.description.files import read_text
from robot_envs.task import Object
from ros_utils import ros_gazebo


class Objects:
    """Those that stand in the world; others' models of the same names are used, and left there."""

    def __init__(self) -> None:
        self._wanted: list[Object] = []
        self._spawned: list[str] = []

    def __call__(self, wanted: Sequence[Object]) -> None:
        """Has the world hold these, in this order, and no other ones.

        All come anew where one differs: the order of a world's models is part of its bits.

        Raises:
            RobotEnvError: if something can't be read or spawned, or the simulator doesn't answer.
        """
        if list(wanted) == self._wanted:
            return
        self._clear()
        try:
            self._fill(wanted)
        except BaseException:  # what came before what failed
            self._clear()
            raise
        self._wanted = list(wanted)

    def _fill(self, wanted: Sequence[Object]) -> None:
        there = world.models() if wanted else []
        for each in wanted:
            if each.name not in there:
                world.spawn(each.name, read_text(each.file), each.pose)
                self._spawned.append(each.name)

    def _clear(self) -> None:
        self._wanted = []
        while self._spawned:
            ros_gazebo.gazebo_delete_model(self._spawned.pop())
