"""The request that comes with every step: commands and ticks, like the one before but for its numbers."""

import struct
from typing import NamedTuple

from bullet_gazebo_msgs.srv import StepWorldRequest

LENGTH = struct.Struct("<I")  # in front of a request, of a list and of a text
NUMBER = struct.calcsize("<d")
# Behind the commands: 2 lists for joints, reset, seed, 6 lists to place, and what is asked for.
NOTHING_MORE = bytes(2 * 4 + 1 + 4 + 6 * 4 + 1 + 3 * 4 + 1 + 4)
MOST_FORMS = 16  # that are kept for a connection; a length has one


class _Form(NamedTuple):
    """What such requests have in common."""

    before: bytes  # the commands, with the length of the request
    commands: struct.Struct
    ticks: int
    controllers: tuple[str, ...]


class UsualRequest(StepWorldRequest):
    """Commands and ticks, and no more; its fields are those that genpy would read."""

    commanded_joints = joint_commands = models = poses = twists = ()
    joints = positions = velocities = ()
    model_states_of = link_states_of = link_frames = contacts_of = ()
    reset = StepWorldRequest.NONE
    seed = 0
    model_states = contacts = False

    def __init__(self, form: _Form, commands: tuple[float, ...]) -> None:
        self.ticks, self.controllers, self.commands = form.ticks, form.controllers, commands


class UsualRequests:
    """Reads them; for one connection."""

    def __init__(self) -> None:
        self._forms: dict[int, _Form] = {}  # by length [bytes]

    def read(self, data: bytes) -> UsualRequest | None:
        """Reads what came, if it is one request like one before."""
        form = self._forms.get(len(data))
        if form is None or not (data.startswith(form.before) and data.endswith(NOTHING_MORE)):
            return None
        return UsualRequest(form, form.commands.unpack_from(data, len(form.before)))

    def learn(self, data: bytes, request: StepWorldRequest) -> None:
        """Keeps the form of a request that genpy has read, if it is a usual one."""
        names = tuple(request.controllers)
        # Length, ticks, the names with their count, and the commands'.
        begin = sum([4 * LENGTH.size, *(LENGTH.size + len(name.encode()) for name in names)])
        count = len(request.commands)
        if data[begin + NUMBER * count :] != NOTHING_MORE:
            return  # it asks for more, came in parts, or not alone
        if len(self._forms) >= MOST_FORMS:
            self._forms.clear()
        self._forms[len(data)] = _Form(
            data[:begin], struct.Struct(f"<{count}d"), request.ticks, names
        )
