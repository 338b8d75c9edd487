"""The conformance suite: runs all checks over all backends, and reports all faults together."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
from gymnasium.utils.env_checker import check_env

from robot_envs.backends import IN_PROCESS, MUJOCO, REALTIME
from robot_envs.testing import episodes, repetition
from robot_envs.testing.rollouts import Make, Subject

STEPS = 100
# Warnings of Gymnasium's checker for observations without bounds, and environments without an id.
FINE = ("space minimum value is -infinity", "space maximum value is infinity", "not having a spec")


def check_robot_env(
    env: str | Make,
    backends: Sequence[str] = (IN_PROCESS,),
    *,
    options: dict[str, Any] | None = None,
    steps: int = STEPS,
) -> None:
    """Checks that an environment does what environments of this library promise.

    Over each backend: observations are in their space and finite; flags are plain bools; the same seed and
    actions are bit-identical (again, after other episodes, in another instance, from a snapshot, with
    `begin_step`, and over every backend but real time); wrong actions and options are refused and move
    nothing; truncation isn't termination; reset knows its options; the spec can be copied and pickled;
    pictures show motion; a closed environment says so; rewards of goals agree; and Gymnasium's own checker
    finds nothing. In this process also: vectors are bit-identical to environments alone. Raises
    AssertionError, which lists broken promises and the environment's own errors, a line each; RuntimeError
    under `python -O`.

    Args:
        env: An id, "my_arm/Reach-v0" or "my_module:my_arm/Reach-v0"; or a function that makes an
            environment from keyword arguments, which are `RobotEnv`'s.
        backends: Names of them.
        options: That it is made with.
        steps: Steps of each rollout.
    """
    if not __debug__:
        raise RuntimeError("check_robot_env checks by assert statements: run Python without -O")
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
            _run(check, f"over {backend}", faults, over)
        if backend in same[1:]:
            _run(repetition.backends, f"over {backend}", faults, subject.over(same[0]), over)
    if IN_PROCESS in backends:
        _run(repetition.vectors, "in this process", faults, subject)
    if faults:
        listed = "".join(f"\n- {each}" for each in faults)
        others = (each for each in faults.values() if not isinstance(each, AssertionError))
        raise AssertionError(f"{subject.identifier or 'the environment'}:{listed}") from next(others, None)


def gymnasiums_checker(subject: Subject) -> None:
    """Gymnasium's own checker finds nothing, and nothing warns."""
    with warnings.catch_warnings(record=True) as caught, subject.made() as env:
        warnings.simplefilter("always")
        check_env(env)
    # rospy warns of renamed methods of Python, from its own threads
    texts = [str(each.message) for each in caught if "/rospy/" not in each.filename]
    texts = [each for each in texts if not any(text in each for text in FINE)]
    assert not texts, f"Gymnasium's checker warns: {' '.join(texts)}"


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
    repetition.snapshots,
    repetition.specification,
    gymnasiums_checker,
)


def _run(check: Callable[..., None], where: str, faults: dict[str, Exception], *subjects: Subject) -> None:
    """Runs a check, and adds its failure or error to the faults."""
    name = f"{check.__name__.replace('_', ' ')} ({where})"
    try:
        check(*subjects)
    except AssertionError as error:
        faults[f"{name}: {' '.join(str(error).split())}"] = error
    except Exception as error:  # noqa: BLE001 - the cause of the error that lists all faults
        text = f"{type(error).__name__}: {' '.join(str(error).split())}"
        if not any(each.endswith(text) for each in faults):  # several checks meet the same one
            faults[f"{name}: {text}"] = error
