"""Several environments of a training, side by side: each has its number, and a robot of its own."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any

import gymnasium

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments.checked import CheckedEnvironment
from rl_workbench.training.environments.making import shares_robot

# Attribute of an environment that shares its robot: the options by which a copy has one of its own.
OWN_ROBOT = "own_robot_options"


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
    """Makes environments of which each moves a robot of its own; the caller closes them.

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
    with ExitStack() as making:
        making.callback(first.close)
        if shares_robot(first):
            apart = first.get_wrapper_attr(OWN_ROBOT) if first.has_wrapper_attr(OWN_ROBOT) else None
            if not apart:
                raise WorkbenchError(
                    f"{env_id} moves a robot that there is only one of: num_envs is 1, not {count}"
                )
            making.pop_all().close()
            given = {**given, **apart}
            first = make(given)
            making.callback(first.close)
        made = [NumberedEnvironment(first, 0, count)]
        for index in range(1, count):
            with numbered(index, count):
                made.append(NumberedEnvironment(make(given), index, count))
            making.callback(made[-1].close)
        making.pop_all()
    return list(made)


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
