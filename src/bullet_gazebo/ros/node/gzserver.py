"""The node `gazebo`: what `rosrun gazebo_ros gzserver` runs."""

import argparse
import os
import shlex
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import rospy

from bullet_gazebo.heap import use_one_arena
from bullet_gazebo.physics.engine import Engine
from bullet_gazebo.physics.engines import BULLET, ENGINES, EngineError, make_engine
from bullet_gazebo.physics.world import World
from bullet_gazebo.pictures.recording import Recorder, RecordingError, RecordingOptions
from bullet_gazebo.ros.control.control_plugin import FILENAME as CONTROL_PLUGIN
from bullet_gazebo.ros.control.control_plugin import ControlPlugin
from bullet_gazebo.ros.node.joint_state_plugin import FILENAME as JOINT_STATE_PLUGIN
from bullet_gazebo.ros.node.joint_state_plugin import JointStatePlugin
from bullet_gazebo.ros.node.master_watch import MasterWatch
from bullet_gazebo.ros.node.one_world import (
    NameLoss,
    NameTaken,
    refuse_twin,
)
from bullet_gazebo.ros.node.server_args import parse_args
from bullet_gazebo.ros.node.state_topics import advertise_states
from bullet_gazebo.ros.node.watchdog import Watchdog
from bullet_gazebo.ros.node.world_control import WorldControl
from bullet_gazebo.ros.node.world_loader import fill_world, load_plugins, read_world
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.ros.scene.scene_offer import SceneOffer
from bullet_gazebo.ros.services.spawn_services import SpawnServices
from bullet_gazebo.ros.services.stepping.advance_service import AdvanceService
from bullet_gazebo.ros.services.stepping.friction_service import FrictionService
from bullet_gazebo.ros.services.stepping.step_service import StepService
from bullet_gazebo.ros.services.world_services import advertise_world_services
from bullet_gazebo.ros.wire.names import full_name, one_at_a_time
from bullet_gazebo.ros.wire.rospy_patches.connections import (
    Reception,
    bound_calls,
    bound_messages,
    hang_up_on_nonsense,
)
from bullet_gazebo.ros.wire.rospy_patches.registration import outlive_lack_of_threads
from bullet_gazebo.ros.wire.rospy_patches.topics import free_polls_at_once
from bullet_gazebo.ros.wire.seeding import seed_random_numbers
from bullet_gazebo.ros.wire.signals import SignalHandler, end_within, init_node, wait_for_master
from bullet_gazebo.ros.wire.thinning import Thinner
from bullet_gazebo.simulator import Simulator
from ros_calls import master

NAME = "gazebo"
MOST_FREQUENT = 1e9  # [Hz]; time is counted in nanoseconds
EXIT_TIMEOUT = 10.0  # [s] for what plugins may have left to be done at the end
HANGING_TIMEOUT = 1.0  # [s] the same where one of them never comes to its end
RECORDING_TIMEOUT = 5.0  # [s] for what is still to be handed over to it
MORE_ARGUMENTS = "GZSERVER_ARGS"  # variable: for a server that somebody else's program starts


class GazeboNode:
    """The simulator, the thread that moves it, and all that it offers to ROS."""

    def __init__(
        self, args: argparse.Namespace, engine: Engine, interrupted: Callable[[], bool]
    ) -> None:
        if not rospy.has_param("/use_sim_time"):
            rospy.set_param("/use_sim_time", True)
        world = World(engine)
        self.sim = Simulator(world, lockstep=args.lockstep, relatch=_flag("~relatch_on_reset"))
        self._watchdog = Watchdog(self.sim)
        recording = _recording(args)
        fill_world(self.sim, read_world(args.world, interrupted), interrupted)
        if args.paused:
            self.sim.pause()
        self._advertise(_flag("~enable_ros_network"))
        self._recorder = None if recording is None else Recorder(self.sim, recording)
        MasterWatch().start()

    def _advertise(self, network: bool) -> None:
        scene = SceneOffer(self.sim)
        WorldControl(self.sim, self._watchdog, scene.show if network else None).offer()
        free_polls_at_once()
        bound_messages()
        bound_calls()
        Reception.open()
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
        stepping: list[object] = []
        if self.sim.lockstep:
            one_at_a_time = threading.Lock()
            stepping = [
                StepService(self.sim, self._watchdog, one_at_a_time),
                AdvanceService(self.sim, self._watchdog, thinner, one_at_a_time),
                FrictionService(self.sim),
            ]
        self._services = [
            *stepping,
            SpawnServices(self.sim, plugins),
            *advertise_world_services(self.sim),
        ]

    def run(self, signals: SignalHandler) -> int:
        """Simulates until the node is shut down; returns the exit code."""
        # Called before the topics close, so that no tick publishes to a closed one.
        rospy.on_shutdown(self._watchdog.stop)
        if signals.noted():  # while all was made ready: no time passes any more
            self._watchdog.stop()
        else:
            self._watchdog.start()
        signals.wait(self._watchdog.barks)
        failed = self._watchdog.barks()
        self._watchdog.stop()  # a shutdown that came before the hook was there doesn't call it
        if self._recorder is not None:
            self._recorder.close(RECORDING_TIMEOUT)
        hanging = self._watchdog.left_hanging()
        if hanging is not None:
            print(f"gzserver: ends while the world's lock is kept by {hanging}", file=sys.stderr)
            end_within(HANGING_TIMEOUT, 1)
        return 1 if failed or hanging is not None else 0


def _recording(args: argparse.Namespace) -> RecordingOptions | None:
    """Returns what the command line says of a recording.

    Raises:
        RecordingError: if it can't be made.
    """
    if not args.video:
        return None
    width, height = args.video_size
    path = Path(args.video).absolute()
    options = RecordingOptions(path, args.video_rate, width, height, args.video_model)
    options.check()
    return options


def _flag(name: str) -> bool:
    """Returns a parameter that is true unless it says false; what is neither is a warning, as in Gazebo."""
    value = rospy.get_param(name, True)
    if isinstance(value, bool):
        return value
    rospy.logwarn("%s is %r, neither true nor false: true is used", name, value)
    return True


def _clock_frequency() -> float:
    """Returns ~pub_clock_frequency [Hz of simulated time]; 0 is every tick, and what can't be one too."""
    value = rospy.get_param("~pub_clock_frequency", 0)
    # A period of less than a nanosecond, or of more than a thousand years, is a mistake.
    if isinstance(value, (int, float)) and (
        value == 0 or 1.0 / MOST_FREQUENT <= value <= MOST_FREQUENT
    ):
        return float(value)
    rospy.logwarn("~pub_clock_frequency is %r, no frequency: /clock comes with every tick", value)
    return 0.0


def simulate(args: argparse.Namespace, engine: Engine, signals: SignalHandler) -> int:
    """Simulates until the end; returns the exit code."""
    try:
        return GazeboNode(args, engine, signals.noted).run(signals)
    except RecordingError as error:
        rospy.logfatal("%s", error)
        return 1
    except Exception:
        if rospy.is_shutdown():
            return 0  # ended before it was ready: topics and services can't be opened any more
        if master.is_up():
            raise
        text = f"the master at {master.uri()} went while the simulator started"
        print(f"gzserver: {text}", file=sys.stderr)
        return 1


def main(argv: list[str] | None = None) -> int:
    """Runs the node; returns its exit code."""
    use_one_arena()
    command_line = sys.argv if argv is None else argv
    more = shlex.split(os.environ.get(MORE_ARGUMENTS, ""))
    args = parse_args([*more, *rospy.myargv(command_line)[1:]])
    name = full_name(command_line, NAME)
    try:
        wait_for_master(NAME)
        with one_at_a_time(name):
            if not args.replace:
                refuse_twin(name)
            outlive_lack_of_threads()
            init_node(NAME, command_line, anonymous=False)
    except NameTaken as error:
        print(f"gzserver: {error}", file=sys.stderr)
        return 1
    loss = NameLoss()
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
    code = simulate(args, engine, signals)
    if loss.happened:
        print(f"gzserver: {loss.text(name)}", file=sys.stderr)
        code = code or 1
    end_within(EXIT_TIMEOUT, code)
    return code
