#!/usr/bin/env python3
"""How fast the interface is: median and 99th percentile of what a client waits for.

    ./ws python3 benchmark/interface.py [--out FOLDER] [--launches 3] [--calls 2000]

Runs simulators on masters of its own, prints a table and writes interface.json.
"""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import reporting
import rospy
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import DeleteModel, GetWorldProperties, SetModelConfiguration, SetModelState, SpawnModel
from geometry_msgs.msg import Pose
from std_srvs.srv import Empty

from ros_utils import ros_gazebo, ros_urdf
from ros_utils.simulation import Simulation

LISTENER = (
    "import rospy; from rosgraph_msgs.msg import Clock; rospy.init_node('l', anonymous=True,"
    " disable_rosout=True, disable_rostime=True); rospy.Subscriber('/clock', Clock, lambda m: None,"
    " tcp_nodelay=True); rospy.wait_for_message('/clock', Clock); print('heard', flush=True);"
    " rospy.spin()"
)
TARGETS = {  # [ms] for median and 99th percentile, None for no target; a factor for the last one
    "launch to a stepping world": (3500.0, None),
    "spawn to answered": (50.0, None),
    "a goal is spawned, plain call": (5.0, None),
    "a goal is moved, plain call": (5.0, None),
    "a goal is deleted, plain call": (5.0, None),
    "persistent call": (0.15, None),
    "plain call": (1.5, None),
    "reset_world + set_model_configuration, persistent": (1.0, 3.0),
    "real-time factor with 5 subscribers of /clock": (1.0, None),
}
GOAL = """<sdf version="1.6"><model name="goal"><static>true</static><link name="link"><visual name="flag">
<geometry><box><size>0.4 0.4 0.01</size></box></geometry></visual></link></model></sdf>"""
JOINTS = (["stand_cart", "cart_pole"], [0.0, 0.05])
FACTOR_TIME = 10.0  # [s]


def times(action: Callable[[], object], count: int) -> list[float]:
    """Durations of so many calls [ms]."""
    taken = []
    for _ in range(count):
        begin = time.perf_counter()
        action()
        taken.append(1000.0 * (time.perf_counter() - begin))
    return taken


def launch() -> float:
    """Start and end a simulator; the time until its clock has moved [ms]."""
    begin = time.perf_counter()
    with Simulation() as simulation, simulation.active():
        while ros_gazebo.gazebo_get_world_properties()[1] <= 0.0:
            time.sleep(0.005)
        return 1000.0 * (time.perf_counter() - begin)


def spawns(count: int) -> list[float]:
    xml = ros_urdf.urdf_parse_from_pkg("cartpole_gazebo", "cartpole_v1.urdf", "/robots") or ""
    taken = []
    for _ in range(count):
        taken += times(lambda: ros_gazebo.gazebo_spawn_urdf_string(xml, "cartpole"), 1)
        ros_gazebo.gazebo_delete_model("cartpole")
    ros_gazebo.gazebo_spawn_urdf_string(xml, "cartpole")
    return taken


def goals(count: int) -> dict[str, list[float]]:
    """What a script waits for whose goal comes and goes with each episode."""
    ways: dict[str, Callable[[], object]] = {
        "spawned": lambda: spawn("goal", GOAL, "", Pose(), "world"),
        "moved": lambda: move(ModelState(model_name="goal")),
        "deleted": lambda: delete("goal"),
    }
    spawn = rospy.ServiceProxy("/gazebo/spawn_sdf_model", SpawnModel)
    move = rospy.ServiceProxy("/gazebo/set_model_state", SetModelState)
    delete = rospy.ServiceProxy("/gazebo/delete_model", DeleteModel)
    taken: dict[str, list[float]] = {f"a goal is {name}, plain call": [] for name in ways}
    for _ in range(count):
        for values, way in zip(taken.values(), ways.values(), strict=True):
            values.extend(times(way, 1))
    return taken


def calls(count: int) -> dict[str, list[float]]:
    persistent = rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties, True)
    plain = rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties)
    reset = rospy.ServiceProxy("/gazebo/reset_world", Empty, True)
    place = rospy.ServiceProxy("/gazebo/set_model_configuration", SetModelConfiguration, True)

    def begin_episode() -> None:
        reset()
        place("cartpole", "robot_description", *JOINTS)

    begin_episode()
    return {
        "persistent call": times(persistent, count),
        "plain call": times(plain, count // 4),
        "reset_world + set_model_configuration, persistent": times(begin_episode, count),
    }


def factor(simulation: Simulation) -> list[float]:
    """Simulated over wall time while five processes hear every /clock."""
    listeners = [
        subprocess.Popen(
            [sys.executable, "-c", LISTENER], env=simulation.environment(), stdout=subprocess.PIPE
        )
        for _ in range(5)
    ]
    try:
        for listener in listeners:
            assert listener.stdout is not None
            listener.stdout.readline()  # it hears the clock now, or has ended
        begin, start = time.perf_counter(), ros_gazebo.gazebo_get_world_properties()[1]
        time.sleep(FACTOR_TIME)
        end = ros_gazebo.gazebo_get_world_properties()[1]
        return [(end - start) / (time.perf_counter() - begin)]
    finally:
        for listener in listeners:
            listener.terminate()
            listener.communicate()


def measure(launches: int, count: int) -> dict[str, list[float]]:
    results = {"launch to a stepping world": [launch() for _ in range(launches)]}
    with Simulation() as simulation, simulation.active():
        os.environ.update(simulation.environment())  # rospy's own proxies go there too
        rospy.init_node("interface_benchmark", disable_rostime=True)
        results["spawn to answered"] = spawns(20)
        results |= goals(count // 20)
        results |= calls(count)
        results["real-time factor with 5 subscribers of /clock"] = factor(simulation)
    return results


def summary(values: list[float]) -> dict[str, float]:
    ordered = sorted(values)
    return {
        "median": statistics.median(ordered),
        "p99": ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))],
        "count": len(ordered),
    }


def main() -> None:
    options = reporting.options(__doc__ or "", launches=3, calls=2000)
    results = {name: summary(values) for name, values in measure(options.launches, options.calls).items()}
    print(f"{'[ms], the last one a factor':52}{'median':>10}{'p99':>10}{'target':>16}")
    for name, values in results.items():
        target = " / ".join(f"{each:g}" for each in TARGETS[name] if each is not None)
        print(f"{name:52}{values['median']:10.3f}{values['p99']:10.3f}{target:>16}")
    reporting.write(options.out, "interface", {"unit": "ms", **results})


if __name__ == "__main__":
    main()
