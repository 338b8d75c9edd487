"""The description of a robot: its files, running controllers, and spawn pose."""

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from numbers import Real
from typing import Any, Self

from file_access.text import did_you_mean, nearest_or_all
from robot_envs import controllers, files
from robot_envs.controllers import CommandPort
from robot_envs.errors import RobotEnvError
from robot_envs.files import Source
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.joint import JointLimits
from robot_sim.control.transmissions import RobotDescription, read_description
from robot_sim.physics.description import DescriptionError, ModelDescription, is_control_plugin
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import TIME_STEP
from robot_sim.robot import control_period_of

logger = logging.getLogger(f"rosout.{__name__}")

CONTROL_PERIOD = 0.01  # [s]
EMPTY = "empty"
"""The world with just a ground plane, as in gazebo_ros's empty_world.launch."""


@dataclass(frozen=True)
class Robot:
    """A robot's description, which is the same in this process and over ROS.

    Creating one reads no file; `check`, which environments call, reads all.

    Args:
        urdf: A URDF or xacro file: a path, "package://PACKAGE/PLACE", a function that finds it, or the
            text of a URDF.
        controllers: The controllers' parameters as ros_control has them: a YAML file, likewise, or a
            mapping. `gazebo_ros_control/pid_gains` and `joint_limits` may be among them.
        run: The controllers to run, in the order in which they are started.
        commanded: The ones that tasks command; None: all that take numbers.
        name: Name of the model in the world; None: the URDF's own.
        arguments: Arguments of xacro, by name.
        pose: Where it is spawned, in the world.
        world: A world file: a path, or "package://..."; `EMPTY`: a ground plane; None: nothing else, in
            this process, and over ROS gzserver's default.
        engine: Engine of the physics in this process: "bullet", or "mujoco".
        control_period: Simulated time of one action [s]; whole physics steps.
        physics_step: Of the world [s]: a longer one computes faster and less exactly; None: that of the world
            file, or 0.001.
        namespace: Of its topics, services and controllers over ROS; each robot of a world with several
            needs its own.
        description: The parameter that holds the URDF over ROS, in the namespace.
        publisher: The controller that publishes its joint states over ROS.
        rviz: Package and name of a launch file that shows it in RViz; None: there is none.
        odometry: Topic of a vehicle's odometry, which tells its pose and speed where it is deployed.
        sensor_topics: Topics of sensors in real time, by the sensor's name, where plugins name others.
    """

    urdf: Source | Callable[[], Source]
    controllers: Source | Callable[[], Source] | Mapping[str, Any] = field(default_factory=dict)
    run: tuple[str, ...] = ()
    commanded: tuple[str, ...] | None = None
    name: str | None = None
    arguments: Mapping[str, str] = field(default_factory=dict)
    pose: Pose = Pose()
    world: Source | None = EMPTY
    engine: str = "bullet"
    control_period: float = CONTROL_PERIOD
    physics_step: float | None = None
    namespace: str = ""
    description: str = "robot_description"
    publisher: str = "joint_state_controller"
    rviz: tuple[str, str] | None = None
    odometry: str | None = None
    sensor_topics: Mapping[str, str] = field(default_factory=dict)

    def __new__(cls, *_: Any, **options: Any) -> Self:
        """Refuses an unknown option with the nearest name."""
        known = [each.name for each in fields(cls)]
        for name in options:
            if name not in known:
                raise TypeError(f"a Robot has no option '{name}'{nearest_or_all(name, known)}")
        return super().__new__(cls)

    @cached_property
    def xml(self) -> str:
        """Its URDF, expanded, as in the parameter robot_description."""
        return files.read_urdf(_source(self.urdf), self.arguments)

    @cached_property
    def model(self) -> str:
        """Its name in the world."""
        return self.name or self.links.name or "robot"

    @cached_property
    def links(self) -> ModelDescription:
        """Its links and joints, as the physics sees them."""
        try:
            return parse_urdf(self.xml, resources=files.resources())
        except DescriptionError as error:
            raise RobotEnvError(f"the robot{self._named}: {error}") from error

    @cached_property
    def parameters(self) -> Mapping[str, Any]:
        """The parameters below its namespace."""
        if isinstance(self.controllers, Mapping):
            tree: Mapping[str, Any] = self.controllers
        else:
            tree = files.read_parameters(_source(self.controllers))
        own = tree.get(self.namespace.strip("/"))
        return own if isinstance(own, Mapping) else tree

    @cached_property
    def control(self) -> RobotDescription:
        """Its transmissions, and the joints with their limits, as ros_control reads them."""
        try:
            return read_description(self.xml).limited_by(self.parameters.get("joint_limits"))
        except ControlError as error:
            raise RobotEnvError(f"the robot{self._named}: {error}") from error

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """The joints of a state: those with a transmission, in alphabetical order."""
        return tuple(sorted({each.joint for each in self.control.transmissions}))

    @property
    def limits(self) -> Mapping[str, JointLimits]:
        """Limits of each joint's position [rad, m], speed [rad/s, m/s], effort [N m, N]; None: no limit."""
        return {name: joint.limits for name, joint in self.control.joints.items()}

    @property
    def pid_gains(self) -> Mapping[str, Any]:
        """The parameters `gazebo_ros_control/pid_gains`, by joint."""
        described = self.parameters.get("gazebo_ros_control")
        gains = described.get("pid_gains") if isinstance(described, Mapping) else None
        return gains if isinstance(gains, Mapping) else {}

    def hardware(self) -> RobotHardware:
        """Makes the joints as controllers see them; raises ControlError if something about them is wrong."""
        description = read_description(self.xml).limited_by(self.parameters.get("joint_limits"))
        return RobotHardware(description, self.pid_gains)

    @property
    def _named(self) -> str:
        return f" '{self.name}'" if self.name else ""

    def check(self) -> None:
        """Reads and checks everything, once; raises RobotEnvError that lists all faults."""
        _ = self._sound

    @cached_property
    def _sound(self) -> bool:
        faults = list(self._faults())
        if faults:
            listed = faults[0] if len(faults) == 1 else "".join(f"\n- {each}" for each in faults)
            raise RobotEnvError(f"the robot '{self.model}': {listed}")
        return True

    def _faults(self) -> Iterator[str]:
        wrong = unfit_pose(self.pose)
        if wrong:
            yield f"its pose {wrong}"
        yield from self._world_faults()
        given: tuple[tuple[str, Any], ...] = (("run", self.run), ("commanded", self.commanded))
        for what, names in given:
            if isinstance(names, str):
                yield f"{what} lists names: ({names!r},) and not {names!r}"
                return
        if not self.joints:
            yield ("its URDF has no <transmission>: each joint that is to be commanded or seen needs one")
            return
        self._warn_of_unknown_joints()
        try:
            hardware = self.hardware()
        except ControlError as error:
            yield str(error)
        else:
            passive = [each.name for each in self.links.movable_joints]
            yield from controllers.faults(self.run, self.commanded, self.parameters, hardware, passive)

    def _world_faults(self) -> Iterator[str]:
        """Yields the faults of control period, world and namespace."""
        period, step = self.control_period, self.physics_step
        if step is None and self.world in (None, EMPTY):
            step = TIME_STEP
        if not _is_within(period, 0.0, math.inf):
            yield f"control_period must be a time above 0 [s], not {period!r}"
        elif step is not None and not _is_within(step, 1e-6, 1.0):
            yield f"physics_step must be a time between 1e-06 and 1 [s], not {step!r}"
        elif step is None or period == CONTROL_PERIOD:  # an environment may take another than that
            pass
        elif abs(period - max(1, round(period / step)) * step) > 1e-9:
            yield (
                f"control period {period} s is not a multiple of the physics step {step} s: change "
                "control_period or physics_step"
            )
        if self.world is not None and self.world != EMPTY and not files.is_text(self.world):
            try:
                files.need_file(files.locate(self.world))
            except RobotEnvError as error:
                yield f"its world: {error}"
        for plugin in self.links.plugins:
            if not is_control_plugin(plugin.filename):
                continue
            try:
                control_period_of(plugin)
            except ControlError as error:
                yield str(error)
            namespace = (plugin.element.findtext("robotNamespace") or "").strip()
            if namespace and namespace.strip("/") != self.namespace.strip("/"):
                yield (
                    f"its URDF puts its controllers into the namespace '{namespace}' (<robotNamespace>), the "
                    f"description into '/{self.namespace.strip('/')}': give both the same"
                )

    def _warn_of_unknown_joints(self) -> None:
        """Warns only: a file of parameters may be for several robots."""
        limits = self.parameters.get("joint_limits")
        for what, named in (("pid_gains", self.pid_gains), ("joint_limits", limits)):
            for name in named if isinstance(named, Mapping) else ():
                if name not in self.control.joints:
                    near = did_you_mean(str(name), self.control.joints)
                    text = f"the robot '{self.model}' has no joint '{name}', which {what} names{near}"
                    logger.warning("%s", text)

    @cached_property
    def ports(self) -> tuple[CommandPort, ...]:
        """The ports of the controllers that tasks command, in the order of `commanded`."""
        self.check()
        loaded = controllers.load(self.run, self.parameters, self.hardware())[1]
        return tuple(controllers.ports(self.commanded, self.parameters, loaded))


def _is_within(value: Any, low: float, high: float) -> bool:
    """Returns whether a value is a finite number above 0 within bounds."""
    return isinstance(value, Real) and 0.0 < float(value) < math.inf and low <= float(value) <= high


def unfit_pose(pose: Any) -> str:
    """Returns why a model can't be at a pose; empty if it can."""
    if not isinstance(pose, Pose):
        return f"is a Pose((x, y, z)), not {pose!r}"
    numbers = (*pose.position, *pose.orientation)
    if not all(map(math.isfinite, numbers)):
        return f"isn't finite: {pose}"
    return "" if any(pose.orientation) else f"has a quaternion of length 0: {pose}"


def _source(given: Source | Callable[[], Source]) -> Source:
    return given() if callable(given) else given
