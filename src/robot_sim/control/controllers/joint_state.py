"""joint_state_controller/JointStateController: reports joints, drives none.

See docs/contract/ros_control.md 3.1.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

from robot_sim.constants import NANOSECONDS
from robot_sim.control.controllers.base import Controller, Output
from robot_sim.control.controllers.parameters import SLOWEST, name_list, parameter
from robot_sim.control.controllers.sensor_controllers import PublishRate
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import STATE, RobotHardware
from robot_sim.control.joint import JointHandle

Extra = tuple[str, tuple[float, ...]]  # a constant joint: name; position, velocity, effort
EXTRA_FIELDS = ("position", "velocity", "effort")


class JointStateSample(NamedTuple):
    """sensor_msgs/JointState: positions [rad, m], velocities [rad/s, m/s], efforts [N m, N]."""

    stamp: int  # [ns]
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    efforts: tuple[float, ...]


class JointStateParameters(PublishRate):
    joints: list[str] | None = parameter("those to report; all without it", None, name_list)
    extra_joints: Any = parameter(
        "constant ones: a list of `{name, position, velocity, effort}`", (), lambda value, _: value
    )


class JointStateController(Controller):
    """Publishes `joint_states` at `publish_rate` [Hz of simulated time], phase-locked to the first one."""

    parameters = (JointStateParameters,)

    def __init__(self, name: str, joints: list[JointHandle], rate: float, extra: list[Extra]) -> None:
        super().__init__(name)
        self._joints = joints
        self._period = round(NANOSECONDS / rate) if rate > SLOWEST else None
        self._last = 0
        self._names = tuple(j.name for j in joints) + tuple(e[0] for e in extra)
        self._extra = [tuple(values[part] for _, values in extra) for part in range(3)]
        self._output = Output("joint_states", "JointState", shared=True)
        self.outputs = [self._output]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = JointStateParameters.read(params, name)
        wanted = list(hardware.joints) if given.joints is None else given.joints
        unknown = [joint for joint in wanted if joint not in hardware.joints]
        if unknown:
            raise ControlError(f"parameter {name}/joints: the robot has no joint {unknown}")
        extra = _extra_joints(given.extra_joints, wanted)
        joints = [hardware.joints[joint] for joint in wanted]
        return cls(name, joints, given.publish_rate, extra)

    def starting(self, now: int) -> None:
        if self._period is not None:
            self._last = now - self._period  # the next tick publishes

    def update(self, now: int, dt: float) -> None:
        if self._period is not None and self._last + self._period < now:
            self._last += self._period
            self._report(now)

    def joints_moved(self, now: int) -> None:
        """Reports at once, so that no reader of the topic acts on an old state."""
        if self._period is not None:
            self._last = now
            self._report(now)

    def _report(self, now: int) -> None:
        if self._output.wanted:
            self._output.send(self.sample(now))

    def sample(self, now: int) -> JointStateSample:
        """Returns the joints' state, extra joints last."""
        joints, extra = self._joints, self._extra
        return JointStateSample(
            now, self._names, tuple(j.position for j in joints) + extra[0],
            tuple(j.velocity for j in joints) + extra[1],
            tuple(j.effort for j in joints) + extra[2],
        )  # fmt: skip


def _extra_joints(entries: object, names: list[str]) -> list[Extra]:
    """Returns constant joints (name, position, velocity, effort). Bad and repeated ones are left out."""
    extra: list[Extra] = []
    seen = set(names)
    for entry in entries if isinstance(entries, list) else []:
        values = [entry.get(key, 0.0) for key in EXTRA_FIELDS] if isinstance(entry, Mapping) else []
        if not values or not all(isinstance(value, float) for value in values):
            continue
        if isinstance(entry.get("name"), str) and entry["name"] not in seen:
            seen.add(entry["name"])
            extra.append((entry["name"], tuple(values)))
    return extra


CONTROLLERS = {"joint_state_controller/JointStateController": (JointStateController, STATE)}
