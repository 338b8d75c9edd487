"""What a check is given: how the environment is made, and with what it is compared."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import gymnasium

from robot_envs.environment import RobotEnv

Make = Callable[..., gymnasium.Env[Any, Any]]


@dataclass(frozen=True)
class Subject:
    """An environment to check.

    Args:
        make: makes one, from options.
        options: that it is made with.
        identifier: Gymnasium's; None: it has none.
        steps: of a rollout.
        backend: by name.
    """

    make: Make
    options: dict[str, Any] = field(default_factory=dict)
    identifier: str | None = None
    steps: int = 100
    backend: str | None = None

    @contextlib.contextmanager
    def made(self, **options: Any) -> Iterator[RobotEnv]:
        """A new one, without wrappers, which is closed in the end."""
        env = self.make(**{**self._all_options, **options}).unwrapped
        try:
            expect(isinstance(env, RobotEnv), f"it is {env!r}, and no robot_envs.RobotEnv")
            yield env  # type: ignore[misc]
        finally:
            env.close()

    @property
    def _all_options(self) -> dict[str, Any]:
        return self.options if self.backend is None else {**self.options, "backend": self.backend}

    def over(self, backend: str | None) -> "Subject":
        """The same over another backend."""
        return replace(self, backend=backend)


def expect(right: bool, otherwise: str) -> None:
    """Holds a promise against what was seen.

    Raises:
        AssertionError: with that text, if it isn't kept.
    """
    if not right:
        raise AssertionError(otherwise)


def expect_error(call: Callable[[], Any], what: str, *kinds: type[Exception]) -> None:
    """Holds a promise to refuse something against what a call does.

    Args:
        call: what is to be refused.
        what: the call, in words.
        kinds: of errors that are right.

    Raises:
        AssertionError: if it raises nothing, or something else.
    """
    wanted = " or ".join(kind.__name__ for kind in kinds)
    try:
        call()
    except kinds:
        return
    except Exception as error:
        text = " ".join(str(error).split())
        raise AssertionError(
            f"{what} raises {type(error).__name__} ({text}), not {wanted}"
        ) from error
    raise AssertionError(f"{what} raises nothing, and not {wanted}")
