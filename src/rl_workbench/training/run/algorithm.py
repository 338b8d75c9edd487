"""What the frame of a training asks of an algorithm, and what it offers to it.

The frame (`training.py`) opens and resumes, evaluates, saves, logs and tells. An algorithm says
what it is made of, what one step of its loop does, and what a checkpoint holds.
"""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, TypeVar

import gymnasium
import numpy as np

from rl_workbench.training.environments.checked import CheckedEnvironment
from rl_workbench.training.environments.making import make_environment
from rl_workbench.training.environments.several import close_all, make_several
from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.run.scalar_log import ScalarLog

Say = Callable[[str], None]


class Frame(Protocol):
    """The frame, as an algorithm sees it while it learns."""

    @property
    def log(self) -> ScalarLog:
        """For figures of the algorithm's own."""
        ...

    @property
    def folder(self) -> Path:
        """The run's, for files of the algorithm's own."""
        ...

    def is_over(self) -> bool:
        """Whether to stop: it is complete, or the user interrupts."""
        ...

    def is_interrupted(self) -> bool:
        """Whether the user interrupts."""
        ...

    def episode_done(
        self,
        total_reward: float,
        length: int,
        scalars: Mapping[str, float],
        note: str = "",
        success: bool | None = None,
        step: int | None = None,
    ) -> None:
        """Takes an episode down.

        Args:
            total_reward: the undiscounted return.
            length: [steps].
            scalars: of the algorithm's own, logged at the step of the episode's end.
            note: for the line of every 20th episode; else the speed stands there.
            success: whether it reached its goal; None if the environment doesn't say.
            step: of its end; None: now.
        """
        ...

    def step_done(self) -> None:
        """Evaluates and saves what is due. The training can go on from here as if from a checkpoint."""
        ...


class Algorithm(ABC):
    """One algorithm at work in one environment."""

    env: gymnasium.Env[
        Any, Any
    ]  # the one that is learned in, and evaluated where there is no other

    @property
    @abstractmethod
    def steps(self) -> int:
        """Steps of the environment that were learned from."""

    @property
    def stride(self) -> int:
        """Steps since the last `step_done` but one."""
        return 1

    @abstractmethod
    def start_environment(self, state: Any, say: Say) -> None:
        """Seeds the environment; then brings it to where `environment_state` found it.

        Args:
            state: what that gave; None at the start of a new training.
            say: is told if it can't be brought there.
        """

    @abstractmethod
    def learn(self, frame: Frame) -> None:
        """Learns until it is over; calls `frame.step_done()` wherever it can be saved.

        Raises:
            WorkbenchError: if the environment or the arithmetic fails.
        """

    @abstractmethod
    def act_greedily(self, observation: np.ndarray) -> Any:
        """The best action for an observation (D,)."""

    def check_weights(self) -> None:
        """Refuses to go on with weights that are no numbers, where learning doesn't check them.

        Raises:
            WorkbenchError: if one isn't.
        """
        return

    @abstractmethod
    def state_dict(self) -> dict[str, Any]:
        """All that it learned, as plain values and tensors, by keys of its own."""

    @abstractmethod
    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what `state_dict` gave, from a checkpoint that may have more.

        Raises:
            WorkbenchError: if the state is another's.
        """

    @abstractmethod
    def environment_state(self) -> Any:
        """Where the environment is, as far as it can be brought back: plain values and tensors."""

    def leave_environment(self) -> Any:
        """What `restore_environment` needs after an evaluation that moves this environment's robot."""
        return self.environment_state()

    def restore_environment(self, state: Any, say: Say) -> None:
        """Brings the environment back after an evaluation that moved its robot.

        Args:
            state: what `leave_environment` gave before.
            say: is told if it can't be brought back.
        """
        raise NotImplementedError

    def settle(self) -> bool:
        """After a failure: gives up what was under way.

        Returns:
            Whether the training stands where it can be saved and gone on with.
        """
        return False

    def export(self, folder: Path) -> None:
        """Writes the networks in further forms, if it has any.

        Raises:
            OSError: if the disk refuses.
        """
        return

    def close(self) -> None:
        """Closes the environment."""
        self.env.close()


def environment_for(options: TrainingOptions, given: Mapping[str, Any]) -> CheckedEnvironment:
    """An environment as a training's algorithm observes it.

    Args:
        options: of the training.
        given: the environment's own options.

    Raises:
        WorkbenchError: as `make_environment`.
    """
    return make_environment(options.run.env_id, given, keep_dict=options.kind.keeps_dict)


def training_environments(options: TrainingOptions) -> list[gymnasium.Env[Any, Any]]:
    """The environments that a training learns in, `num_envs` of them, each with a robot of its own.

    Raises:
        WorkbenchError: as `make_several`.
    """
    run = options.run
    return make_several(
        lambda given: environment_for(options, given),
        run.training_environment, run.env_id, run.num_envs,
    )  # fmt: skip


Made = TypeVar("Made", bound=Algorithm)


def in_its_environments(
    options: TrainingOptions, make: Callable[[list[gymnasium.Env[Any, Any]]], Made]
) -> Made:
    """An algorithm in new environments, which are closed if they don't suit.

    Raises:
        WorkbenchError: if the environments can't be made, or don't suit.
    """
    envs = training_environments(options)
    with contextlib.ExitStack() as making:
        making.callback(close_all, envs)
        made = make(envs)
        making.pop_all()
    return made


def make_algorithm(options: TrainingOptions) -> Algorithm:
    """A new training's algorithm, with its environment.

    Raises:
        WorkbenchError: if the environment can't be made, or doesn't suit.
    """
    made: Algorithm = import_module(options.kind.implementation).make(options)
    return made
