"""One worker: a process on some machine, with one environment of a training beside it."""

import os
import pickle
import sys
import traceback
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import gymnasium
import torch
from gymnasium.envs.registration import EnvSpec, parse_env_id

from rl_workbench.env_ids import module_of, without_module
from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import finding_modules
from rl_workbench.training.algorithms import recorded_options
from rl_workbench.training.environments.checked import EnvironmentFailure
from rl_workbench.training.player import Player
from rl_workbench.training.rollouts.fingerprint import fingerprint


class Failure(NamedTuple):
    """What a player raised: told as an answer, since Ray would put it into a long text of its own."""

    text: str
    is_environments: bool
    trace: str


class Home(NamedTuple):
    """What it takes to find an environment as the driver finds it."""

    paths: list[str]  # of modules, as far as they are on the worker's machine as well
    specs: bytes  # a pickled list: how it is registered, by what a worker may not import


def kin_of(env_id: str) -> list[EnvSpec]:
    """How all versions of an environment are registered here; none if its id names what does so."""
    if module_of(env_id):
        return []
    kin = parse_env_id(without_module(env_id))[:2]
    return [each for each in gymnasium.registry.values() if (each.namespace, each.name) == kin]


class Worker:
    """What Ray makes an actor of.

    Args:
        record: the options of the training.
        index: the number of its environment.
        home: of the driver.
    """

    def __init__(self, record: dict[str, Any], index: int, home: Home) -> None:
        sys.path.extend(path for path in home.paths if path not in sys.path and os.path.isdir(path))
        self._specs = home.specs
        torch.set_num_threads(1)  # networks this small only lose by more
        self._options = recorded_options(record, "what the driver sent")
        self._index = index
        self._player: Player | None = None

    def begin(self) -> Any:
        """Makes the environment; gives the machine's fingerprint, or a Failure."""
        return self._answer(lambda player: fingerprint())

    def play(self, policy: Any, state: Any) -> Any:
        """What `Player.play` gives, or a Failure."""
        return self._answer(lambda player: player.play(policy, state))

    def _answer(self, ask: Callable[[Player], Any]) -> Any:
        try:
            if self._player is None:
                self._register()
                implementation = import_module(self._options.kind.implementation)
                self._player = implementation.make_player(self._options, self._index)
            return ask(self._player)
        except WorkbenchError as error:
            trace = "".join(traceback.format_exception(error.__cause__ or error))
            return Failure(str(error), isinstance(error, EnvironmentFailure), trace)

    def _register(self) -> None:
        try:
            specs: list[EnvSpec] = pickle.loads(self._specs)
        except (ImportError, AttributeError) as error:
            text = f"can't find what registers {self._options.run.env_id}: {error}; {finding_modules()}"
            raise WorkbenchError(text) from error
        for spec in specs:
            gymnasium.registry.setdefault(spec.id, spec)

    def close(self) -> None:
        """Closes the environment."""
        if self._player is not None:
            self._player.close()
