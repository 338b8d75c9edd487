"""Several environments of a process in one simulated world: one of them has its episode and objects there."""

from collections.abc import Sequence
from typing import Protocol
from weakref import WeakSet

from robot_envs.backends.ros import gazebo
from robot_envs.errors import SimulatorError
from robot_envs.files import read_text
from robot_envs.scene import Scene
from robot_envs.task import Object
from ros_utils import ros_gazebo


class SharedBackend(Protocol):
    """One of the backends that move the same robots."""

    scene: Scene

    def restore(self) -> None:
        """Undoes this backend's variations of the robots."""
        ...


class SharedWorld:
    """Knows which backend began the latest episode, and keeps its objects in the world.

    Models of the same names that were there before are used, and left there.
    """

    def __init__(self) -> None:
        self._holder: SharedBackend | None = None
        self._users: WeakSet[SharedBackend] = WeakSet()  # a dropped backend has left, too
        self._objects: list[Object] = []
        self._spawned: list[str] = []

    @property
    def is_used(self) -> bool:
        """Whether a backend has joined, and not left."""
        return bool(self._users)

    def join(self, user: SharedBackend) -> None:
        """Registers a backend, until `leave`."""
        self._users.add(user)

    def claim_if_free(self, user: SharedBackend) -> bool:
        """Claims the world unless another backend holds it; returns whether `user` holds it now."""
        if self._holder is None:
            self.claim(user)
        return self._holder is user

    def claim(self, user: SharedBackend) -> None:
        """Begins an episode: those of others end, and their variations are undone.

        Raises:
            RobotEnvError: if an object can't be read or spawned, or the simulator doesn't answer.
        """
        before, self._holder = self._holder, None  # nobody's, if something fails
        if before is not None and before is not user:
            before.restore()
        self.place_objects(user.scene.objects)
        self._holder = user

    def leave(self, user: SharedBackend) -> None:
        """Unregisters a backend, and removes its objects."""
        self._users.discard(user)
        if self._holder is user:
            self._holder = None
            self.place_objects(())

    def check_holder(self, user: SharedBackend) -> None:
        """Raises SimulatorError if another backend has begun an episode since."""
        if self._holder is not user:
            raise SimulatorError(
                "another environment of this process has moved the same robot since this one's reset(); "
                "over ROS use them one after the other, each beginning with reset(), or each in a simulator "
                'of its own: backend="ros-own"'
            )

    def place_objects(self, wanted: Sequence[Object]) -> None:
        """Spawns these objects, in this order, in place of all others that were spawned here.

        Raises:
            RobotEnvError: if one can't be read or spawned, or the simulator doesn't answer.
        """
        if list(wanted) == self._objects:
            return
        # All are spawned anew: the order of a world's models affects its bits.
        self._remove_objects()
        try:
            present = gazebo.models() if wanted else []
            for each in wanted:
                if each.name not in present:
                    gazebo.spawn(each.name, read_text(each.file), each.pose)
                    self._spawned.append(each.name)
        except BaseException:
            self._remove_objects()
            raise
        self._objects = list(wanted)

    def _remove_objects(self) -> None:
        self._objects = []
        while self._spawned:
            ros_gazebo.gazebo_delete_model(self._spawned.pop())
