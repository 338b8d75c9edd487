"""/gazebo/get_scene: what the world looks like, for a window that asks once."""

import secrets
from copy import copy

import rospy
from bullet_gazebo_msgs.msg import SceneModel
from bullet_gazebo_msgs.srv import GetScene, GetSceneRequest, GetSceneResponse

from bullet_gazebo.ros.scene.scene_messages import to_light, to_model
from bullet_gazebo.simulator import Simulator

SERVICE = "~get_scene"


class SceneNumbers:
    """The world's numbers as clients see them: not those of another simulator that ran before."""

    def __init__(self, sim: Simulator) -> None:
        self._world = sim.world
        self._first = secrets.randbits(31)

    @property
    def version(self) -> int:
        """Counts what changes the look of the world; the caller holds the lock."""
        return self.of(self._world.version)

    def of(self, number: int) -> int:
        """Returns a version, or a model's number, as clients see it."""
        return (self._first + number) % 2**32


class SceneService:
    """Tells what there is to be seen."""

    def __init__(self, sim: Simulator, numbers: SceneNumbers) -> None:
        self._sim = sim
        self._numbers = numbers
        self._service = rospy.Service(SERVICE, GetScene, self._get)

    def _get(self, request: GetSceneRequest) -> GetSceneResponse:
        world, known = self._sim.world, frozenset(request.known)
        with self._sim.lock:  # what a large model consists of is looked through without it
            version = self._numbers.version
            models = list(world.models.values())
            lights = [copy(light) for light in world.lights.values()]
        found = []
        for model in models:
            number = self._numbers.of(model.number)
            if number in known:
                found.append(SceneModel(number=number, name=model.name, known=True))
            else:
                found.append(to_model(model, number, request.collisions))
        return GetSceneResponse(version, found, [to_light(light) for light in lights])
