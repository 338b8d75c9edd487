"""The environments of a training: made by Gymnasium's id, in the form that an agent needs.

Environments may have attributes that they are asked for by name: `shares_robot` (true if all copies move the
same robot), `own_robot_options` (the options by which a copy has a robot of its own), `same_robot_options`
(the values of options with which a copy moves the same robot, lists by name; without it, any copy does),
`side_by_side(count)` (a context manager within which that many start, or close, at the same time), and
`max_steps` (after how many steps it truncates an episode; None: never).
"""

import hashlib
import inspect
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeGuard

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench import errors
from rl_workbench.env_ids import import_module_of, spec_of
from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line
from rl_workbench.option import imported
from rl_workbench.training.checked import CheckedEnvironment, Env
from rl_workbench.training.options import TrainingOptions

_CODE = re.compile(r"[\w.]+:[\w.]+")  # module:name
# What constructors raise for options that they reject.
_REFUSED = (gymnasium.error.Error, ImportError, TypeError, ValueError, LookupError, AssertionError)


def make_environment(
    env_id: str,
    options: Mapping[str, Any] | None = None,
    *,
    keep_dict: bool = False,
    which: str = "",
    wrapper: str = "",
) -> CheckedEnvironment:
    """Makes an environment that refuses observations and rewards that aren't finite.

    `keep_dict` leaves a Dict of arrays, and images, as they are; other observations are flattened to a vector
    (D,). `which` begins the errors while it runs, as "environment 2 of 3: ". `wrapper` is a function that
    wraps it, as module:function. Raises WorkbenchError if there is no such environment, something that it
    needs isn't installed, its options make no sense, or it observes images that can't be learned from.
    """
    import_module_of(env_id)
    _check_names(env_id, options or {})
    wrap: Any = imported(wrapper, "--wrapper") if wrapper else lambda env: env
    if isinstance(wrap, type) and not issubclass(wrap, gymnasium.Env):
        raise WorkbenchError(f"--wrapper {wrapper}: it is no gymnasium.Wrapper")
    with ExitStack() as refused:
        try:
            env: Env = gymnasium.make(env_id, **(options or {}))
            refused.callback(env.close)
            env = wrap(env)
            if not isinstance(env, gymnasium.Env):
                raise TypeError(f"--wrapper {wrapper} returns {env!r}, which is no gymnasium.Env")
            refused.pop_all()
            refused.callback(env.close)  # through the wrapper
        except gymnasium.error.DependencyNotInstalled as error:
            extras = errors.hints.extras  # else Gymnasium's own text names the command
            hint = f" ({extras} may install them)" if extras else ""
            raise WorkbenchError(f"{env_id} needs more packages{hint}: {error}") from error
        except gymnasium.error.UnregisteredEnv as error:
            form = " One of your own is named with its module, as in my_module:my_robot/Reach-v0."
            hint = "" if ":" in env_id else form
            raise WorkbenchError(f"can't make {env_id}: {error}{hint}") from error
        except _REFUSED as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise WorkbenchError(f"can't make {env_id}: {reason}") from error
        except (Exception, SystemExit) as error:
            raise EnvironmentFailure(f"can't make {env_id}: {error_line(error)}") from error
        suited = _suited(env, env_id, keep_dict)
        refused.pop_all()
    return CheckedEnvironment(suited, env_id, which)


def _check_names(env_id: str, options: Mapping[str, Any]) -> None:
    """Refuses other code than the registration names: options may come from the record of a foreign run."""
    spec = spec_of(env_id)
    for name, value in (spec.kwargs if spec else {}).items():
        is_code = isinstance(value, str) and _CODE.fullmatch(value)
        if is_code and options.get(name, value) != value:
            raise WorkbenchError(f"can't make {env_id}: its {name} is {value}; no option changes it")


def _suited(env: Env, env_id: str, keep_dict: bool) -> Env:
    """Returns an environment whose observations are vectors, or in a form that is to be kept."""
    space = env.observation_space
    parts = list(space.values()) if isinstance(space, spaces.Dict) else [space]
    keeps = keep_dict and all(isinstance(part, spaces.Box) for part in parts)
    for part in filter(is_image, parts):
        _check_image(env_id, part, keeps)
    if isinstance(space, spaces.Box) and len(space.shape) == 1:
        return env
    if keeps and (isinstance(space, spaces.Dict) or is_image(space)):
        return env
    if not space.is_np_flattenable:
        raise WorkbenchError(f"{env_id} observes {space}; agents learn only from vectors of numbers")
    return gymnasium.wrappers.FlattenObservation(env)


def environment_for(
    options: TrainingOptions, given: Mapping[str, Any], which: str = ""
) -> CheckedEnvironment:
    """Makes an environment as a training's algorithm observes it."""
    return make_environment(
        options.run.env_id, given, keep_dict=options.kind.keeps_dict, which=which,
        wrapper=options.run.wrapper,
    )  # fmt: skip


def training_environments(options: TrainingOptions) -> list[CheckedEnvironment]:
    """Makes the `num_envs` environments of a training, for `close_all`, each with a robot of its own."""
    run, given = options.run, options.run.training_environment
    count = run.num_envs
    first = environment_for(options, given, _which(0, count))
    made = [first]
    with ExitStack() as making:
        making.callback(close_all, made)
        if count > 1 and shares_robot(first):
            own_robot = _attribute(first, "own_robot_options")
            if not own_robot:
                raise WorkbenchError(
                    f"{run.env_id} moves a robot that there is only one of: num_envs must be 1, not {count}"
                )
            made.pop().close()
            given = {**given, **own_robot}
        with _side_by_side(first, count - len(made)):
            for index in range(len(made), count):
                which = _which(index, count)
                try:
                    made.append(environment_for(options, given, which))
                except WorkbenchError as error:
                    raise type(error)(f"{which}{error}") from error.__cause__
        making.pop_all()
    return made


def _which(index: int, count: int) -> str:
    return f"environment {index + 1} of {count}: " if count > 1 else ""


def close_all(envs: Sequence[Env]) -> None:
    """Closes environments, the others too if one fails."""
    if not envs:
        return
    with _side_by_side(envs[0], len(envs)), ExitStack() as closing:
        for env in envs:
            closing.callback(env.close)


@contextmanager
def _side_by_side(env: Env, count: int) -> Iterator[None]:
    """Lets environments like `env` start or close at the same time, if they can."""
    waiting = _attribute(env, "side_by_side")
    try:
        with waiting(count) if waiting and count else nullcontext():
            yield
    except gymnasium.error.Error as error:  # its text is made for the user
        raise WorkbenchError(str(error) or type(error).__name__) from error


def shares_robot(env: Env) -> bool:
    """Returns whether another environment of this kind would move the same robot."""
    return bool(_attribute(env, "shares_robot"))


def robot_options(env: Env, given: Mapping[str, Any]) -> dict[str, list[Any]] | None:
    """Returns the values of options with which other environments move the same robot; None if none does."""
    if not shares_robot(env):
        return None
    named = _attribute(env, "same_robot_options") or {}
    return {name: [given.get(name), *values] for name, values in named.items()}


def source_digest(env: Env) -> str:
    """Returns the digest of the files that the environment's task is written in, or else its class.

    Those of Python, Gymnasium and abstract classes don't count: other versions of them are the same task.
    """
    kinds = type(_attribute(env, "task") or env.unwrapped).__mro__
    names = dict.fromkeys(kind.__module__ for kind in kinds if not inspect.isabstract(kind))
    modules = [
        sys.modules.get(name)
        for name in names
        if name.partition(".")[0] not in sys.stdlib_module_names | {"gymnasium", "builtins"}
    ]
    paths = [Path(path) for each in modules if (path := getattr(each, "__file__", None))]
    content = b"".join(path.read_bytes() for path in paths if path.is_file())
    return hashlib.sha256(content).hexdigest()


def _attribute(env: Env, name: str) -> Any:
    return env.get_wrapper_attr(name) if env.has_wrapper_attr(name) else None


SMALLEST_IMAGE = 36  # [pixels], of each side, as Stable-Baselines3's CNN needs


def is_image(space: gymnasium.Space[Any]) -> TypeGuard[spaces.Box]:
    """Returns whether observations are images, or a stack of them; smaller arrays are numbers."""
    if not isinstance(space, spaces.Box) or len(space.shape) < 2:
        return False
    is_large = sorted(space.shape)[-2] >= SMALLEST_IMAGE
    return is_large and (len(space.shape) > 2 or space.dtype == np.uint8)


def _check_image(env_id: str, image: spaces.Box, keeps: bool) -> None:
    """Refuses images that would be learned as a vector, or that Stable-Baselines3's CNN doesn't take."""
    is_full = bool(np.all(image.low == 0) and np.all(image.high == 255))
    if keeps and image.dtype == np.uint8 and len(image.shape) == 3 and is_full:
        return
    hint = "a CNN takes uint8 from 0 to 255 of (height, width, channels); --wrapper may make them"
    if not keeps:
        hint = "this algorithm learns from vectors. Stable-Baselines3's have a CNN: --algo ppo, a2c or "
        hint += "dqn-sb3, for continuous actions sac, td3 or ddpg"
    raise WorkbenchError(f"{env_id} observes images, {image.dtype} of {image.shape}: {hint}")


def has_goal(space: gymnasium.Space[Any]) -> bool:
    """Returns whether observations contain a goal, in Gymnasium-Robotics' form."""
    goal = {"observation", "achieved_goal", "desired_goal"}
    return isinstance(space, spaces.Dict) and goal <= space.keys()


def is_continuous(space: gymnasium.Space[Any]) -> TypeGuard[spaces.Box]:
    """Returns whether actions are arrays of real numbers."""
    return isinstance(space, spaces.Box) and np.issubdtype(space.dtype, np.floating)


def discrete_actions(env: Env, env_id: str, algorithm: str) -> int:
    """Returns the number of discrete actions; else raises WorkbenchError, which names algorithms that fit."""
    space = env.action_space
    if isinstance(space, spaces.Discrete) and space.start == 0:
        return int(space.n)
    fits = "Stable-Baselines3's ppo or a2c"
    if isinstance(space, spaces.Box):
        fits = "reinforce, or Stable-Baselines3's ppo, a2c, sac, td3 or ddpg"
    raise WorkbenchError(
        f"{algorithm} needs discrete actions, Discrete(n); {env_id} has {space}. --algo {fits}: these fit it"
    )


def as_float32(observation: Any) -> Any:
    """Returns an observation as networks take it: an array, or a dict of arrays."""
    if isinstance(observation, dict):
        return {name: np.asarray(part, np.float32) for name, part in observation.items()}
    return np.asarray(observation, np.float32)


def as_vector(observation: Any) -> np.ndarray:
    """Returns a copy of all numbers of an observation, (D,), float32: an environment may reuse its array."""
    if isinstance(observation, dict):
        return np.concatenate([np.ravel(part) for part in observation.values()], dtype=np.float32)
    return np.array(observation, dtype=np.float32)


def succeeded(info: Mapping[str, Any]) -> bool | None:
    """Returns whether the episode that ends with this info succeeded; None if it doesn't say."""
    value = info.get("is_success")
    return None if value is None else bool(np.all(value))
