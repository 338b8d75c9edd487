"""The request that comes with every step: it is serialized once, and then only its numbers are."""

import io
import struct
from typing import BinaryIO

from bullet_gazebo_msgs.srv import StepWorldRequest

from robot_envs.backends.ros.wire.messages import ask_for
from robot_envs.world_state import StateQuery

MOST_FRAMES = 16  # that are kept, as the simulator keeps lists of controllers
_MARK = -1.2345678987654321e-300  # a command that nobody sends


class StepRequest(StepWorldRequest):
    """Commands and ticks; genpy takes three times as long for the same bytes.

    Args:
        ticks: physics steps of one action.
    """

    def __init__(self, ticks: int) -> None:
        super().__init__(ticks=ticks)
        self._frames: dict[tuple[str, ...], tuple[bytes, struct.Struct, bytes]] = {}

    def ask_for(self, query: StateQuery) -> None:
        """Asks for what a query names, from now on."""
        ask_for(self, query)
        self._frames.clear()

    def command(self, names: tuple[str, ...], numbers: list[float]) -> None:
        """Commands controllers; the same ones take as many numbers each time."""
        self.controllers, self.commands = names, numbers

    def serialize(self, buff: BinaryIO) -> None:
        """Writes the message, as its base class would."""
        frame = self._frames.get(self.controllers)
        if frame is None:
            if len(self._frames) >= MOST_FRAMES:
                self._frames.clear()  # a task that commands others all the time
            frame = self._frames[self.controllers] = self._frame()
        before, numbers, behind = frame
        buff.write(before + numbers.pack(*self.commands) + behind)

    def _frame(self) -> tuple[bytes, struct.Struct, bytes]:
        """What comes before the commands, how they are written, and what comes behind them."""
        numbers = struct.Struct(f"<{len(self.commands)}d")
        whole, commands = io.BytesIO(), self.commands
        self.commands = [_MARK] * len(commands)
        try:
            super().serialize(whole)
        finally:
            self.commands = commands
        if not commands:
            return whole.getvalue(), numbers, b""
        before, behind = whole.getvalue().split(numbers.pack(*[_MARK] * len(commands)))
        return before, numbers, behind
