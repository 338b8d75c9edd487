"""The base class for tests with unittest, and so with rostest."""

import contextlib
import traceback
import unittest
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ros_utils.testing.bench import failure_folder, process_bench, tell
from ros_utils.testing.robot_world import RobotWorld

__unittest = True  # unittest leaves this module's frames out of tracebacks, so they end in the test


class RobotTestCase(unittest.TestCase):
    """A test with an empty world at time 0 in `self.world`; one that fails runs once more, recorded."""

    seed = 1  # of the sensors' noise
    world: RobotWorld
    _recorded: Path | None = None
    _fault: Exception | None = None  # the first one of a subtest

    def setUp(self) -> None:
        super().setUp()
        self.world = self.enterContext(process_bench().world(self.seed, self._recorded))

    @contextlib.contextmanager
    def subTest(self, *args: Any, **params: Any) -> Iterator[None]:
        """See the base class; the test that has failed in a subtest fails itself at its end."""
        with super().subTest(*args, **params):
            try:
                yield
            except unittest.SkipTest:
                raise
            except Exception as fault:
                self._fault = self._fault or fault
                raise

    def _callTestMethod(self, method: Callable[[], Any]) -> None:
        try:
            super()._callTestMethod(method)  # type: ignore[misc]
            if self._fault is not None:
                raise self._fault
        except unittest.SkipTest:
            raise
        except Exception as fault:
            if self._recorded is None:
                text = self._record(self._fault or fault)
                fault.args = (f"{fault}\n{text}",)  # rostest leaves notes out
                if text not in str(fault):  # an OSError's text is made of more
                    fault.add_note(text)
            raise

    def _record(self, fault: Exception) -> str:
        """Runs the test once more, recorded; returns what to say about it."""
        self.world.close()
        again, result = type(self)(self._testMethodName), unittest.TestResult()
        message = "".join(traceback.format_exception_only(fault)).strip()
        try:
            again._recorded = folder = failure_folder(self.id())
            again.run(result)
            texts = [text.strip() for _, text in (*result.errors, *result.failures)]
            is_same = any(text.endswith(message) for text in texts)
            other = message if is_same else "".join(texts[:1]).rpartition("\n")[2]
            return tell(folder, self.seed, "".join(traceback.format_exception(fault)), message, other)
        except OSError as refused:
            return f"not recorded: {refused}"
