"""A user's code never returns, or keeps the world's lock: it is named, and Ctrl-C ends the node."""

import contextlib
import random
import signal

import pytest
from gazebo_msgs.srv import GetWorldProperties, SpawnModel
from geometry_msgs.msg import Pose
from support.ros.programs import Place, Process
from support.stress.places import BOUND, place, waits
from support.stress.scenario import Scenario

from ros_calls import master
from ros_calls.service import ServiceClient, ServiceFailed

MODEL = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<gazebo><plugin name="rude" filename="librude.so"/></gazebo></robot>"""
MODULE = """
import threading, time
import rospy
from gazebo_msgs.srv import GetWorldProperties

class Rude:
    def __init__(self, context):
        self.sim = context.sim
        context.on_update(self.enters)  # updates are called in this order
        if "{kind}" == "keep":
            threading.Thread(target=self.keep, name="keeper", daemon=True).start()
        else:
            context.on_update(self.{kind})
    def enters(self, now):
        open("{entered}", "w").close()
    def sleep(self, now):
        time.sleep(1e6)
    def wait_for_time(self, now):
        rospy.sleep(1.0)
    def ask(self, now):
        rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties)()
    def spin(self, now):
        while True:
            pass
    def keep(self):
        self.sim.lock.__enter__()
        self.enters(None)
        time.sleep(1e6)
    def shutdown(self):
        pass
"""
KINDS = {  # and what is told of them
    "sleep": "plugin librude.so of model 'box'",
    "wait_for_time": "plugin librude.so of model 'box'",
    "ask": "plugin librude.so of model 'box'",
    "spin": "plugin librude.so of model 'box'",
    "keep": "Rude.keep (",
}

ENDED_WITH_THE_NODE = ("wait_for_time", "ask")  # by rospy, mostly


def simulator(here: Place) -> Process:
    """A master and a simulator, which serves."""
    with master.using(here.environment["ROS_MASTER_URI"]):
        here.start("roscore", "-p", str(master.host_and_port()[1]))
        assert waits(master.is_up)
        node = here.start("rosrun", "gazebo_ros", "gzserver")

        def answers() -> bool:
            with contextlib.suppress(ServiceFailed):
                ask = ServiceClient("/gazebo/get_world_properties", GetWorldProperties, timeout=5.0)
                return bool(ask().success)
            return False

        assert waits(answers), node.output
    return node


@pytest.mark.stress
def test_code_that_never_returns(scenario: Scenario) -> None:
    """It is named in the log, once it has lasted for long and when the node is ended, with exit code 1."""

    def case(number: int, dice: random.Random) -> None:
        kind = dice.choice(sorted(KINDS))
        with place() as here:
            entered = here.folder / "entered"
            (here.folder / "rude.py").write_text(MODULE.format(kind=kind, entered=entered))
            here.environment["PYTHONPATH"] += f":{here.folder}"
            node = simulator(here)
            with master.using(here.environment["ROS_MASTER_URI"]):
                master.call("setParam", "/gazebo/plugins", {"librude.so": "rude:Rude"})
                spawn = ServiceClient("/gazebo/spawn_urdf_model", SpawnModel, timeout=5.0)
                with contextlib.suppress(ServiceFailed):  # the lock may be gone before the answer
                    spawn("box", MODEL, "", Pose(), "world")
            assert waits(entered.exists), node.output
            if number % 2:  # in the few cases of every run nobody waits for so long
                node.wait_for("Time stands still and services wait")
                assert KINDS[kind] in node.output, (kind, node.output)
            node.send(signal.SIGINT)
            code = node.end(BOUND)
            if kind in ENDED_WITH_THE_NODE and code == 0:
                return
            assert code == 1, (kind, node.output)
            end = node.output.partition("ends while the world's lock is kept by ")[2]
            assert end.startswith(KINDS[kind]), (kind, node.output)

    scenario.run("a plugin that never returns", 20, case)
