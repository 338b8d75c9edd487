#!/usr/bin/env python3
"""The real-time factor: unlimited, and at 1 with the share of a core that it takes.

    ./ws python3 benchmark/realtime.py [--out FOLDER] [--seconds 60]

The cart-pole with its two controllers, a process that hears /joint_states and one that hears /clock. Prints
a table and writes realtime.json. It starts a simulator on a master of its own.
"""

import contextlib
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Iterator, Mapping
from typing import Any

import psutil
import reporting
import rosgraph
from cartpole_world import add_cartpole

from ros_utils import ros_gazebo
from ros_utils.simulation import Simulation

LISTENER = (
    "import sys, rospy, roslib.message; rospy.init_node('listener', anonymous=True, disable_rosout=True,"
    " disable_rostime=True); topic, kind = sys.argv[1:]; kind = roslib.message.get_message_class(kind);"
    " rospy.Subscriber(topic, kind, lambda m: None, tcp_nodelay=True);"
    " rospy.wait_for_message(topic, kind); print('heard', flush=True); rospy.spin()"
)
TOPICS = {"/joint_states": "sensor_msgs/JointState", "/clock": "rosgraph_msgs/Clock"}
TARGETS = {"unlimited": ">= 40", "limited": "1 +- 0.002", "share of a core": "< 0.25"}


@contextlib.contextmanager
def listening(simulation: Simulation, topics: Mapping[str, str] = TOPICS) -> Iterator[None]:
    """Processes that hear the topics, which are given with their types."""
    listeners = [
        subprocess.Popen(
            [sys.executable, "-c", LISTENER, *topic],
            env=simulation.environment(), stdout=subprocess.PIPE,
        )
        for topic in topics.items()
    ]  # fmt: skip
    try:
        for listener in listeners:
            assert listener.stdout is not None
            listener.stdout.readline()  # it hears the topic now, or has ended
        yield
    finally:
        for listener in listeners:
            listener.terminate()
            listener.communicate()


def simulator_process(simulation: Simulation) -> int:
    uri = rosgraph.Master("/realtime", simulation.master_uri).lookupNode("/gazebo")
    answer: Any = xmlrpc.client.ServerProxy(uri).getPid("/realtime")
    return int(answer[2])


def processor_time(process: int) -> float:
    """Processor time [s] that a process and those it has started, as the one of pictures, have had."""
    simulator = psutil.Process(process)
    times = [each.cpu_times() for each in (simulator, *simulator.children())]
    return sum(each.user + each.system for each in times)


def factor(seconds: float, process: int) -> tuple[float, float]:
    """Simulated over wall time, and the process's share of a core, over so many seconds."""
    begin, start = time.perf_counter(), ros_gazebo.gazebo_get_world_properties()[1]
    used = processor_time(process)
    time.sleep(seconds)
    end = ros_gazebo.gazebo_get_world_properties()[1]
    wall = time.perf_counter() - begin
    return (end - start) / wall, (processor_time(process) - used) / wall


def measure(seconds: float) -> dict[str, float]:
    with Simulation() as simulation, simulation.active():
        add_cartpole()
        process = simulator_process(simulation)
        with listening(simulation):
            limited, share = factor(seconds, process)
            ros_gazebo.gazebo_set_max_update_rate(0.0)
            unlimited, _ = factor(min(seconds, 10.0), process)
    return {"unlimited": unlimited, "limited": limited, "share of a core": share}


def main() -> None:
    options = reporting.options(__doc__ or "", seconds=60)
    results = measure(options.seconds)
    print(f"{'real-time factor':20} {'':>8} {'target':>12}")
    for name, value in results.items():
        print(f"{name:20} {value:8.4f} {TARGETS[name]:>12}")
    reporting.write(options.out, "realtime", results)


if __name__ == "__main__":
    main()
