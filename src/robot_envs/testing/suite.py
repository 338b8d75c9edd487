"""The conformance suite: all checks, over all backends, told together."""

import contextlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import gymnasium
from gymnasium.utils.env_checker import check_env

from robot_envs.backends import IN_PROCESS, MUJOCO, REALTIME
from robot_envs.testing import episodes, repetition
from robot_envs.testing.rollouts import Make, Subject, expect

STEPS = 100
# What Gymnasium's checker says of robots whose places have no bounds, and of those that have no id.
FINE = ("space minimum value is -infinity", "space maximum value is infinity", "not having a spec")


def check_robot_env(
    env: str | Make,
    backends: Sequence[str] = (IN_PROCESS,),
    *,
    options: dict[str, Any] | None = None,
    steps: int = STEPS,
) -> None:
    """Checks that an environment keeps what environments of robots promise.

    Over each backend: observations lie in their space and are finite, flags are plain, the same seed and
    actions give the same bits (again, after other episodes, in another instance, with steps that are begun
    before they are taken, over every backend but real time), wrong actions and options are refused and
    move nothing, an episode is cut off apart from its end, reset knows its options, spec can be copied and
    sent, pictures show what moves, a closed environment says so, goals have rewards that agree, and
    Gymnasium's own checker has nothing to say. In this process also: vectors give what each gives
    alone.

    Args:
        env: an id, "my_arm/Reach-v0" or "my_module:my_arm/Reach-v0"; or a function that makes an
            environment from keyword arguments, which are `RobotEnv`'s.
        backends: names of them.
        options: that it is made with.
        steps: of each rollout.

    Raises:
        AssertionError: lists what isn't kept, and errors of the environment's own; a line each.
    """
    if isinstance(env, str):
        identifier = env

        def make(**given: Any) -> gymnasium.Env[Any, Any]:
            return gymnasium.make(identifier, **given)

        subject = Subject(make, dict(options or {}), identifier, steps)
    else:
        subject = Subject(env, dict(options or {}), None, steps)
    faults: dict[str, Exception] = {}
    same = [name for name in backends if name not in (REALTIME, MUJOCO)]
    for backend in backends:
        over = subject.over(backend)
        for check in CHECKS:
            _hold(check, f"over {backend}", faults, over)
        if backend in same[1:]:
            _hold(repetition.backends, f"over {backend}", faults, subject.over(same[0]), over)
    if IN_PROCESS in backends:
        _hold(repetition.vectors, "in this process", faults, subject)
    if faults:
        listed = "".join(f"\n- {each}" for each in faults)
        others = (each for each in faults.values() if not isinstance(each, AssertionError))
        raise AssertionError(f"{subject.identifier or 'the environment'}:{listed}") from next(
            others, None
        )


def gymnasiums_checker(subject: Subject) -> None:
    """Gymnasium's own checker has nothing to say, and nothing warns."""
    with _warnings() as told, subject.made() as env:
        check_env(env)
    expect(not told, f"Gymnasium's checker warns: {' '.join(told)}")


@contextlib.contextmanager
def _warnings() -> Iterator[list[str]]:
    """Texts of those in it; rospy warns of Python's renamed methods, in threads of its own."""
    told: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield told
    told += [
        str(each.message)
        for each in caught
        if "/rospy/" not in each.filename and not any(text in str(each.message) for text in FINE)
    ]


CHECKS: tuple[Callable[[Subject], None], ...] = (
    episodes.observations,
    episodes.observations_are_new,
    episodes.ends,
    episodes.beginnings,
    episodes.wrong_actions,
    episodes.wrong_options,
    episodes.closed,
    episodes.pictures,
    episodes.goals,
    repetition.seeding,
    repetition.two_phases,
    repetition.specification,
    gymnasiums_checker,
)


def _hold(
    check: Callable[..., None], where: str, faults: dict[str, Exception], *subjects: Subject
) -> None:
    """Carries out a check; what it finds, or runs into, joins the faults."""
    name = f"{check.__name__.replace('_', ' ')} ({where})"
    try:
        check(*subjects)
    except AssertionError as error:
        faults[f"{name}: {' '.join(str(error).split())}"] = error
    except Exception as error:  # noqa: BLE001 - the cause of the error that tells all faults
        text = f"{type(error).__name__}: {' '.join(str(error).split())}"
        if not any(each.endswith(text) for each in faults):  # several checks run into one
            faults[f"{name}: {text}"] = error
