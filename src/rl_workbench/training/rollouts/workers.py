"""Workers on the machines of a cluster, by Ray: each plays in an environment beside it.

An answer is a whole episode or a long fragment of one, since each costs half a millisecond on the way. A
worker that is lost, with its machine or alone, is made anew and plays its part again: it is sent all that
its part depends on, so what it plays is the same to the bit.
"""

import contextlib
import pickle
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import ray
from ray import cloudpickle
from ray.exceptions import ObjectStoreFullError, OutOfDiskError, RayError, RayTaskError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster.nodes import Cluster, Node, check_processors
from rl_workbench.training.environments.checked import EnvironmentFailure
from rl_workbench.training.environments.several import numbered
from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.rollouts.deadlines import Deadlines
from rl_workbench.training.rollouts.fingerprint import fingerprint
from rl_workbench.training.rollouts.worker import Failure, Home, Worker, kin_of
from rl_workbench.training.run.algorithm import Say

POLL = 0.1  # [s] between two looks for an interruption
PATIENCE = 15.0  # [s] for nodes, where there are none
ANSWER = 1.0  # [s] that a node has to answer in
GRACE = 3.0  # [s] that environments have to close in
ATTEMPTS = 5  # of workers at the same part, before the part is taken for the cause


class WorkerTraceback(Exception):
    """The cause of an error, as the worker tells of it."""


class Workers:
    """As many workers as a training has environments, spread over a cluster; see `Pool`.

    Args:
        cluster: that was joined.
        options: of the training, as the workers need them.
        say: is told of workers that are lost.

    Raises:
        WorkbenchError: if the cluster has fewer processors than there are workers, or an environment can't be
            made.
    """

    def __init__(self, cluster: Cluster, options: TrainingOptions, say: Say) -> None:
        self._cluster, self._say = cluster, say
        self._record, self._count = options.record(), options.run.num_envs
        check_processors(self._count, cluster.cpus)
        self._home = _home_of(options.run.env_id)
        self._nodes = [""] * self._count  # where each worker is
        self._playing: dict[Any, int] = {}
        self._deadlines = Deadlines(self._count)
        self._actors: list[Any] = []
        try:
            for index in range(self._count):
                self._actors.append(self._start(index, processors=1))
            self._check_kinds(self._gather(self._beginning, lambda: False, True) or [])
        except BaseException:  # Ctrl-C as well
            self.close()
            raise

    def _start(self, index: int, processors: int) -> Any:
        """A worker on the node that has most processors without one.

        Args:
            index: of its environment.
            processors: that it has for itself; 0: it makes do with what there is.

        Raises:
            WorkbenchError: if there is no node any more.
        """
        if not self._cluster.nodes:
            self._cluster.update(PATIENCE)
        nodes = self._answering()
        before, self._nodes[index] = self._nodes[index], ""
        if not nodes:
            raise WorkbenchError("no node of the cluster can be used any more")

        def free(name: str) -> tuple[int, bool]:
            return nodes[name].cpus - self._nodes.count(name), name != before

        chosen = self._nodes[index] = max(sorted(nodes), key=free)
        place = NodeAffinitySchedulingStrategy(chosen, soft=False)
        actor = ray.remote(Worker).options(num_cpus=processors, scheduling_strategy=place)
        return actor.remote(self._record, index, self._home)

    def _answering(self) -> dict[str, Node]:
        """The nodes that can be used, and answer: Ray takes some ten seconds to know that one is gone."""
        found = {}
        for each in ray.nodes():
            node = self._cluster.nodes.get(each["NodeID"])
            place = (each["NodeManagerAddress"], each["NodeManagerPort"])
            if node is not None:
                with contextlib.suppress(OSError), socket.create_connection(place, ANSWER):
                    found[node.id] = node
        return found

    def _beginning(self, index: int) -> Callable[[], Any]:
        begin: Callable[[], Any] = self._actors[index].begin.remote
        return begin

    def _check_kinds(self, kinds: Sequence[str]) -> None:
        mine = fingerprint()
        others = [str(number) for number, each in enumerate(kinds, 1) if each != mine]
        if others:
            self._say(
                f"workers {', '.join(others)} compute to other bits than this machine, by their processors "
                "or NumPy: the same seed gives the same weights on machines of one kind only"
            )

    def play(
        self, policy: Any, states: Sequence[Any], should_stop: Callable[[], bool]
    ) -> list[Any] | None:
        """See `Pool`."""
        with _told():
            shared = ray.put(policy)

        def asking(index: int) -> Callable[[], Any]:
            return partial(self._actors[index].play.remote, shared, states[index])

        return self._gather(asking, should_stop)

    def _gather(
        self,
        asking: Callable[[int], Callable[[], Any]],
        should_stop: Callable[[], bool],
        begins: bool = False,
    ) -> list[Any] | None:
        """What all workers answer; one that is lost is replaced, and its successor asked the same.

        Args:
            asking: makes of a worker's number what asks it, and gives Ray's reference to the answer.
            should_stop: is asked all the time.
            begins: whether they are to begin, for which there is a time; else they play a part.
        """
        found: dict[int, Any] = {}
        lost = [0] * self._count
        is_told = False
        with _told():
            for index in range(self._count):
                self._ask(index, asking)
            while self._playing:
                if should_stop():
                    return None
                ready, _ = ray.wait(list(self._playing), timeout=POLL)
                for reference in ready:
                    index = self._playing.pop(reference)
                    try:
                        found[index] = self._checked(index, ray.get(reference))
                        if not begins:
                            self._deadlines.played(index)
                    except (RayTaskError, ObjectStoreFullError, OutOfDiskError):
                        raise
                    except RayError as error:
                        lost[index] += 1
                        self._replace(index, _line_of(error), lost[index])
                        self._ask(index, asking)
                for reference, index in list(self._playing.items()):
                    limit = self._deadlines.limit(begins, lost[index])
                    if self._deadlines.since(index) > limit:
                        del self._playing[reference]
                        lost[index] += 1
                        what = "begun" if begins else "answered"
                        self._replace(index, f"it hasn't {what} within {limit:.0f} s", lost[index])
                        self._ask(index, asking)
                is_told = is_told or self._tell_of_silence(self._deadlines.silence(begins))
        return [found[index] for index in range(self._count)]

    def _ask(self, index: int, asking: Callable[[int], Callable[[], Any]]) -> None:
        self._playing[asking(index)()] = index
        self._deadlines.ask(index)

    def _tell_of_silence(self, least: float) -> bool:
        """Tells of those that haven't answered for so long [s]; returns whether there are any."""
        silent = {index: self._deadlines.since(index) for index in sorted(self._playing.values())}
        if max(silent.values(), default=0.0) <= least:
            return False
        names = ", ".join(str(index + 1) for index, since in silent.items() if since > least)
        seconds = max(silent.values())
        self._say(f"for {seconds:.0f} s nothing has come from worker {names} of {self._count}")
        return True

    def _checked(self, index: int, answer: Any) -> Any:
        if not isinstance(answer, Failure):
            return answer
        kind = EnvironmentFailure if answer.is_environments else WorkbenchError
        node = self._cluster.nodes.get(self._nodes[index])
        place = f"on node {node.name}: " if node else ""
        with numbered(index, self._count):
            raise kind(f"{place}{answer.text}") from WorkerTraceback(answer.trace)

    def _replace(self, index: int, reason: str, attempts: int) -> None:
        """Has another worker in the place of one that is lost.

        Raises:
            WorkbenchError: if it was lost too often.
        """
        name = f"worker {index + 1} of {self._count}"
        if attempts == ATTEMPTS:
            raise WorkbenchError(f"{name} was lost {attempts} times at the same part: {reason}")
        self._say(f"{name} is lost ({reason}): another one plays its part again")
        ray.kill(self._actors[index])  # it may only have been out of reach
        self._cluster.update()
        self._actors[index] = self._start(index, processors=0)

    def close(self) -> None:
        """Ends all workers, those that aren't playing with their environments closed."""
        busy = set(self._playing.values())
        idle = [actor for index, actor in enumerate(self._actors) if index not in busy]
        if idle:
            ray.wait([each.close.remote() for each in idle], num_returns=len(idle), timeout=GRACE)
        for actor in self._actors:
            ray.kill(actor)


@contextlib.contextmanager
def _told() -> Iterator[None]:
    """Tells in one line what Ray tells in many.

    Raises:
        WorkbenchError: if an object store and its disk are full, or a worker has failed.
    """
    try:
        yield
    except RayError as error:
        cause = error.cause if isinstance(error, RayTaskError) else error
        text = f"a worker has failed: {_line_of(cause)}"
        if isinstance(error, ObjectStoreFullError | OutOfDiskError):
            text = (
                f"the cluster's object store is full ({_line_of(cause)}): `ray start "
                "--object-store-memory` makes a larger one, shorter fragments need less"
            )
        raise WorkbenchError(text) from error


def _home_of(env_id: str) -> Home:
    """That of this process, where the environment was made before.

    Raises:
        WorkbenchError: if it is registered with what can't travel.
    """
    try:
        return Home(list(sys.path), cloudpickle.dumps(kin_of(env_id)))
    except (TypeError, ValueError, AttributeError, pickle.PicklingError) as error:
        raise WorkbenchError(f"{env_id} can't be sent to workers: {_line_of(error)}") from error


def _line_of(error: BaseException) -> str:
    """What an error tells, in a line: of one with a traceback its end."""
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return lines[-1 if "Traceback" in str(error) else 0].strip(".: ")
