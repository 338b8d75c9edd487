"""The world that the tests of Gazebo's services start from, calls, and checks of answers."""

import unittest

import rosgraph
import rospy
from gazebo_msgs import srv
from gazebo_msgs.msg import ODEPhysics
from geometry_msgs.msg import Point, Pose, Vector3
from std_srvs.srv import Empty
from support.ros.calls import BOUND

from bullet_gazebo.clients.gz import RemoteWorld

NAN, INF = float("nan"), float("inf")
SCOPE = "did you forget to scope the link by model name?"
BOX = """<robot name="box"><link name="body"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""
OTHERS = {"spawn_urdf_model": srv.SpawnModel, "clear_joint_forces": srv.JointRequest,
          "clear_body_wrenches": srv.BodyRequest, "pause_physics": Empty, "unpause_physics": Empty,
          "reset_world": Empty, "reset_simulation": Empty}  # fmt: skip


def call(name, *args, kind=None, **kwargs):
    """Calls a service of Gazebo's; its type follows from its name where it isn't given."""
    rospy.wait_for_service(f"/gazebo/{name}", BOUND)
    title = "".join(word.capitalize() for word in name.split("_"))
    kind = kind or OTHERS.get(name) or getattr(srv, title)
    return rospy.ServiceProxy(f"/gazebo/{name}", kind)(*args, **kwargs)


def now():
    return call("get_world_properties").sim_time


def run(seconds):
    """Moves the paused world by `seconds` [s] of its time, one step at least; returns how long that was."""
    start, step = now(), call("get_physics_properties").time_step
    RemoteWorld("/gazebo", rosgraph.get_master_uri()).step(max(1, round(seconds / step)))
    return now() - start


def spawn(name, xml, position=(0.0, 0.0, 0.0), namespace="/"):
    answer = call("spawn_urdf_model", name, xml, namespace, Pose(position=Point(*position)), "")
    assert answer.success, answer.status_message


def ode(**changes):
    """ODE's defaults as Gazebo tells them, with some changed."""
    config = ODEPhysics(sor_pgs_iters=50, sor_pgs_w=1.3, erp=0.2, contact_surface_layer=0.001,
                        contact_max_correcting_vel=100.0, max_contacts=20)  # fmt: skip
    for key, value in changes.items():
        setattr(config, key, value)
    return config


def physics(**changes):
    """A request that sets the default physics, with some of it changed."""
    request = srv.SetPhysicsPropertiesRequest(0.001, 1000.0, Vector3(0, 0, -9.8), ode())
    for key, value in changes.items():
        setattr(request, key, value)
    return request


class GazeboTest(unittest.TestCase):
    """A paused world with the cart-pole and a box in the air, anew for each test."""

    def setUp(self):
        call("pause_physics")
        spawn("cartpole", rospy.get_param("/robot_description"))
        spawn("box", BOX, (3.0, 0.0, 20.0))

    def tearDown(self):
        call("pause_physics")
        for name in ("cartpole", "box"):
            call("delete_model", name)

    def fails(self, text, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertEqual((answer.success, answer.status_message), (False, text))
        return answer

    def succeeds(self, text, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertEqual((answer.status_message, answer.success), (text, True))
        return answer

    def refuses(self, pattern, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertFalse(answer.success)
        self.assertRegex(answer.status_message, pattern)

    def add(self, name, xml, position=(0.0, 0.0, 0.0), namespace="/"):
        """Spawns a model that goes when the test ends."""
        spawn(name, xml, position, namespace)
        self.addCleanup(call, "delete_model", name)

    def joint(self, name):
        found = call("get_joint_properties", name)
        return found.position[0], found.rate[0]

    def box(self, frame=""):
        return call("get_model_state", "box", frame)

    def close(self, pairs, places=6):
        for got, wanted in pairs:
            self.assertAlmostEqual(got, wanted, places=places)
