"""A master is killed and started again under a simulator; new clients find it."""

import contextlib
import os
import random
import signal

import pytest
from gazebo_msgs.srv import GetWorldProperties
from support.stress.places import BOUND, pid_of, place, waits
from support.stress.scenario import Scenario

from ros_calls import master
from ros_calls.service import ServiceClient, ServiceFailed

SERVICE = "/gazebo/get_world_properties"
LAST = "/gazebo/pause_physics"  # clients take the world for ready once it is there


@pytest.mark.stress(full=True)
def test_a_master_that_is_killed_and_started_again(scenario: Scenario) -> None:
    """It is told, and topics, services and the use of simulated time are there again."""

    def case(number: int, dice: random.Random) -> None:
        with place() as here, master.using(here.environment["ROS_MASTER_URI"]):
            start = ("roscore", "-p", str(master.host_and_port()[1]))

            def answers() -> bool:
                with contextlib.suppress(ServiceFailed):
                    return bool(ServiceClient(SERVICE, GetWorldProperties, timeout=5.0)())
                return False

            def known() -> list[list[str]]:
                """Publishers, subscribers and services of the simulator."""
                kinds = master.call("getSystemState")
                return [
                    sorted(name for name, nodes in kind if "/gazebo" in nodes) for kind in kinds
                ]

            core = here.start(*start)
            assert waits(master.is_up)
            node = here.start("rosrun", "gazebo_ros", "gzserver")
            assert waits(lambda: LAST in known()[2]), node.output
            before = known()
            os.kill(core.pid, signal.SIGKILL)
            os.kill(pid_of(here, "/rosmaster "), signal.SIGKILL)
            if number % 2:  # else it may be back before anybody asks
                node.wait_for("is gone", BOUND)
            core = here.start(*start)
            assert waits(answers), node.output
            assert waits(lambda: known() == before), (before, known())
            assert master.call("getParam", "/use_sim_time") is True
            node.wait_for("was started again", BOUND)
            assert node.output.count("was started again") == 1 and "Traceback" not in node.output
            node.send(signal.SIGINT)
            assert node.end(BOUND) == 0, node.output
            core.send(signal.SIGINT)
            core.end(BOUND)

    scenario.run("a master that is killed and started again", 10, case)
