"""The node `gazebo`: what `rosrun gazebo_ros gzserver` runs."""

import argparse
import sys
import threading
import traceback
from collections.abc import Callable
from functools import partial

import rospy

from bullet_gazebo.heap import use_one_arena
from bullet_gazebo.physics.engine import Engine
from bullet_gazebo.physics.engines.registry import BULLET, ENGINES, EngineError, make_engine
from bullet_gazebo.physics.world import World
from bullet_gazebo.ros.control.control_plugin import FILENAME as CONTROL_PLUGIN
from bullet_gazebo.ros.control.control_plugin import ControlPlugin
from bullet_gazebo.ros.node.joint_state_plugin import FILENAME as JOINT_STATE_PLUGIN
from bullet_gazebo.ros.node.joint_state_plugin import JointStatePlugin
from bullet_gazebo.ros.node.server_args import parse_args
from bullet_gazebo.ros.node.state_topics import advertise_states
from bullet_gazebo.ros.node.world_control import WorldControl
from bullet_gazebo.ros.node.world_loader import fill_world, load_plugins, read_world
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.ros.services.spawn_services import SpawnServices
from bullet_gazebo.ros.services.step_service import StepService
from bullet_gazebo.ros.services.world_services import advertise_world_services
from bullet_gazebo.ros.wire.rospy_patches import greet_clients_apart, hang_up_on_nonsense
from bullet_gazebo.ros.wire.seeding import seed_random_numbers
from bullet_gazebo.ros.wire.signals import SignalHandler, init_node
from bullet_gazebo.ros.wire.thinning import Thinner
from bullet_gazebo.simulator import Simulator

STOP_TIMEOUT = 5.0  # [s]


class GazeboNode:
    """The simulator, its thread, and all that it offers to ROS."""

    def __init__(
        self, args: argparse.Namespace, engine: Engine, interrupted: Callable[[], bool]
    ) -> None:
        if not rospy.has_param("/use_sim_time"):
            rospy.set_param("/use_sim_time", True)
        world = World(engine)
        relatch = rospy.get_param("~relatch_on_reset", True)
        self.sim = Simulator(world, lockstep=args.lockstep, relatch=bool(relatch))
        fill_world(self.sim, read_world(args.world, interrupted), interrupted)
        if args.paused:
            self.sim.pause()
        self._advertise(bool(rospy.get_param("~enable_ros_network", True)))
        self._thread = threading.Thread(target=self._simulate, name="simulation")
        self._fault = False

    def _advertise(self, network: bool) -> None:
        WorldControl(self.sim).offer()
        greet_clients_apart()
        hang_up_on_nonsense()
        thinner = Thinner(self.sim)
        advertise_states(self.sim, thinner, _clock_frequency(), network)
        plugins = PluginRegistry(
            self.sim,
            {
                CONTROL_PLUGIN: partial(ControlPlugin, thinner),
                JOINT_STATE_PLUGIN: JointStatePlugin,
            },
        )
        load_plugins(self.sim, plugins)
        if not network:
            return
        # Clients take the world for ready once it can be paused, so the step service comes first.
        stepping = [StepService(self.sim)] if self.sim.lockstep else []
        self._services = [
            *stepping,
            SpawnServices(self.sim, plugins),
            *advertise_world_services(self.sim),
        ]

    def run(self, signals: SignalHandler) -> int:
        """Simulates until the node is shut down; returns the exit code."""
        # Called before the topics close, so that no tick publishes to a closed one.
        rospy.on_shutdown(self._stop)
        self._thread.start()
        signals.wait()
        self._stop()  # a shutdown that came before the hook was there doesn't call it
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


def _clock_frequency() -> float:
    """Returns ~pub_clock_frequency [Hz of simulated time]; 0 is every tick, and what is no number too."""
    value = rospy.get_param("~pub_clock_frequency", 0)
    if isinstance(value, (int, float)):
        return float(value)
    rospy.logwarn("~pub_clock_frequency is %r, not a number: /clock comes with every tick", value)
    return 0.0


def main(argv: list[str] | None = None) -> int:
    """Runs the node; returns its exit code."""
    use_one_arena()
    args = parse_args(rospy.myargv(argv)[1:])
    init_node("gazebo", sys.argv if argv is None else argv, anonymous=False)
    # Not before: while there is no master, a signal ends the process as such.
    signals = SignalHandler()
    if args.physics not in ENGINES:
        rospy.logwarn("Physics engine '%s' is not known; PyBullet is used", args.physics)
    if args.ignored:
        rospy.logwarn("Arguments without effect here: %s", " ".join(args.ignored))
    seed_random_numbers(args.seed)
    try:
        engine = make_engine(args.physics if args.physics in ENGINES else BULLET[0])
    except EngineError as error:
        rospy.logfatal("%s", error)
        return 1
    return GazeboNode(args, engine, signals.noted).run(signals)
