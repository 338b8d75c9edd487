"""As much of Ray as nodes and jobs ask for, in this process: for what real clusters do seldom."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple


class RayError(Exception):
    """What all of Ray's errors are."""


class WorkerCrashedError(RayError):
    pass


class ObjectStoreFullError(RayError):
    pass


class Exceptions:
    RayError = RayError


class Reference(NamedTuple):
    """To an answer; an error is raised where it is asked for, and None hasn't come yet."""

    find: Callable[[], Any]

    @property
    def answer(self) -> Any:
        return self.find()


class Told:
    """What a task tells bit by bit."""

    def __init__(self, parts: Sequence[Any]) -> None:
        self._parts: Iterator[Any] = iter(parts)

    def __next__(self) -> Reference:
        part = next(self._parts)
        return Reference(lambda: part)


class Task:
    """A function that runs here, when it is asked for."""

    def __init__(self, ray: "FakeRay", function: Callable[..., Any], streaming: bool) -> None:
        self._ray, self._function, self._streaming = ray, function, streaming
        self._on = ""

    def options(self, label_selector: dict[str, str], **_: Any) -> "Task":
        (self._on,) = label_selector.values()
        return self

    def remote(self, *arguments: Any) -> Any:
        self._ray.asked.append(self._on)
        if self._streaming:
            return Told(self._ray.told)
        if self._function.__name__ == "look":  # what is there
            node = self._on
            return Reference(lambda: self._ray.answers[node])
        return Reference(partial(self._function, *arguments))


class FakeRay:
    """The module, initialised.

    Args:
        answers: what each node tells of itself, by its id.
        told: by each attempt at a job.
        full: whether nothing finds room in the object store.
    """

    exceptions = Exceptions

    def __init__(
        self, answers: dict[str, Any], told: Sequence[Any] = (), full: bool = False
    ) -> None:
        self.answers, self.told, self._full = answers, told, full
        self.asked: list[str] = []  # on which nodes something ran

    def nodes(self) -> list[dict[str, Any]]:
        return [
            {
                "NodeID": id,
                "Alive": True,
                "Resources": {"CPU": 2.0},
                "NodeManagerAddress": "10.0.0.7",
            }
            for id in self.answers
        ]

    def get_runtime_context(self) -> "FakeRay":
        return self

    def get_node_id(self) -> str:
        return next(iter(self.answers), "")

    def remote(self, num_returns: str = "", **_: Any) -> Callable[[Callable[..., Any]], Task]:
        return lambda function: Task(self, function, num_returns == "streaming")

    def wait(self, asked: list[Any], **_: Any) -> tuple[list[Any], list[Any]]:
        late = [each for each in asked if isinstance(each, Reference) and each.answer is None]
        return [each for each in asked if each not in late], late

    def get(self, reference: Reference, timeout: float | None = None) -> Any:
        answer = reference.answer
        if isinstance(answer, Exception):
            raise answer
        return answer

    def put(self, value: Any) -> Reference:
        if self._full:
            raise ObjectStoreFullError(
                "Failed to put object:\nthe local object store is full of pages"
            )
        return Reference(lambda: value)

    def cancel(self, told: Told, force: bool = False) -> None:
        pass

    def shutdown(self) -> None:
        pass
