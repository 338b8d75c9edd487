"""A world of robots in lock-step with its step services, without ROS."""

import contextlib
import threading
from functools import lru_cache

import pytest
import xacro
import yaml
from bullet_gazebo_msgs.srv import PreparedStepRequest, PrepareStepRequest, StepWorldRequest
from support.robots.worlds import add_robot, start
from support.ros.track import Track

from bullet_gazebo.services import step_service
from bullet_gazebo.services.step_service import StepService
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import ground_plane
from robot_sim.sensors.sensing import Sensing

BOX = """<robot name="crate"><link name="crate">
<inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"""


@lru_cache(maxsize=1)
def slides(root):
    return xacro.process_file(str(root / "test/data/robots/slides.urdf")).toxml()


class Slides:
    """A world in lock-step with robots of six carriages, and its step service without ROS."""

    def __init__(self, sim, root):
        self.sim = sim
        self._urdf = slides(root)
        self._params = yaml.safe_load((root / "test/data/robots/slides.yaml").read_text())
        self.service = StepService(sim, Sensing(sim), contextlib.nullcontext(), threading.Lock())

    def add(self, name, *controllers):
        robot = add_robot(self.sim, name, self._urdf, namespace=f"/{name}")
        start(robot, {each: self._params[each] for each in controllers})

    def call(self, ticks=0, **fields):
        return self.service._step(StepWorldRequest(ticks=ticks, **fields))

    def prepare(self, **names):
        answer = self.service._prepare(PrepareStepRequest(**names))
        assert answer.success, answer.status_message
        return answer

    def prepared(self, prepared, ticks, *commands):
        return self.service._step_prepared(PreparedStepRequest(prepared.handle, ticks, commands))

    def step(self, ticks, **fields):
        """Joints by name: (position, velocity, effort)."""
        answer = self.call(ticks, **fields)
        assert answer.success, answer.status_message
        states = answer.joint_states
        found = zip(states.position, states.velocity, states.effort, strict=True)
        return dict(zip(states.name, found, strict=True))


@pytest.fixture
def world(sim, root, monkeypatch):
    monkeypatch.setattr(step_service.rospy, "Service", lambda *args: None)
    return Slides(sim, root)


@pytest.fixture
def objects(world):
    """The world with a robot, the ground, and a crate on it."""
    world.add("slides", "effort_joint", "states")
    world.sim.world.spawn("ground_plane", ground_plane(), Pose())
    world.sim.world.spawn("crate", parse_urdf(BOX), Pose((0.0, 3.0, 0.1)))
    return world


@pytest.fixture
def track(make_world, monkeypatch):
    """Ground for a vehicle whose plugins' topics are caught."""
    return Track(make_world(ground=True), monkeypatch)
