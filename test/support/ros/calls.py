"""Service calls and waits with a bound, for the nodes of rostests."""

import functools
import threading

import roslib.packages
import rospy
from gazebo_msgs.srv import DeleteModel, GetWorldProperties, SpawnModel, SpawnModelRequest

BOUND = 60.0  # [s of wall time]


def call(name, kind, /, *args, **kwargs):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*args, **kwargs)


def wait_until(condition, bound=BOUND):
    """Wait until `condition` returns something true; return its last answer."""
    found, pause = condition(), threading.Event()
    for _ in range(int(bound / 0.01)):
        if found:
            break
        pause.wait(0.01)
        found = condition()
    return found


def spawn_model(name, xml, robot_namespace="/", y=0.0):
    """Spawn a model at `y` [m]."""
    request = SpawnModelRequest(model_name=name, model_xml=xml, robot_namespace=robot_namespace)
    request.initial_pose.position.y = y
    return call("/gazebo/spawn_urdf_model", SpawnModel, request)


def delete_model(name="cartpole"):
    return call("/gazebo/delete_model", DeleteModel, name)


def sim_time():
    return call("/gazebo/get_world_properties", GetWorldProperties).sim_time


@functools.cache
def executable(package, name):
    """What `rosrun package name` runs; rosrun itself takes a second to look it up."""
    path, *_ = roslib.packages.find_node(package, name)
    return path
