"""The answer to every step: genpy reads the first one of a form, and of the next ones only the numbers."""

import io
import struct
from operator import itemgetter
from typing import Any, NamedTuple

from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest, StepWorldResponse

_MARK, _WHOLES = -1.2345678987654321e-300, (0x1ABCDEF1, 0x2ABCDEF2, 0x3ABCDEF3)  # that nobody sends


class StepKind:
    """StepWorld as a `ServiceClient` knows a service's type; a client has one of its own."""

    _type, _md5sum, _request_class = StepWorld._type, StepWorld._md5sum, StepWorldRequest

    def __init__(self) -> None:
        self.form: _Form | None = None

    def _response_class(self) -> "StepAnswer":
        return StepAnswer(self)


class StepAnswer(StepWorldResponse):
    """What is read of it are the same numbers as genpy's.

    Args:
        kind: knows the form of answers before.
    """

    def __init__(self, kind: StepKind) -> None:
        self._kind = kind  # the fields come with `deserialize`

    def deserialize(self, data: bytes) -> "StepAnswer":
        """Reads a message, as its base class would."""
        form = self._kind.form
        if form is not None and form.fill(self, data):
            return self
        StepWorldResponse.__init__(self)
        super().deserialize(data)
        self._kind.form = _Form(self, data) if _tells_joints_alone(self) else None
        return self


class _Stamp(NamedTuple):
    secs: int
    nsecs: int


class _Header(NamedTuple):
    seq: int
    stamp: _Stamp
    frame_id: str


class _Joints(NamedTuple):
    """As sensor_msgs/JointState, which takes longer to make."""

    header: _Header
    name: list[str]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


class _Form:
    """Where an answer has its numbers, and what is around them.

    Args:
        answer: one of the form.
        data: the same as it came.
    """

    def __init__(self, answer: StepWorldResponse, data: bytes) -> None:
        joints = answer.joint_states
        self._constant = answer.success, answer.status_message
        self._frame_id, self._names = joints.header.frame_id, joints.name
        counts = len(joints.position), len(joints.velocity), len(joints.effort)
        blocks = [("d", [_MARK]), ("3I", _WHOLES), *((f"{n}d", [_MARK] * n) for n in counts)]
        pattern, template, end = "<", _marked(data), 0
        for codes, numbers in blocks:
            packed = struct.pack(f"<{codes}", *numbers)
            begin = template.index(packed, end)
            pattern += f"{begin - end}s{codes}"
            end = begin + len(packed)
        self._struct = struct.Struct(f"{pattern}{len(template) - end}s")
        first = 7  # of the positions among what is unpacked
        second = first + counts[0] + 1
        third = second + counts[1] + 1
        self._positions = slice(first, second - 1)
        self._velocities = slice(second, third - 1)
        self._efforts = slice(third, third + counts[2])
        self._around = itemgetter(0, 2, 6, second - 1, third - 1, -1)
        self._same = self._around(self._struct.unpack(data))

    def fill(self, answer: StepWorldResponse, data: bytes) -> bool:
        """Gives an answer its fields if the data has the form; returns whether it has."""
        if len(data) != self._struct.size:
            return False
        found = self._struct.unpack(data)
        if self._around(found) != self._same:
            return False
        answer.success, answer.status_message = self._constant
        answer.sim_time = found[1]
        answer.joint_states = _Joints(
            _Header(found[3], _Stamp(found[4], found[5]), self._frame_id),
            self._names,
            found[self._positions],
            found[self._velocities],
            found[self._efforts],
        )
        answer.model_names = answer.model_poses = answer.model_twists = ()
        answer.link_poses = answer.link_twists = answer.contacts = ()
        return True


def _tells_joints_alone(answer: StepWorldResponse) -> bool:
    return not (answer.model_names or answer.link_poses or answer.contacts)


def _marked(data: bytes) -> bytes:
    """The same message with other numbers, which are found in it."""
    marked: Any = StepWorldResponse().deserialize(data)
    joints = marked.joint_states
    marked.sim_time = _MARK
    joints.header.seq, joints.header.stamp.secs, joints.header.stamp.nsecs = _WHOLES
    for name in ("position", "velocity", "effort"):
        setattr(joints, name, [_MARK] * len(getattr(joints, name)))
    buffer = io.BytesIO()
    marked.serialize(buffer)
    return buffer.getvalue()
