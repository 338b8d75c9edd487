"""Several environments of a training, side by side: each has its number, and a robot of its own."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any

import gymnasium

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments.checked import CheckedEnvironment
from rl_workbench.training.environments.making import shares_robot

# Attribute of an environment that shares its robot: the options by which a copy has one of its own.
OWN_ROBOT = "own_robot_options"
# And its method: side_by_side(count) is a context manager within which that many start, or end, at once.
SIDE_BY_SIDE = "side_by_side"


class NumberedEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """One of several: what fails in it is told with its number.

    Args:
        env: the environment.
        index: from 0 on.
        count: of all of them.
    """

    env: CheckedEnvironment

    def __init__(self, env: CheckedEnvironment, index: int, count: int) -> None:
        super().__init__(env)
        self._index, self._count = index, count

    def begin_step(self, action: Any) -> None:
        """As the environment's."""
        with numbered(self._index, self._count):
            self.env.begin_step(action)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        with numbered(self._index, self._count):
            return self.env.step(action)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        with numbered(self._index, self._count):
            return self.env.reset(seed=seed, options=options)

    def close(self) -> None:
        """As the environment's."""
        with numbered(self._index, self._count):
            self.env.close()


def make_several(
    make: Callable[[Mapping[str, Any]], CheckedEnvironment],
    given: Mapping[str, Any],
    env_id: str,
    count: int,
) -> list[gymnasium.Env[Any, Any]]:
    """Makes environments of which each moves a robot of its own; the caller closes them, by `close_all`.

    Args:
        make: makes one by its options.
        given: these options. Where copies of such an environment would move the same robot it says itself
            what they need beside them to have one of their own.
        env_id: for the error.
        count: of environments; a single one is as `given` says.

    Raises:
        WorkbenchError: if they can't be made, or there is but one robot.
    """
    first = make(given)
    if count == 1:
        return [first]
    made = [first]
    with ExitStack() as making:
        making.callback(close_all, made)
        if apart := own_robot(first, env_id, f"num_envs is 1, not {count}"):
            made.pop().close()
            given = {**given, **apart}
        with _side_by_side(first, count - len(made)):
            for index in range(len(made), count):
                with numbered(index, count):
                    made.append(make(given))
        making.pop_all()
    return [NumberedEnvironment(env, index, count) for index, env in enumerate(made)]


def close_all(envs: Sequence[gymnasium.Env[Any, Any]]) -> None:
    """Closes environments, all of them also where one fails.

    Raises:
        WorkbenchError: if one fails.
    """
    if not envs:
        return
    with _side_by_side(envs[0], len(envs)), ExitStack() as closing:
        for env in envs:
            closing.callback(env.close)


@contextmanager
def _side_by_side(env: gymnasium.Env[Any, Any], count: int) -> Iterator[None]:
    """Within it environments like `env` only begin to start, or to end; it waits for them all.

    Where they know nothing of that, they start and end one after the other.
    """
    waiting = _attribute(env, SIDE_BY_SIDE)
    try:
        with waiting(count) if waiting else nullcontext():
            yield
    except gymnasium.error.Error as error:  # its text is made for the user
        raise WorkbenchError(str(error) or type(error).__name__) from error


def _attribute(env: gymnasium.Env[Any, Any], name: str) -> Any:
    """None where it has none."""
    return env.get_wrapper_attr(name) if env.has_wrapper_attr(name) else None


def own_robot(env: gymnasium.Env[Any, Any], env_id: str, otherwise: str) -> dict[str, Any]:
    """The options by which a copy of an environment has a robot of its own; none where it has one anyway.

    Args:
        env: the environment.
        env_id: for the error.
        otherwise: what has to be done where there is but one robot, for the error.

    Raises:
        WorkbenchError: if there is but one robot.
    """
    if not shares_robot(env):
        return {}
    apart = _attribute(env, OWN_ROBOT)
    if not apart:
        raise WorkbenchError(f"{env_id} moves a robot that there is only one of: {otherwise}")
    return dict(apart)


@contextmanager
def numbered(index: int, count: int) -> Iterator[None]:
    """Tells which of several environments fails.

    Raises:
        WorkbenchError: the one that was raised inside, with the number before its text.
    """
    try:
        yield
    except WorkbenchError as error:
        text = f"environment {index + 1} of {count}: {error}"
        raise type(error)(text) from error.__cause__
