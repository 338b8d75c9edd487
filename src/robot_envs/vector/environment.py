"""Many robots at once: in this process, or spread over worker processes."""

import mmap
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from robot_envs.backends.choice import IN_PROCESS
from robot_envs.vector.process import WorkerProcess
from robot_envs.vector.worker import Maker, WorkerShare
from robot_envs.vector.worlds import Env, Infos, Worlds, arrays_in, bytes_needed, check_resettable

PAYS = 4  # environments that a worker must have to be worth its messages
Results = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


class RobotVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """`num_envs` environments with worlds of their own.

    Each gives exactly what it would give alone, whatever the number of workers: a seed s stands
    for s, s + 1, ..., one for each environment.

    Args:
        num_envs: number of environments.
        entry_point: of the function that makes one, as Gymnasium's registry writes it:
            "package.module:function". Workers call it, too.
        workers: worker processes; 0: all worlds in this process; None: what pays.
        autoreset_mode: Gymnasium's: "next_step", "same_step" or "disabled".
        options: keyword arguments of the function.

    Raises:
        ValueError: if an option makes no sense.
        RobotEnvError: if a worker can't make its worlds.
    """

    def __init__(
        self,
        num_envs: int,
        entry_point: str,
        *,
        workers: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        self.closed = True  # until there is something to close
        _check(num_envs, workers, options)
        self.num_envs = num_envs
        mode = AutoresetMode(autoreset_mode)
        maker = Maker(entry_point, options)
        probe = maker()  # wrong options show here, not in a worker
        probe.close()
        self.metadata = {**probe.metadata, "autoreset_mode": mode}
        self.render_mode = probe.render_mode
        self.single_action_space = probe.action_space
        self.single_observation_space = probe.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._share_memory(probe)
        wanted = default_workers(num_envs) if workers is None else workers
        self._workers: list[WorkerProcess] = []
        self._worlds: Worlds | None = None
        self.closed = False
        jobs = [
            WorkerShare(maker, num_envs, begin, end, mode.value)
            for begin, end in _bounds(num_envs, max(1, wanted))
        ]
        if wanted == 0:
            self._worlds = jobs[0].worlds(jobs[0].envs(), self._memory)
        else:
            self._start(jobs)

    def _share_memory(self, probe: Env) -> None:
        self._file = os.memfd_create("robot_envs")
        size = bytes_needed(probe, self.num_envs)
        os.truncate(self._file, size)
        self._memory = mmap.mmap(self._file, size)
        self._arrays = arrays_in(self._memory, probe, self.num_envs)

    def _start(self, jobs: Sequence[WorkerShare]) -> None:
        try:
            for job in jobs:
                self._workers.append(WorkerProcess(job, self._file))
            for worker in self._workers:
                worker.answer()
        except BaseException:  # Ctrl-C, too
            self.close()
            raise

    @property
    def workers(self) -> list[int]:
        """Process ids of the workers; none if all worlds are in this process."""
        return [worker.pid for worker in self._workers]

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode in each, or in those that `options["reset_mask"]` names.

        Raises:
            ValueError: if there are not as many seeds or flags as environments.
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            SimulatorError: if a worker has died.
        """
        self._check_open()
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        flags = None if mask is None else check_resettable(self, mask)
        infos = self._reset(self._seeds(seed), options or None, flags)
        return self._arrays.observations.copy(), self._joined(infos)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + index for index in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"{len(seed)} seeds for {self.num_envs} environments")
        return list(seed)

    def _reset(
        self, seeds: list[int | None], options: dict[str, Any] | None, flags: list[bool] | None
    ) -> Infos:
        if self._worlds is not None:
            return self._worlds.reset(seeds, options, flags)
        parts = []
        for worker in self._workers:
            begin, end = worker.range
            part = None if flags is None else flags[begin:end]
            parts.append((seeds[begin:end], options, part))
        return self._exchange("reset", parts)

    def _check_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError("this vector environment is closed; make another one")

    def step(self, actions: np.ndarray) -> Results:
        """Carries out one action in each environment.

        Args:
            actions: shape (num_envs, ...), of the single action space.

        Raises:
            ValueError: if there are not as many actions as environments, or one is wrong.
            SimulatorError: if a worker has died.
        """
        self._check_open()
        arrays = self._arrays
        if np.shape(actions) != arrays.actions.shape:
            raise ValueError(
                f"actions must have the shape {arrays.actions.shape}, not {np.shape(actions)}"
            )
        try:
            np.copyto(arrays.actions, actions, casting="same_kind")
        except TypeError as error:  # a fraction, or NaN, isn't cut off to a whole number
            raise ValueError(f"an action isn't of {self.single_action_space}: {error}") from error
        infos = self._worlds.step() if self._worlds is not None else self._ask("step")
        return (
            arrays.observations.copy(),
            arrays.rewards.copy(),
            arrays.terminations.copy(),
            arrays.truncations.copy(),
            self._joined(infos),
        )

    def _ask(self, name: str, *arguments: Any) -> list[Any]:
        return self._exchange(name, [arguments] * len(self._workers))

    def _exchange(self, name: str, arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Asks each worker with its own arguments; returns all of their answers."""
        try:
            for worker, own in zip(self._workers, arguments, strict=True):
                worker.ask(name, *own)
            return self._answers()
        except Exception:
            raise
        except BaseException:  # Ctrl-C: the next call would take what is unread for its own answers
            self.close()
            raise

    def _answers(self) -> list[Any]:
        """All of the workers' answers in one list; each is read, also behind one that is an error."""
        found: list[Any] = []
        failures: list[Exception] = []
        for worker in self._workers:
            try:
                found += worker.answer()
            except Exception as error:  # noqa: BLE001 - the first one is raised below
                failures.append(error)
        if failures:
            raise failures[0]
        return found

    def _joined(self, infos: Infos) -> dict[str, Any]:
        """In Gymnasium's form: an array for each key, and one that says whose values are set."""
        joined: dict[str, Any] = {}
        for index, info in infos:
            joined = self._add_info(joined, info, index)
        return joined

    def call(self, name: str, *arguments: Any) -> tuple[Any, ...]:
        """What each environment's attribute `name` is, or gives when called."""
        if self._worlds is not None:
            return tuple(self._worlds.call(name, arguments))
        return tuple(self._ask("call", name, arguments))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """As `call`, without arguments."""
        return self.call(name)

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of each, if the render mode is rgb_array."""
        return self.call("render") if self.render_mode == "rgb_array" else None

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the workers and frees all worlds; `close()` calls this once."""
        if self._worlds is not None:
            self._worlds.close()
        for worker in self._workers:
            worker.close()
        os.close(self._file)


def default_workers(num_envs: int) -> int:
    """One for each core that this process may use, as long as each has enough to do."""
    return min(len(os.sched_getaffinity(0)), num_envs // PAYS)


def _bounds(count: int, parts: int) -> list[tuple[int, int]]:
    """Ranges of equal length, or one more, that cover `count`."""
    edges = [count * index // parts for index in range(parts + 1)]
    return list(zip(edges, edges[1:], strict=False))


def _check(num_envs: int, workers: int | None, options: dict[str, Any]) -> None:
    if num_envs < 1:
        raise ValueError(f"num_envs must be at least 1, not {num_envs}")
    if workers is not None and not 0 <= workers <= num_envs:
        raise ValueError(f"workers must lie in [0, {num_envs}], not {workers}")
    backend = options.get("backend", IN_PROCESS)
    if backend != IN_PROCESS:
        raise ValueError(
            f"many worlds need the backend {IN_PROCESS!r}; {backend!r} has a single robot"
        )
    if options.get("render_mode") == "human":
        raise ValueError("many worlds have no window; use render_mode 'rgb_array'")
