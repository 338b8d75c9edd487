"""`eval`: plays greedy or random episodes of a run, and prints their statistics."""

import argparse
import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import POLICIES, RANDOM, add_policy_flags, env_options, number
from rl_workbench.training.progress import tell

if TYPE_CHECKING:
    from rl_workbench.training.evaluator import Evaluation


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add_policy_flags(parser, POLICIES)
    parser.add_argument("--episodes", type=number(1), default=100, metavar="N", help="default 100")
    parser.add_argument("--json", type=Path, metavar="FILE",
                        help="the figures; - for standard output")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Plays the episodes; prints a line for each and a summary."""
    from rl_workbench.env_ids import threshold
    from rl_workbench.storage import as_json, check_writable, write_file
    from rl_workbench.tools.policies import load_any, play
    from rl_workbench.tools.runs import open_run

    run = open_run(arguments.run)
    to_stdout = str(arguments.json) == "-"
    if arguments.json and not to_stdout:
        check_writable(arguments.json)
    policy = load_any(run, arguments.checkpoint, env_options(arguments), arguments.seed)
    with closing(policy.env):
        result = play(policy, arguments.episodes, arguments.seed)
    line = threshold(run.env_id)
    checkpoint = str(policy.checkpoint or RANDOM)
    figures = {"run": str(run.folder), "checkpoint": checkpoint, **statistics(result, line)}
    # With JSON on standard output, the text goes to standard error.
    stream = sys.stderr if to_stdout else sys.stdout
    tell(episode_lines(result), stream)
    tell(_summary(figures, line), stream)
    if to_stdout:
        tell(json.dumps(figures, indent=1))
    elif arguments.json:
        write_file(arguments.json, as_json(figures))


def statistics(result: "Evaluation", threshold: float | None) -> dict[str, Any]:
    """Returns statistics of episodes as plain numbers, for JSON; `threshold` is the return that solves."""
    import numpy as np

    returns = np.array(result.returns)
    return {
        "episodes": len(returns),
        "mean": float(returns.mean()),
        "std": float(returns.std()),
        "min": float(returns.min()),
        "max": float(returns.max()),
        "success_rate": result.success_rate,
        "solved": None if threshold is None else bool(returns.mean() >= threshold),
        "returns": result.returns,
        "lengths": result.lengths,
        "successes": result.successes,
    }


def episode_lines(result: "Evaluation") -> str:
    """Returns a line for each episode."""
    lines = [
        f"episode {index:4d} | return {total:9.2f} | length {length:5d}"
        for index, (total, length) in enumerate(zip(result.returns, result.lengths, strict=True))
    ]
    if len(result.successes) == len(lines):
        words = ["success" if each else "no success" for each in result.successes]
        lines = [f"{line} | {word}" for line, word in zip(lines, words, strict=True)]
    return "\n".join(lines)


def _summary(found: dict[str, Any], threshold: float | None) -> str:
    kind = "random" if found["checkpoint"] == RANDOM else "greedy"
    line = f"mean {found['mean']:.2f} ± {found['std']:.2f} over {found['episodes']} {kind} episodes"
    line += f" (min {found['min']:.2f}, max {found['max']:.2f})"
    if found["success_rate"] is not None:
        line += f"; success {found['success_rate']:.0%}"
    if threshold is not None:
        line += f"; {'solved' if found['solved'] else 'not solved'}: the threshold is {threshold:g}"
    return line
