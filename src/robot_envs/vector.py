"""Vector environments: what `gymnasium.make_vec` makes of every environment of this library."""

import contextlib
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate

from robot_envs.backends import LOCKSTEP, OWN, REALTIME
from robot_envs.backends.backend import side_by_side
from robot_envs.checks import action_reader
from robot_envs.environment import RobotEnv
from robot_envs.errors import SimulatorError
from robot_envs.snapshot import EnvSnapshot, checked_snapshot

Results = tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


class VectorSnapshot(NamedTuple):
    """What `RobotVectorEnv.save_state` returns."""

    states: list[EnvSnapshot]
    ended: np.ndarray  # (num_envs,) of bool: whose episode begins anew with the next step


class RobotVectorEnv(SyncVectorEnv):  # generic since Gymnasium 1.4 only
    """`num_envs` environments with robots of their own: Gymnasium's `SyncVectorEnv`, also over ROS.

    With `backend="ros"` each has a simulator and a master of its own; all start side by side, and end with
    this process. `step` sends all commands before it waits for the first answer, so the simulators move at
    the same time, on as many cores as there are. In this process the worlds move one after the other.

    Each environment is bit-identical to one alone: the seed s stands for s, s + 1, ..., one for each. A wrong
    action is refused before anything moves. After an error in the middle of a step all have to be reset.
    Raises ValueError if an option makes no sense, RobotEnvError if a robot can't be brought up.

    Args:
        num_envs: Number of environments.
        make: Makes one environment, from `backend` and `options`.
        backend: The backend of all; "ros" and "ros-own" are the same here.
        autoreset_mode: Gymnasium's: "NextStep", "SameStep" or "Disabled".
        options: Keyword arguments of `make`.
    """

    def __init__(
        self,
        num_envs: int,
        make: Callable[..., RobotEnv],
        *,
        backend: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        self.closed = True  # until there is something to close
        mode = AutoresetMode(autoreset_mode)
        if type(num_envs) is not int or num_envs < 1:
            raise ValueError(f"num_envs must be a whole number, at least 1, not {num_envs!r}")
        if backend == REALTIME:
            raise ValueError(
                f"many robots need the backend 'ros', or one in this process; {REALTIME!r} has a single robot"
            )
        if options.get("render_mode") == "human":
            raise ValueError("many robots can't be shown on one page; use render_mode 'rgb_array'")
        if backend == LOCKSTEP:
            backend = OWN
        self._robots: list[RobotEnv] = []

        def made() -> RobotEnv:
            self._robots.append(make(backend=backend, **options))
            return self._robots[-1]

        self._side_by_side = backend == OWN
        self._interrupted = False
        try:
            with side_by_side(num_envs):
                super().__init__([made] * num_envs, autoreset_mode=mode)
        except BaseException:  # Ctrl-C, too
            self.close_extras()
            raise
        self.closed = False
        self._read = action_reader(self.single_action_space)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Starts an episode in each, or in those that `options["reset_mask"]` names; see `SyncVectorEnv`.

        `options["snapshot"]` is one for all, or a list of one for each of them.
        """
        options = dict(options or {})
        of_all = "reset_mask" not in options
        if isinstance(given := options.get("snapshot"), Iterable):
            snapshots = [checked_snapshot(each) for each in given]
            count = self.num_envs if of_all else int(np.sum(options["reset_mask"]))
            if len(snapshots) != count:
                raise ValueError(f"{len(snapshots)} snapshots for {count} environments")
            options["snapshot"] = iter(snapshots)
        try:
            begun = super().reset(seed=seed, options=options or None)
        except SimulatorError:  # some have begun, and others not
            self._interrupted = True
            raise
        if of_all:
            self._interrupted = False
        return begun

    def step(self, actions: Any) -> Results:
        """Carries out one action in each; nothing moves for a wrong one, which is a ValueError."""
        self._check_ready()
        read = [self._read(action) for action in iterate(self.action_space, actions)]
        if len(read) != self.num_envs:
            raise ValueError(f"{len(read)} actions for {self.num_envs} environments")
        self._interrupted = True
        if self._side_by_side:
            for robot, action, ended in zip(self._robots, read, self._autoreset_envs.tolist(), strict=True):
                if not ended or self.autoreset_mode is AutoresetMode.SAME_STEP:
                    robot.begin_step(action)
        given = super().step(actions)
        self._interrupted = False
        return given

    def save_state(self) -> VectorSnapshot:
        """Returns all that decides the future of each; see `RobotEnv.save_state`."""
        self._check_ready()
        states = [robot.save_state() for robot in self._robots]
        return VectorSnapshot(states, self._autoreset_envs.copy())

    def restore_state(self, snapshot: VectorSnapshot) -> None:
        """Returns to a snapshot of this vector; see `RobotEnv.restore_state`."""
        if not isinstance(snapshot, VectorSnapshot) or len(snapshot.states) != self.num_envs:
            raise ValueError(f"it is no snapshot of a vector of {self.num_envs} environments")
        for robot, state in zip(self._robots, snapshot.states, strict=True):
            robot.check_fits(state)
        self._interrupted = True
        for robot, state in zip(self._robots, snapshot.states, strict=True):
            robot.restore_state(state)
        self._autoreset_envs = snapshot.ended.copy()
        self._interrupted = False

    def _check_ready(self) -> None:
        if self.closed:
            raise gymnasium.error.ClosedEnvironmentError(
                "this vector environment is closed; make another one"
            )
        if self._interrupted:
            raise gymnasium.error.ResetNeeded(
                "an error interrupted the step before; call reset(), without a reset_mask"
            )
        if self.autoreset_mode is AutoresetMode.DISABLED and self._autoreset_envs.any():
            raise gymnasium.error.ResetNeeded(
                f"episodes of environments {np.flatnonzero(self._autoreset_envs).tolist()} have ended; reset "
                'them by options={"reset_mask": ...}'
            )

    def close_extras(self, **kwargs: Any) -> None:
        """Closes all environments, whose simulators end side by side; `close()` calls this once."""
        with side_by_side(len(self._robots)), contextlib.ExitStack() as closing:
            for robot in self._robots:
                closing.callback(robot.close)
