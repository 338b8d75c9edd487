"""`demonstrate`: plays episodes by a policy, and writes each as its seed and actions."""

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import add_environment_flags, env_options, number
from rl_workbench.training.progress import tell

if TYPE_CHECKING:
    from collections.abc import Callable

    from rl_workbench.training.checked import Env
    from rl_workbench.training.demonstrations import Origin


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("--policy", required=True, metavar="MODULE:FUNCTION|RUN",
        help="a function of observation and environment that returns an action, or a run folder")  # fmt: skip
    add("--env-id", metavar="ID", help="Gymnasium's id of the environment (default: the run's)")
    add("--episodes", type=number(1), default=50, metavar="N", help="default 50")
    add("--out", type=Path, required=True, metavar="FOLDER",
        help="of the episodes; new ones come behind those that it has")  # fmt: skip
    add_environment_flags(parser)


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Plays the episodes and writes those that have ended. Seeds count on from those of the folder."""
    from rl_workbench.training import demonstrations
    from rl_workbench.training.folder import held

    out = arguments.out
    act, env, origin = _player(arguments)
    with closing(env):
        recorder = demonstrations.Recorder(env, origin)
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise WorkbenchError(f"can't write to {out}: {error.strerror}") from error
        with held(out, "a recording"):
            before = demonstrations.load_all(out) if demonstrations.paths(out) else {}
            for path, episode in before.items():
                if episode.origin != origin:
                    raise WorkbenchError(f"{path} is of {episode.env_id}, or of other options: another "
                                         "--out keeps them apart")  # fmt: skip
            seed = max([episode.seed + 1 for episode in before.values()], default=arguments.seed)
            successes: list[bool | None] = []
            for number_of in range(arguments.episodes):
                observation = recorder.begin(seed + number_of)
                while not recorder.has_ended and not interrupt.requested():
                    observation = recorder.step(act(observation, env))
                if not recorder.has_ended:
                    break
                episode = recorder.episode()
                path = demonstrations.save(out, episode)
                words = {None: "", True: ", success", False: ", no success"}[episode.success]
                total = float(episode.rewards.sum())
                tell(f"{path}: return {total:.2f} in {len(episode.actions)} steps{words}")
                successes.append(episode.success)
    known = [each for each in successes if each is not None]
    text = f", {sum(known)} of {len(known)} with success" if known else ""
    tell(f"{out}: {len(successes)} new episodes{text}, {len(before) + len(successes)} in all")


def _player(arguments: argparse.Namespace) -> "tuple[Callable[[Any, Env], Any], Env, Origin]":
    """Returns what chooses actions, in which environment, and how that is made."""
    from rl_workbench.option import imported
    from rl_workbench.tools.policies import load_any
    from rl_workbench.tools.runs import open_run
    from rl_workbench.training.demonstrations import Origin
    from rl_workbench.training.environments import as_float32

    options, env_id = env_options(arguments), arguments.env_id
    if ":" in arguments.policy:
        if not env_id:
            raise WorkbenchError("--policy MODULE:FUNCTION needs an --env-id")
        policy: Any = imported(arguments.policy, "--policy")
        if not callable(policy):
            raise WorkbenchError(f"--policy {arguments.policy}: it is no function")
        origin = Origin(env_id, options)
        return policy, origin.make(), origin
    run = open_run(Path(arguments.policy))
    origin = Origin(run.env_id, {**run.env_kwargs, **options}, run.wrapper)
    if env_id and not origin.same_id(env_id):
        raise WorkbenchError(f"{run.folder} learned in {run.env_id}, not in {env_id}")
    player = load_any(run, "best", options, arguments.seed)
    return lambda seen, _: player.act(as_float32(seen)), player.env, origin
