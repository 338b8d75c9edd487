"""`demonstrate`: plays episodes by hand or by a policy, and writes each as its seed and actions."""

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import add_environment_flags, env_options, number
from rl_workbench.training.progress import tell
from web_viewer.address import add_flags as add_page_flags

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rl_workbench.training.checked import Env
    from rl_workbench.training.demonstrations import Demonstration, Origin, Recorder


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("--policy", metavar="MODULE:FUNCTION|RUN",
        help="a function of observation and environment that returns an action, or a run folder (default: "
        "a page in the browser, where keys or a gamepad drive)")  # fmt: skip
    add("--env-id", metavar="ID", help="Gymnasium's id of the environment (default: the run's)")
    add("--episodes", type=number(1), default=50, metavar="N", help="default 50")
    add("--out", type=Path, required=True, metavar="FOLDER",
        help="of the episodes; new ones come behind those that it has")  # fmt: skip
    add_environment_flags(parser)
    add_page_flags(parser)


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
            first = max([episode.seed + 1 for episode in before.values()], default=arguments.seed)
            seeds = range(first, first + arguments.episodes)
            if act:
                played = _by_policy(recorder, lambda seen: act(seen, env), seeds, interrupt)
            else:
                from rl_workbench.tools.by_hand import driven

                played = driven(recorder, env, seeds, interrupt, arguments)
            successes: list[bool | None] = []
            for episode in played:
                path = demonstrations.save(out, episode)
                words = {None: "", True: ", success", False: ", no success"}[episode.success]
                total = float(episode.rewards.sum())
                tell(f"{path}: return {total:.2f} in {len(episode.actions)} steps{words}")
                successes.append(episode.success)
    known = [each for each in successes if each is not None]
    text = f", {sum(known)} of {len(known)} with success" if known else ""
    tell(f"{out}: {len(successes)} new episodes{text}, {len(before) + len(successes)} in all")


def _by_policy(
    recorder: "Recorder", act: "Callable[[Any], Any]", seeds: range, interrupt: Interrupt
) -> "Iterator[Demonstration]":
    for seed in seeds:
        observation = recorder.begin(seed)
        while not recorder.has_ended:
            if interrupt.requested():
                return
            observation = recorder.step(act(observation))
        yield recorder.episode()


def _player(arguments: argparse.Namespace) -> "tuple[Callable[[Any, Env], Any] | None, Env, Origin]":
    """Returns what chooses actions, None for a hand, in which environment, and how that is made."""
    from rl_workbench.option import imported
    from rl_workbench.tools.policies import load_any
    from rl_workbench.tools.runs import open_run
    from rl_workbench.training.demonstrations import Origin
    from rl_workbench.training.environments import as_float32

    options, env_id = env_options(arguments), arguments.env_id
    if arguments.policy is None:
        from rl_workbench.tools.recording import draw_without_display

        if not env_id:
            raise WorkbenchError("--env-id names the environment to drive, or --policy who plays")
        draw_without_display()
        origin = Origin(env_id, options)
        return None, origin.make({"render_mode": "rgb_array"}), origin
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
