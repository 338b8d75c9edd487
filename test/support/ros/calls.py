"""Service calls and waits with a bound, for the nodes of rostests."""

import functools
import threading
import xmlrpc.client

import bullet_gazebo_msgs.srv
import gazebo_msgs.srv
import rosgraph
import roslib.packages
import rospy
from geometry_msgs.msg import Point, Pose
from std_srvs.srv import Empty

BOUND = 60.0  # [s of wall time]
KINDS = dict.fromkeys(["pause_physics", "unpause_physics", "reset_world", "reset_simulation"], Empty) | {
    "spawn_urdf_model": gazebo_msgs.srv.SpawnModel,
    "spawn_sdf_model": gazebo_msgs.srv.SpawnModel,
    "clear_joint_forces": gazebo_msgs.srv.JointRequest,
    "clear_body_wrenches": gazebo_msgs.srv.BodyRequest,
}


def call(name, kind, /, *args, **kwargs):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*args, **kwargs)


def service_type(name):
    """The type of a service of /gazebo; but for a few it is called like the service."""
    title = "".join(word.capitalize() for word in name.split("_"))
    kind = KINDS.get(name) or getattr(gazebo_msgs.srv, title, None)
    return kind or getattr(bullet_gazebo_msgs.srv, title)


def gazebo(name, /, *args, **kwargs):
    """Calls a service of /gazebo."""
    return call(f"/gazebo/{name}", service_type(name), *args, **kwargs)


def wait_until(condition, bound=BOUND):
    """Wait until `condition` returns something true; return its last answer."""
    found, pause = condition(), threading.Event()
    for _ in range(int(bound / 0.01)):
        if found:
            break
        pause.wait(0.01)
        found = condition()
    return found


def spawn_model(name, xml, namespace="/", x=0.0, y=0.0, z=0.0, kind="urdf", frame=""):
    """Spawns a model at a place [m]."""
    pose = Pose(position=Point(x, y, z))
    return gazebo(f"spawn_{kind}_model", name, xml, namespace, pose, frame)


def delete_model(name="cartpole"):
    return gazebo("delete_model", name)


def model_names():
    return gazebo("get_world_properties").model_names


def position(name, frame=""):
    """Where a model is [m]."""
    found = gazebo("get_model_state", name, frame)
    assert found.success, found.status_message
    return found.pose.position


def joint(name):
    """Position and rate."""
    found = gazebo("get_joint_properties", name)
    return found.position[0], found.rate[0]


def sim_time():
    return gazebo("get_world_properties").sim_time


def time_passes():
    before = sim_time()
    return wait_until(lambda: sim_time() > before)


def step_world(ticks, **fields):
    """Lets time pass in a world in lock-step; fields are those of the request."""
    answer = gazebo("step_world", ticks=ticks, **fields)
    assert answer.success, answer.status_message
    return answer


def process_of(node="/gazebo", master_uri=None):
    """The process id of a node; None if there is none."""
    try:
        address = rosgraph.Master("/test", master_uri).lookupNode(node)
        with xmlrpc.client.ServerProxy(address) as proxy:
            return int(proxy.getPid("/test")[2])
    except (rosgraph.MasterException, OSError):
        return None


@functools.cache
def executable(package, name):
    """What `rosrun package name` runs; rosrun itself takes a second to look it up."""
    path, *_ = roslib.packages.find_node(package, name)
    return path
