"""The node `gazebo`: the command `gzserver`, and `gazebo`, which also opens the window."""

import argparse
import contextlib
import os
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import rospy
from bullet_gazebo_msgs.msg import SceneSensor

from bullet_gazebo.clients.gz import METHOD
from bullet_gazebo.common.node_process import (
    SignalHandler,
    end_within,
    full_name,
    init_node,
    one_at_a_time,
    seed_random_numbers,
    wait_for_master,
)
from bullet_gazebo.common.publishing import Thinner, advertise_states
from bullet_gazebo.common.rospy_connections import Reception, bound_messages, hang_up_on_nonsense
from bullet_gazebo.common.rospy_internals import answer_xmlrpc, free_polls_at_once, registered_together
from bullet_gazebo.journal.interception import record_messages, record_parameters, record_services
from bullet_gazebo.journal.journal import WorldJournal
from bullet_gazebo.journal.journal_output import JournalOutput
from bullet_gazebo.node.node_name import NameLoss, NodeNameTaken, refuse_twin
from bullet_gazebo.node.start import facts_of
from bullet_gazebo.node.watchdog import Watchdog
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from bullet_gazebo.scene import SceneServer
from bullet_gazebo.services.advance_service import AdvanceService
from bullet_gazebo.services.snapshot_services import SnapshotServices
from bullet_gazebo.services.spawn_services import SpawnServices, fill_world, load_plugins, read_world
from bullet_gazebo.services.step_service import StepService
from bullet_gazebo.services.world_services import WorldControl, advertise_world_services
from robot_sim.heap import use_one_arena
from robot_sim.physics.description import Plugin
from robot_sim.physics.engine import Engine
from robot_sim.physics.engines import BULLET, ENGINES, EngineError, make_engine
from robot_sim.physics.world import World
from robot_sim.pictures.recording import RecordingError, RecordingOptions, SimulationRecorder
from robot_sim.sensors.picture_process import PictureProcess
from robot_sim.sensors.renderers import RENDERERS
from robot_sim.sensors.rendering import RAYS, RendererError
from robot_sim.simulator import Simulator
from ros_calls import master
from ros_calls.absence import SPAWNS
from ros_calls.service import WORK

NAME = "gazebo"
EMPTY_WORLD = "empty.world"
# Gazebo's options without effect here: those that stand alone, and those that a value follows.
INERT = ("-r --record", "-q --quiet", "--verbose", "--minimal_comms", "--record_resources")
INERT_WITH_VALUE = (
    "-s --server-plugin", "-g --gui-plugin", "-i --iters", "-p --play", "--record_path",
    "--record_encoding", "--record_period", "--record_filter",
)  # fmt: skip
MORE_ARGUMENTS = "GZSERVER_ARGS"  # environment variable, for a server that another program starts
MOST_FREQUENT = 1e9  # [Hz]; time is counted in nanoseconds
EXIT_TIMEOUT = 10.0  # [s] for what plugins have left to do at the end
HANGING_TIMEOUT = 1.0  # [s] the same if one of them hangs
RECORDING_TIMEOUT = 5.0  # [s] to hand over the last frames
WINDOW = "import sys; from bullet_gazebo.clients.gzclient import main; sys.exit(main())"
WINDOW_NAME = "gazebo_gui"
WINDOW_TIMEOUT = 5.0  # [s] for the window to close
INTERRUPTED = 130


def parse_args(argv: Sequence[str]) -> argparse.Namespace:
    """Reads gzserver's options, in any order (docs/contract/gazebo_launch.md 4.2); ignores ROS's a:=b.

    They are world, paused, physics, lockstep, replace, seed, the video options, and `ignored`, the unknown.
    """
    parser = argparse.ArgumentParser(
        prog="gzserver",
        description="Simulate a world, as Gazebo's server does.",
        usage="gzserver [options] [WORLD_FILE]",
        allow_abbrev=False,
    )
    # The world is taken from the rest: it may be anywhere, also behind an unknown option.
    option = parser.add_argument
    option("-u", dest="paused", action="store_true", help="start paused")
    option("-e", "--physics", default="ode", help="mujoco; all of Gazebo's names mean PyBullet")
    option("-o", "--profile", nargs="?", help="accepted, without effect")
    option("--lockstep", action="store_true", help="time moves only by ~step_world")
    option("--journal", default="", help="in lock-step: record the run in this bag, for replay.py")
    option("--replace", action="store_true", help="end a running simulator that has this name")
    option(
        "--video", action="append", default=[], metavar="FILE",
        help="record the simulation: .mp4 a video, .png the last moment; repeatable",
    )  # fmt: skip
    option("--video-rate", type=float, default=30.0, help="frames per second of simulated time")
    option("--video-size", type=int, nargs=2, default=(640, 480), help="width, height [pixels]")
    option("--video-model", default="", help="keep this model in the middle; default: all movable")
    option("--seed", type=int, help="seed of Python's and NumPy's random numbers")
    option(
        "--camera-scale", type=_scale, default=1.0, metavar="SCALE",
        help="size of cameras' pictures, beside the one in the robot's file: 0.25 is a quarter of the width",
    )  # fmt: skip
    option(
        "--renderer", choices=RENDERERS, default=RAYS,
        help="of cameras' pictures: rays, equal bits on all machines; gl, by OpenGL; auto, gl on a GPU",
    )  # fmt: skip
    for names in INERT:
        option(*names.split(), action="store_true", help="accepted, without effect")
    for names in INERT_WITH_VALUE:
        option(*names.split(), nargs=1, help="accepted, without effect")
    args, left = parser.parse_known_args([argument for argument in argv if ":=" not in argument])
    worlds = [argument for argument in left if not argument.startswith("-")]
    if not worlds and args.profile and args.profile.endswith(".world"):
        worlds = [args.profile]  # -o is often given without a value
    args.world = worlds[-1] if worlds else EMPTY_WORLD
    args.ignored = [argument for argument in left if argument != args.world]
    return args


def _scale(text: str) -> float:
    scale = float(text)
    if not 0.0 < scale <= 1.0:
        raise ValueError
    return scale


class GazeboNode:
    """The simulator, the thread that moves it, and everything that it offers to ROS."""

    def __init__(self, args: argparse.Namespace, engine: Engine, interrupted: Callable[[], bool]) -> None:
        self.sim = Simulator(World(engine), lockstep=args.lockstep)
        self.journal: WorldJournal | None = None
        self._output: JournalOutput | None = None
        self.steps: StepService | None = None  # in lock-step
        if args.lockstep:
            self.journal = WorldJournal(self.sim)
            record_services(self.journal)
            record_messages(self.journal)
            record_parameters(self.journal)
        if not rospy.has_param("/use_sim_time"):
            rospy.set_param("/use_sim_time", True)
        self.sim.relatch = _flag("~relatch_on_reset")
        self._watchdog = Watchdog(self.sim)
        recordings = _recordings(args)
        world = read_world(args.world, interrupted)
        fill_world(self.sim, world, interrupted)
        if args.paused:
            self.sim.pause()
        self._advertise(_flag("~enable_ros_network"), args, world.plugins)
        self._recorders = [SimulationRecorder(self.sim, options) for options in recordings]

    def _advertise(self, network: bool, args: argparse.Namespace, of_world: list[Plugin]) -> None:
        sensors: list[SceneSensor] = []
        scene = SceneServer(self.sim, sensors)
        shown = {"show": scene.show, "end_journal": self._end_journal} if network else {}
        journal = self.journal if network else None  # without services there is nothing to record
        self.control = WorldControl(self.sim, self._watchdog, shown, journal)
        answer_xmlrpc(METHOD, self.control.answer)
        answer_xmlrpc(WORK, self._watchdog.work)
        free_polls_at_once()
        bound_messages()
        Reception.open()
        hang_up_on_nonsense()
        thinner = Thinner(self.sim)
        advertise_states(self.sim, thinner, _clock_frequency(), network)
        pictures = PictureProcess(self.sim, args.renderer)
        rospy.on_shutdown(pictures.close)  # before the topics close
        if args.renderer != RAYS:  # which may be missing
            pictures.start()
            rospy.loginfo("Cameras' pictures are made by %s", pictures.name)
            args.renderer = pictures.name
        plugins = PluginRegistry(self.sim, thinner, args.seed or 0, sensors, args.camera_scale, pictures)
        load_plugins(self.sim, plugins, of_world if network else ())
        if not network:
            return
        with registered_together():
            self._offer_services(plugins, thinner, args)

    def _offer_services(self, plugins: PluginRegistry, thinner: Thinner, args: argparse.Namespace) -> None:
        # Clients take the world for ready once it can be paused, so the step service comes first.
        stepping: list[object] = []
        if self.journal is not None:
            one_at_a_time = threading.Lock()
            common = self.sim, plugins.sensing, self._watchdog, one_at_a_time
            self.steps = steps = StepService(*common)
            stepping = [
                steps,
                SnapshotServices(self.sim, steps, one_at_a_time),
                AdvanceService(*common, thinner, self.journal),
            ]
            bag = Path(args.journal).absolute() if args.journal else None
            self._output = JournalOutput(self.journal, bag)
            self.journal.start(facts_of(args, steps.series))
        spawning = threading.Lock()
        with spawning:  # once a model is there, clients use all other services without a wait
            spawner = SpawnServices(self.sim, plugins, spawning)
            answer_xmlrpc(SPAWNS, spawner.count)
            self._services = [*stepping, spawner, *advertise_world_services(self.sim)]

    def _end_journal(self) -> None:
        """Completes the journal's bag."""
        if self._output is not None:
            self._output.end_bag()

    def run(self, signals: SignalHandler, work: "Work | None" = None) -> int:
        """Simulates until the node is shut down, or the work is done; returns the exit code."""
        # Called before the topics close, so that no tick publishes to a closed one.
        rospy.on_shutdown(self._watchdog.stop)
        if signals.noted():  # they came during the start: no more time passes
            self._watchdog.stop()
        else:
            self._watchdog.start()
        code = 0
        if work is None:
            signals.wait(self._watchdog.failed)
        else:
            code = signals.run(lambda: work(self), INTERRUPTED)
        failed = self._watchdog.failed()
        self._watchdog.stop()  # a shutdown that came before the hook was there doesn't call it
        for recorder in self._recorders:
            recorder.close(RECORDING_TIMEOUT)
        hanging = self._watchdog.left_hanging()
        if hanging is not None:
            print(f"gzserver: ends while the world's lock is kept by {hanging}", file=sys.stderr)
            end_within(HANGING_TIMEOUT, 1)
        return 1 if failed or hanging is not None else code


Work = Callable[[GazeboNode], int]
"""What is done with the simulator, in a thread of its own; returns the exit code."""


def _recordings(args: argparse.Namespace) -> list[RecordingOptions]:
    """Returns the recordings that the command line asks for."""
    width, height = args.video_size
    recordings = [
        RecordingOptions(Path(name).absolute(), args.video_rate, width, height, args.video_model)
        for name in args.video
    ]
    for options in recordings:
        options.check()
    return recordings


def _flag(name: str) -> bool:
    """Returns a parameter that is true by default; warns unless its value is a bool, as Gazebo does."""
    value = rospy.get_param(name, True)
    if isinstance(value, bool):
        return value
    rospy.logwarn("%s is %r, neither true nor false: true is used", name, value)
    return True


def _clock_frequency() -> float:
    """Returns ~pub_clock_frequency [Hz of simulated time]; 0 (every tick) if it is invalid."""
    value = rospy.get_param("~pub_clock_frequency", 0)
    # A period of less than a nanosecond, or of more than a thousand years, is a mistake.
    if isinstance(value, (int, float)) and (value == 0 or 1.0 / MOST_FREQUENT <= value <= MOST_FREQUENT):
        return float(value)
    rospy.logwarn("~pub_clock_frequency is %r, no frequency: /clock comes with every tick", value)
    return 0.0


def simulate(
    args: argparse.Namespace, engine: Engine, signals: SignalHandler, work: Work | None = None
) -> int:
    """Simulates until the end; returns the exit code."""
    try:
        node = GazeboNode(args, engine, signals.noted)
    except (RecordingError, RendererError) as error:
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
    return node.run(signals, work)


def main(argv: list[str] | None = None, work: Work | None = None) -> int:
    """Runs the node, until the work is done if there is some; returns the exit code."""
    use_one_arena()
    command_line = sys.argv if argv is None else argv
    more = shlex.split(os.environ.get(MORE_ARGUMENTS, ""))
    args = parse_args([*rospy.myargv(command_line)[1:], *more])  # which win over a launch file's
    name = full_name(command_line, NAME)
    try:
        wait_for_master(NAME)
        with one_at_a_time(name):
            if not args.replace:
                refuse_twin(name)
            init_node(NAME, command_line, anonymous=False)
    except NodeNameTaken as error:
        print(f"gzserver: {error}", file=sys.stderr)
        return 1
    loss = NameLoss()
    # Not before: while there is no master, a signal ends the process as usual.
    signals = SignalHandler()
    if args.physics not in ENGINES:
        rospy.logwarn("Physics engine '%s' is not known; PyBullet is used", args.physics)
    if args.ignored:
        rospy.logwarn("Arguments without effect here: %s", " ".join(args.ignored))
    if args.journal and not args.lockstep:
        rospy.logwarn("--journal has no effect: only a world in lock-step (--lockstep) has a journal")
    if args.seed is not None:
        seed_random_numbers(args.seed)
        rospy.loginfo("Random numbers start from seed %d", args.seed)
    try:
        engine = make_engine(args.physics if args.physics in ENGINES else BULLET[0])
    except EngineError as error:
        rospy.logfatal("%s", error)
        return 1
    code = simulate(args, engine, signals, work)
    if loss.happened:
        print(f"gzserver: {loss.text(name)}", file=sys.stderr)
        code = code or 1
    end_within(EXIT_TIMEOUT, code)
    return code


def main_with_window(argv: Sequence[str] | None = None) -> int:
    """Runs the node in this process and the window in another one; returns the node's exit code."""
    command_line = list(sys.argv if argv is None else argv)
    # Until the node handles them, both signals end the block, and with it the window.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        with window(command_line[1:]):
            return main(command_line)
    except KeyboardInterrupt:
        return INTERRUPTED


@contextlib.contextmanager
def window(arguments: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Opens the window in a process of its own for the time of a block."""
    # The launch file's name and log file are the server's.
    own = [a for a in arguments if ":=" in a and not a.startswith(("__name:=", "__log:="))]
    client = subprocess.Popen([sys.executable, "-P", "-c", WINDOW, *own, f"__name:={WINDOW_NAME}"])
    try:
        yield client
    finally:
        client.send_signal(signal.SIGTERM)
        try:
            client.wait(WINDOW_TIMEOUT)
        except subprocess.TimeoutExpired:
            client.kill()
            client.wait()
