"""The node `gazebo`: what `rosrun gazebo_ros gzserver` runs."""

import argparse
import os
import threading
import traceback

import rospy

from bullet_gazebo.physics.bullet import BulletEngine
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World, ground_plane
from bullet_gazebo.ros.control_plugin import FILENAME as CONTROL_PLUGIN
from bullet_gazebo.ros.control_plugin import ControlPlugin
from bullet_gazebo.ros.joint_services import JointServices
from bullet_gazebo.ros.model_services import ModelServices
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.ros.spawn_services import SpawnServices
from bullet_gazebo.ros.state_topics import advertise_states
from bullet_gazebo.ros.step_service import StepService
from bullet_gazebo.ros.time_services import advertise_time_services
from bullet_gazebo.simulator import Simulator

EMPTY_WORLD = "empty.world"
ENGINES = ("ode", "bullet", "simbody", "dart")
STOP_TIMEOUT = 5.0  # [s]


def parse_args(argv: list[str]) -> argparse.Namespace:
    """Reads gzserver's command line (contract: gazebo_api.md section 4.2). What is inert is accepted."""
    parser = argparse.ArgumentParser(
        prog="gzserver", description="A PyBullet stand-in for Gazebo's server."
    )
    parser.add_argument("world", nargs="?", default=EMPTY_WORLD, help="world file")
    parser.add_argument("-u", dest="paused", action="store_true", help="start paused")
    parser.add_argument(
        "-e", "--physics", default="ode", help="accepted; physics is always PyBullet"
    )
    parser.add_argument("--lockstep", action="store_true", help="time moves only by ~step_world")
    parser.add_argument("--seed", type=int, help="accepted; the physics uses no random numbers")
    parser.add_argument("-r", dest="record", action="store_true", help="accepted, without effect")
    parser.add_argument("--verbose", action="store_true", help="accepted, without effect")
    parser.add_argument("-s", "--server-plugin", action="append", help="accepted, without effect")
    args, ignored = parser.parse_known_args(argv)
    args.ignored = ignored
    return args


class GazeboNode:
    """The simulator, its thread, and all that it offers to ROS."""

    def __init__(self, args: argparse.Namespace) -> None:
        if not rospy.has_param("/use_sim_time"):
            rospy.set_param("/use_sim_time", True)
        world = World(BulletEngine())
        world.spawn("ground_plane", ground_plane(), Pose())
        relatch = rospy.get_param("~relatch_on_reset", True)
        self.sim = Simulator(world, lockstep=args.lockstep, relatch=bool(relatch))
        if args.paused:
            self.sim.pause()
        self._advertise(bool(rospy.get_param("~enable_ros_network", True)))
        self._thread = threading.Thread(target=self._simulate, name="simulation")
        self._fault = False

    def _advertise(self, network: bool) -> None:
        advertise_states(self.sim, float(rospy.get_param("~pub_clock_frequency", 0)), network)
        if not network:
            return
        plugins = PluginRegistry(self.sim, {CONTROL_PLUGIN: ControlPlugin})
        self._services = [
            SpawnServices(self.sim, plugins),
            ModelServices(self.sim),
            JointServices(self.sim),
            *advertise_time_services(self.sim),
        ]
        if self.sim.lockstep:
            self._services.append(StepService(self.sim))

    def run(self) -> int:
        """Simulates until the node is shut down; returns the exit code."""
        rospy.on_shutdown(
            self._stop
        )  # called before the topics close, so no tick publishes to a closed one
        self._thread.start()
        rospy.spin()
        return 1 if self._fault else 0

    def _simulate(self) -> None:
        """A world whose time silently stands still is worse than one that ends: a fault ends the node."""
        try:
            self.sim.run()
        except Exception:  # noqa: BLE001 - the end of a thread
            self._fault = True
            rospy.logfatal("The simulation failed:\n%s", traceback.format_exc())
            rospy.signal_shutdown("the simulation failed")

    def _stop(self) -> None:
        self.sim.stop()
        if threading.current_thread() is not self._thread:
            self._thread.join(STOP_TIMEOUT)


def main(argv: list[str] | None = None) -> int:
    """Runs the node; returns its exit code."""
    args = parse_args(rospy.myargv(argv)[1:])
    rospy.init_node("gazebo")
    if os.path.basename(args.world) != EMPTY_WORLD:
        rospy.logwarn("World files are not read yet: %s is taken as a ground plane", args.world)
    if args.physics not in ENGINES:
        rospy.logwarn("Physics engine '%s' is not known; PyBullet is used", args.physics)
    if args.ignored:
        rospy.logwarn("Arguments without effect here: %s", " ".join(args.ignored))
    return GazeboNode(args).run()
