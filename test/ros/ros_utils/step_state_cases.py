"""Links, models and contacts over ROS are bit-identical to those in-process."""

import importlib.util
import unittest

from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from support.robots.arm_and_box import (
    ARM,
    ARM_PARAMETERS,
    BOX,
    CONTROLLERS,
    DROPPED,
    SEEN,
    START,
    STEPS,
    THROWN,
    TICKS,
    ArmAndBox,
    commands,
)

from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.simulation import Simulation
from ros_utils.step_client import StepClient, StepRefused

ASKED = {
    "model_states": SEEN.models,
    "links": {each.link: each.frame for each in SEEN.links},
    "contacts": SEEN.contacts_of,
}
PLACED = {
    "models": {"box": Pose(Point(*DROPPED.position), Quaternion(*DROPPED.orientation))},
    "twists": {"box": Twist(*(Vector3(*part) for part in THROWN))},
}


def numbers(message):
    """All numbers of a message, its names left out."""
    if isinstance(message, float):
        return [message]
    if isinstance(message, (list, tuple)):
        return [number for item in message for number in numbers(item)]
    if isinstance(message, str):
        return []
    return [number for slot in message.__slots__ for number in numbers(getattr(message, slot))]


def as_in_process(answer):
    """An answer's models, links and contacts, flat, as `told_here` has them."""
    models = zip(answer.model_names, answer.model_poses, answer.model_twists, strict=True)
    links = zip(answer.link_poses, answer.link_twists, strict=True)
    contacts = [
        (pair.collision1_name, pair.collision2_name, numbers(pair.contact_positions),
         numbers(pair.contact_normals), numbers(pair.wrenches), list(pair.depths),
         numbers(pair.total_wrench))
        for pair in answer.contacts
    ]  # fmt: skip
    return (
        {name: (numbers(pose), numbers(twist)) for name, pose, twist in models},
        [(numbers(pose), numbers(twist)) for pose, twist in links],
        contacts,
    )


def told_here(answer):
    """The same of a world in this process."""
    contacts = [
        (pair.first, pair.second, numbers(pair.points), numbers(pair.normals),
         numbers(pair.wrenches), pair.depths, numbers(pair.total))
        for pair in answer.contacts
    ]  # fmt: skip
    return (
        {name: (numbers(pose), numbers(twist)) for name, (pose, twist) in answer.models.items()},
        [(numbers(pose), numbers(twist)) for pose, twist in answer.links],
        contacts,
    )


def spawn():
    """The world of `ArmAndBox`; returns a client for it."""
    assert ros_params.ros_load_yaml_from_path(str(ARM_PARAMETERS))
    assert ros_urdf.urdf_load_from_path(str(ARM), "robot_description")
    assert ros_gazebo.gazebo_spawn_urdf_param("robot_description", "two_link_arm")[0]
    assert ros_controllers.spawn_controllers_srv(list(CONTROLLERS))
    assert ros_gazebo.gazebo_spawn_urdf_string(BOX, "box", pos_x=1.0, pos_z=0.1)[0]
    return StepClient()


class StepState(unittest.TestCase):
    """One simulator, on an engine."""

    engine = "bullet"
    arguments = ""  # of the server

    @classmethod
    def setUpClass(cls):
        simulation = Simulation(lockstep=True, extra_gazebo_args=cls.arguments)
        cls.addClassCleanup(simulation.close)
        cls.enterClassContext(simulation.active())
        cls.client = spawn()
        cls.addClassCleanup(cls.client.close)

    def episode(self):
        places = {name: state[0] for name, state in START.items()}
        speeds = {name: state[1] for name, state in START.items()}
        told = [self.client.reset(places, speeds, **PLACED, **ASKED)]
        for step in range(STEPS):
            efforts = dict(zip(CONTROLLERS, commands(step), strict=True))
            told.append(self.client.step(TICKS, efforts, **ASKED))
        return told

    def test_the_bits_are_those_of_this_process(self):
        scene = ArmAndBox(self.engine)
        self.addCleanup(scene.close)
        here = [told_here(answer) for answer in scene.episode()]
        for _ in range(2):
            told = [as_in_process(answer) for answer in self.episode()]
            self.assertEqual(told, here)
        self.assertGreater(sum(bool(contacts) for *_, contacts in told), 5)


class OnBullet(StepState):
    def test_refusals_name_what_was_meant_and_change_nothing(self):
        step, reset = self.client.step, self.client.reset
        before = step(1, model_states=True)
        for call, text in (
            (lambda: step(1, links=["tpi"]), "did you mean 'tip'"),
            (lambda: step(1, contacts=["bx"]), "did you mean 'box'"),
            (lambda: step(1, model_states=["bxo"]), "did you mean 'box'"),
            (lambda: reset(models={"boxes": Pose()}), "did you mean 'box'"),
            (lambda: reset(twists={"box": Twist()}), "twists without models"),
        ):
            with self.assertRaisesRegex(StepRefused, text):
                call()
        after = step(1)
        self.assertAlmostEqual(after.sim_time, before.sim_time + 0.001, places=9)
        self.assertEqual((after.model_names, after.link_poses, after.contacts), ([], [], []))


@unittest.skipIf(importlib.util.find_spec("mujoco") is None, "mujoco is not installed")
class OnMujoco(StepState):
    engine, arguments = "mujoco", "-e mujoco"


del StepState  # a base of the two, and no test by itself
