"""Agents for environments: new ones, and those that a training left in its folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium

from rl_workbench.agents.dqn.agent import DQNAgent
from rl_workbench.agents.dqn.settings import DQNSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn.settings import RunSettings, from_config
from rl_workbench.training.run.checkpoints import LAST, candidates, read
from rl_workbench.training.run.environments import discrete_actions, make_environment


class Policy(NamedTuple):
    """A learned agent and an environment of the kind it learned in; the caller closes that."""

    agent: DQNAgent
    env: gymnasium.Env[Any, Any]
    run: RunSettings
    steps: int  # that it had learned from


def make_agent(run: RunSettings, dqn: DQNSettings, env: gymnasium.Env[Any, Any]) -> DQNAgent:
    """A new agent for an environment.

    Raises:
        WorkbenchError: if the environment's actions don't suit DQN, or torch lacks the device.
    """
    actions = discrete_actions(env, run.env_id, "DQN")
    shape = env.observation_space.shape or (0,)
    try:
        return DQNAgent(dqn, shape[0], actions, run.seed, run.device)
    except (RuntimeError, AssertionError) as error:
        text = str(error).splitlines()[0]
        raise WorkbenchError(f"torch can't use the device {run.device!r}: {text}") from error


def load_policy(path: Path, **env_options: Any) -> Policy:
    """The agent of a checkpoint; of a run folder the best one, or else the last.

    Args:
        path: a checkpoint or a run folder.
        env_options: further options of the environment, as `render_mode`.

    Raises:
        WorkbenchError: if it can't be read, or its environment can't be made.
    """
    if path.is_dir():
        path = next(iter(candidates(path, best_first=True)), path / LAST)
    return policy_of(read(path), str(path), env_options)


def policy_of(content: dict[str, Any], origin: str, env_options: Mapping[str, Any]) -> Policy:
    """The agent of a checkpoint that was read already.

    Args:
        content: what `run_checkpoints.read` gave.
        origin: its file, for the errors.
        env_options: further options of the environment, as `render_mode`.

    Raises:
        WorkbenchError: if it isn't DQN's, or its environment can't be made or has changed.
    """
    run, dqn = from_config(content.get("config"), origin)
    env = make_environment(run.env_id, {**run.env_kwargs, **env_options})
    try:
        agent = make_agent(run, dqn, env)
        agent.load_policy_state(content)
        return Policy(agent, env, run, content["steps"])
    except (WorkbenchError, RuntimeError, KeyError) as error:
        env.close()
        reason = str(error).splitlines()[0]
        raise WorkbenchError(f"{origin} doesn't fit {run.env_id}: {reason}") from error
