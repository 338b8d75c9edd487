"""A world for one test: robots are spawned in it, and assertions let its time pass."""

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn
from xml.etree import ElementTree

import numpy as np
import rosgraph
from bullet_gazebo_msgs.srv import StepWorldRequest
from tf.transformations import quaternion_from_euler

from file_access.text import nearest_or_all
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils._internal import packages, params
from ros_utils.testing.followed_node import WorldError
from ros_utils.testing.stepped_world import NANOSECONDS, SteppedWorld, Vector

PACKAGE = "package://"
DESCRIPTION = "robot_description"  # parameter


__unittest = True  # see case.py


class RobotWorld(SteppedWorld):
    """A simulated world that only this test moves.

    Time passes in `wait` and in assertions, by whole physics steps of 1 ms. An assertion looks at the world
    as it is, lets time pass until what it asserts holds, `by` [s] at most, and then for as long as it has to
    stay so (`stays` [s]).
    """

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._prismatic: set[str] = set()  # joints

    def spawn(
        self, file: str, controllers: str | None = None, run: Sequence[str] = (), *, name: str = "robot",
        ns: str = "/", xyz: Vector = (0.0, 0.0, 0.0), rpy: Vector = (0.0, 0.0, 0.0),
        joints: Mapping[str, float] | None = None, arguments: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Spawns a robot or an object, and starts controllers.

        Args:
            file: URDF, xacro or SDF: a path, or package://PACKAGE/PATH.
            controllers: YAML file of the controllers, likewise.
            run: Names of controllers to load and start.
            name: Name of the model.
            ns: Namespace of its description, controllers and topics.
            xyz: Position [m].
            rpy: Roll, pitch and yaw [rad].
            joints: Positions in which it starts [rad, m]; the others start at 0.
            arguments: Arguments of xacro, "name:=value" each.

        Raises:
            WorldError: If one of these fails; the log says why.
        """
        if name in ros_gazebo.gazebo_get_model_names():
            raise WorldError(f"there is a model '{name}' already: give this one another name=...")
        pose = (*xyz, *quaternion_from_euler(*rpy).tolist())
        path = _located(file)
        load = ros_params.ros_load_yaml_from_path
        if controllers is not None and not load(_located(controllers), ns):
            raise WorldError(f"{controllers} can't be loaded; the log says why")
        for each in run:
            _check_described(each, ns)
        place = (name, ns, "world", *pose)
        if file.endswith(".sdf"):
            done = ros_gazebo.gazebo_spawn_sdf_path(path, *place)
        elif done := ros_urdf.urdf_load_from_path(path, DESCRIPTION, ns, list(arguments)):
            self._check_start(ns, joints or {})
            done = bool(ros_gazebo.gazebo_spawn_urdf_param(DESCRIPTION, *place))
        if not done or (run and not ros_controllers.spawn_controllers_srv(run, ns)):
            raise WorldError(f"{file} can't be spawned, or not with its controllers; the log says why")
        if joints:
            positions = list(joints.values())
            self._client.send(StepWorldRequest(joints=list(joints), positions=positions))
        self._state = self._step(0)

    def _check_start(self, ns: str, joints: Mapping[str, float]) -> None:
        """Notes which joints of a description are prismatic; raises WorldError for a start beyond stops."""
        urdf = ElementTree.fromstring(params.get(rosgraph.names.ns_join(ns, DESCRIPTION)))
        for joint in urdf.iterfind("joint"):
            name, kind, limit = str(joint.get("name")), joint.get("type"), joint.find("limit")
            if kind == "prismatic":
                self._prismatic.add(name)
            if name not in joints or kind == "continuous" or limit is None:
                continue
            low, high = (float(limit.get(each, 0.0)) for each in ("lower", "upper"))
            if not low <= joints[name] <= high:
                raise WorldError(
                    f"joint '{name}' can't start at {joints[name]:g}: its stops are {low:g} and {high:g}"
                )

    def assert_joint(
        self, name: str, position: float, *, within: float, by: float = 0.0, stays: float = 0.0
    ) -> None:
        """Asserts that a joint gets to a position [rad, m], give or take `within`."""
        __tracebackhide__ = True
        unit = "m" if name.rpartition("::")[2] in self._prismatic else "rad"

        def look() -> str:
            now = self.joint(name)
            return "" if abs(now - position) <= within else f"joint {name} is at {now:.4g} {unit}"

        self.assert_that(look, f"{position:g} ± {within:g} {unit}", by, stays)

    def assert_link(
        self,
        name: str,
        position: Sequence[float | None],
        *,
        within: float,
        by: float = 0.0,
        stays: float = 0.0,
        frame: str = "",
    ) -> None:
        """Asserts that a link gets to a position x, y, z [m], give or take `within`; None: wherever."""
        __tracebackhide__ = True
        if len(position) != 3:
            raise WorldError(f"a position is x, y, z: not {tuple(position)}")

        def look() -> str:
            now = self.link(name, frame)
            off = [a - b for a, b in zip(now, position, strict=True) if b is not None]
            good = math.hypot(*off) <= within
            return "" if good else f"link {name} is at {_point(now)} m"

        seen = f" in the frame of {frame}" if frame else ""
        self.assert_that(look, f"{_point(position)} ± {within:g} m{seen}", by, stays)

    def assert_touches(self, link: str, other: str, *, by: float = 0.0, stays: float = 0.0) -> None:
        """Asserts that a link touches another one, or a model."""
        __tracebackhide__ = True

        def look() -> str:
            touched = self.contacts(link)
            good = any(f"::{other}::" in f"::{each}" for each in touched)
            return "" if good else f"{link} touches {', '.join(touched) or 'nothing'}"

        self.assert_that(look, f"that it touches {other}", by, stays)

    def assert_touches_nothing(self, link: str, *, by: float = 0.0, stays: float = 0.0) -> None:
        """Asserts that a link touches nothing."""
        __tracebackhide__ = True

        def look() -> str:
            touched = self.contacts(link)
            return f"{link} touches {', '.join(touched)}" if touched else ""

        self.assert_that(look, "that it touches nothing", by, stays)

    def assert_nearest(
        self, sensor: str, distance: float, *, within: float, by: float = 0.0, stays: float = 0.0
    ) -> None:
        """Asserts what a laser's nearest range [m] is, give or take `within`; infinity: no echo."""
        __tracebackhide__ = True

        def look() -> str:
            ranges = self.sensor(sensor).get("ranges")
            if ranges is None:
                return f"{sensor} has measured no ranges"
            now = float(np.min(ranges, initial=math.inf))
            good = now == distance or abs(now - distance) <= within
            return "" if good else f"the nearest range of {sensor} is {now:.4g} m"

        self.assert_that(look, f"{distance:g} ± {within:g} m", by, stays)

    def assert_that(self, look: Callable[[], str], wanted: str, by: float = 0.0, stays: float = 0.0) -> None:
        """Asserts a condition of your own, looked at after each physics step.

        Args:
            look: Returns what is wrong; empty if the condition holds.
            wanted: What was wanted, for the text of a failure.
            by: The simulated time until it has to hold [s].
            stays: How long it has to hold then [s].

        Raises:
            AssertionError: It doesn't; the text says what was wrong in the end, and what was wanted.
        """
        __tracebackhide__ = True
        most, least, passed = self._ticks(by), self._ticks(stays), 0
        since: int | None = None
        while True:
            fault = look()
            if fault:
                since = None
                if passed >= most:
                    self._fail(fault, passed, wanted, by, stays)
            else:
                since = passed if since is None else since
                if passed - since >= least:
                    return
            self._state = self._step(1)
            passed += 1

    def _fail(self, fault: str, passed: int, wanted: str, by: float, stays: float) -> NoReturn:
        __tracebackhide__ = True
        after = f" after {passed * self._period / NANOSECONDS:g} s" if passed else ""
        text = f"{fault}{after}; {wanted} was wanted"
        if stays:
            text += (f" within {by:g} s," if by else "") + f" for {stays:g} s"
        raise AssertionError(text)


def _located(file: str) -> str:
    """Returns the path of a file that may be given as package://PACKAGE/PATH."""
    if not file.startswith(PACKAGE):
        return file
    package, _, path = file.removeprefix(PACKAGE).partition("/")
    try:
        return packages.file(package, "", path)
    except packages.NotFound as fault:
        raise WorldError(f"{file}: {fault}") from fault


def _check_described(controller: str, ns: str) -> None:
    """Raises WorldError, with the nearest name, if a controller has no parameters in a namespace."""
    known: dict[str, Any] = {}
    with contextlib.suppress(KeyError):
        known = params.get(ns)
    described = [name for name, each in known.items() if isinstance(each, dict) and "type" in each]
    if controller.partition("/")[0] not in known:
        near = nearest_or_all(controller, described)
        raise WorldError(f"there is no controller '{controller}' among the parameters of '{ns}'{near}")


def _point(position: Sequence[float | None]) -> str:
    return f"({', '.join('any' if each is None else f'{each:.4g}' for each in position)})"
