#!/usr/bin/env python3
"""Requests that no client should make, through the real services: the world stays whole and answers."""

import math
import time
import unittest
from collections import Counter

import genpy
import rospy
import rostest
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs import srv
from geometry_msgs.msg import Point, Pose
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from std_srvs.srv import Empty

BOUND = 20.0  # [s of wall time]
SPAN = 1.0  # [s] for each service; a busy host gets through fewer examples
OFTEN = 10  # refused requests, after which all of the world is looked at
MODELS = ["ground_plane", "cartpole", "box"]
LINKS = ["cartpole::stand", "cartpole::cart", "cartpole::pole", "box::body"]
JOINTS = ["stand_cart", "cart_pole"]
BOX = """<robot name="box"><link name="body"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""

NAMES = st.sampled_from(
    [
        *MODELS,
        *LINKS,
        *JOINTS,
        "body_collision",
        "grounding",
        "sun",
        "world",
        "map",
        "",
        "::",
        "a::b",
    ]
)
TEXTS = NAMES | st.text(max_size=8) | st.just("x" * 100_000)
SOUND = st.sampled_from([0.0, 1.0, 1e12, -1e12, 1e-9, 1e6]) | st.floats(-10.0, 10.0)
NUMBERS = (
    st.sampled_from([0.0, 1.0, -1.0, 0.001, math.nan, math.inf, -math.inf, 1e12, -1e12, 1e-12, 1e308,
                     5e-324, 1e6])
    | st.floats(-10.0, 10.0) | st.floats()
)  # fmt: skip
UNSIGNED = st.sampled_from([0, 1, 50, 2**32 - 1]) | st.integers(0, 2**32 - 1)
FRAMES = st.sampled_from(["", "world", *LINKS, "cartpole", "box"])
FITTING = {  # by the field's name: what a sound request has in it
    "model_name": st.sampled_from(["cartpole", "box"]),
    "link_name": st.sampled_from(LINKS),
    "body_name": st.sampled_from(LINKS),
    "joint_name": st.sampled_from(JOINTS),
    "light_name": st.just("sun"),
    "reference_frame": FRAMES,
    "relative_entity_name": FRAMES,
}
SIMPLE = {
    "string": TEXTS,
    "float64": NUMBERS,
    "float32": NUMBERS.filter(lambda n: not 3.4e38 < abs(n) < math.inf),
    "bool": st.booleans(),
    "uint32": UNSIGNED,
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint8": st.integers(0, 255),
    "time": st.builds(genpy.Time, UNSIGNED, st.integers(0, 10**9 - 1)),
    "duration": st.builds(genpy.Duration, st.integers(-10, 1000), st.integers(-(10**9), 10**9)),
}
KINDS = {"set_parameters": Reconfigure, "clear_joint_forces": srv.JointRequest,
         "clear_body_wrenches": srv.BodyRequest}  # fmt: skip
SERVICES = [
    "get_model_properties", "get_model_state", "get_joint_properties", "get_link_properties",
    "get_link_state", "get_light_properties", "set_light_properties", "delete_light",
    "set_link_properties", "set_model_state", "set_model_configuration", "set_joint_properties",
    "set_link_state", "apply_body_wrench", "apply_joint_effort", "clear_joint_forces",
    "clear_body_wrenches", "set_physics_properties", "set_parameters",
]  # fmt: skip


def values(kind, simple):
    """Draws values of that ROS type; `simple` has those of the types that are no message."""
    if kind.endswith("]"):
        return st.lists(values(kind.partition("[")[0], simple), max_size=4)
    if kind in simple:
        return simple[kind]
    return messages(genpy.message.get_message_class(kind), simple)


def messages(kind, simple):
    """Draws messages of that class, each field on its own; `simple` may have some by their names."""
    fields = zip(kind.__slots__, kind._slot_types, strict=True)
    drawn = {name: simple.get(name) or values(type_, simple) for name, type_ in fields}
    return st.builds(kind, **drawn)


def requests(kind):
    """Draws requests with a fault in them more likely than not, and requests that may be carried out."""
    sound = SIMPLE | {"string": NAMES, "float64": SOUND, "float32": SOUND}
    drawn = messages(kind, SIMPLE) | messages(kind, sound) | messages(kind, sound | FITTING)
    if (
        kind is srv.SetLinkPropertiesRequest
    ):  # a tensor drawn at random is hardly ever one of a body
        size = st.sampled_from([1.0, 1e-9, 1e12, 5.0])
        sizes = {"mass": size, "ixx": size, "iyy": size, "izz": size}
        near = st.floats(-1.0, 1.0)
        place = st.builds(Pose, position=st.builds(Point, near, near, near))
        drawn |= st.builds(
            kind, link_name=st.sampled_from(LINKS), com=place, gravity_mode=st.booleans(), **sizes
        )
    return drawn


def proxy(name):
    kind = KINDS.get(name) or getattr(srv, "".join(word.capitalize() for word in name.split("_")))
    rospy.wait_for_service(f"/gazebo/{name}", BOUND)
    return rospy.ServiceProxy(f"/gazebo/{name}", kind, persistent=True)


class FuzzTest(unittest.TestCase):
    def setUp(self):
        self.world = proxy("get_world_properties")
        self.link_state = proxy("get_link_state")
        self.joint = proxy("get_joint_properties")
        self.physics = proxy("get_physics_properties")
        self.reset = rospy.ServiceProxy("/gazebo/reset_simulation", Empty, persistent=True)
        spawn = rospy.ServiceProxy("/gazebo/spawn_urdf_model", srv.SpawnModel)
        spawn("cartpole", rospy.get_param("/robot_description"), "/", Pose(), "")
        spawn("box", BOX, "/", Pose(position=Point(2.0, 0.0, 1.0)), "")

    def check(self):
        """The world answers, holds what it held, and every state is a number."""
        self.assertEqual(self.world().model_names, MODELS)
        for name in LINKS:
            answer = self.link_state(name, "")
            self.assertTrue(answer.success, answer.status_message)
            pose, twist = answer.link_state.pose, answer.link_state.twist
            self.finite(pose.position, pose.orientation, twist.linear, twist.angular)
        for name in JOINTS:
            answer = self.joint(name)
            self.assertTrue(all(math.isfinite(n) for n in answer.position + answer.rate), answer)
        physics = self.physics()
        self.assertGreater(physics.time_step, 0.0)
        self.finite(physics.gravity)

    def finite(self, *messages):
        for message in messages:
            numbers = [getattr(message, name) for name in message.__slots__]
            self.assertTrue(all(math.isfinite(n) for n in numbers), message)

    def fuzz(self, name):
        service = proxy(name)
        deadline = time.monotonic() + SPAN

        @settings(max_examples=150, deadline=None, database=None, derandomize=True,
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(requests(service.request_class))
        def example(request):
            if time.monotonic() > deadline:
                return
            self.look_after(name, service(request))

        example()
        time.sleep(0.1)  # of the world's going on with what it was given
        self.check()

    def look_after(self, name, answer):
        """What was carried out may have changed anything; what was refused, hardly."""
        if getattr(answer, "success", True):
            self.done[name] += 1
            self.check()
            return
        self.assertTrue(answer.status_message)
        self.refused += 1
        if self.refused % OFTEN:
            self.assertEqual(self.world().model_names, MODELS)
        else:
            self.check()

    def test_every_service_one_after_the_other(self):
        """In one test: what one service has done to the world is there for the next one."""
        self.done, self.refused = Counter(), 0
        for name in SERVICES:
            with self.subTest(name):
                self.fuzz(name)
        self.reset()
        self.check()
        rospy.loginfo("requests carried out: %s", dict(self.done))
        self.assertGreater(
            len(+self.done), len(SERVICES) * 3 / 4, "hardly a request was a sound one"
        )


if __name__ == "__main__":
    rospy.init_node("fuzz_services_test", disable_rostime=True)
    rostest.rosrun("cartpole", "fuzz_services", FuzzTest)
