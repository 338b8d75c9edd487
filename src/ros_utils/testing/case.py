"""The base class for tests with unittest, and so with rostest."""

import traceback
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ros_utils.testing.bench import Bench, failure_folder, tell
from ros_utils.testing.robot_world import RobotWorld


class RobotTestCase(unittest.TestCase):
    """A test with an empty world at time 0 in `self.world`; one that fails runs once more, recorded."""

    seed = 1  # of the sensors' noise
    world: RobotWorld
    _bench: Bench
    _recorded: Path | None = None

    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        cls._bench = Bench()
        cls.addClassCleanup(cls._bench.close)

    def setUp(self) -> None:
        super().setUp()
        self.world = self.enterContext(self._bench.world(self.seed, self._recorded))

    def _callTestMethod(self, method: Callable[[], Any]) -> None:
        try:
            super()._callTestMethod(method)  # type: ignore[misc]
        except unittest.SkipTest:
            raise
        except Exception as fault:
            if self._recorded is None:
                fault.args = (f"{fault}\n{self._record(fault)}",)  # rostest leaves notes out
            raise

    def _record(self, fault: Exception) -> str:
        """Runs the test once more, recorded; returns what to say about it."""
        self.world.close()
        again = type(self)(self._testMethodName)
        again._recorded = folder = failure_folder(self.id())
        message, other = str(fault), ""
        try:
            again.debug()
        except Exception as second:  # noqa: BLE001 - whatever a user's test raises
            other = str(second)
        return tell(folder, self.seed, "".join(traceback.format_exception(fault)), message, other)
