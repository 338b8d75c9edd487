"""The world that the tests of Gazebo's services start from, and checks of answers."""

import rosgraph
import rospy
from gazebo_msgs import srv
from gazebo_msgs.msg import ODEPhysics
from geometry_msgs.msg import Vector3
from support.ros.calls import gazebo, sim_time
from support.ros.world_case import WorldCase

from bullet_gazebo.clients.gz import RemoteWorld

NAN, INF = float("nan"), float("inf")
SCOPE = "did you forget to scope the link by model name?"
BOX = """<robot name="box"><link name="body"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""


def run(seconds):
    """Moves the paused world by `seconds` [s] of its time, one step at least; returns how long that was."""
    start, step = sim_time(), gazebo("get_physics_properties").time_step
    RemoteWorld("/gazebo", rosgraph.get_master_uri()).step(max(1, round(seconds / step)))
    return sim_time() - start


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


class GazeboTest(WorldCase):
    """A paused world with the cart-pole and a box in the air, anew for each test."""

    def setUp(self):
        gazebo("pause_physics")
        self.spawn("cartpole", rospy.get_param("/robot_description"))
        self.spawn("box", BOX, x=3.0, z=20.0)

    def fails(self, text, name, *args, **kwargs):
        answer = gazebo(name, *args, **kwargs)
        self.assertEqual((answer.success, answer.status_message), (False, text))
        return answer

    def succeeds(self, text, name, *args, **kwargs):
        answer = gazebo(name, *args, **kwargs)
        self.assertEqual((answer.status_message, answer.success), (text, True))
        return answer

    def refuses(self, pattern, name, *args, **kwargs):
        answer = gazebo(name, *args, **kwargs)
        self.assertFalse(answer.success)
        self.assertRegex(answer.status_message, pattern)

    def box(self, frame=""):
        return gazebo("get_model_state", "box", frame)

    def close(self, pairs, places=6):
        for got, wanted in pairs:
            self.assertAlmostEqual(got, wanted, places=places)
