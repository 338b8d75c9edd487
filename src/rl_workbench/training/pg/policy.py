"""Agents for environments: new ones, and those that a training left in its folder."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import gymnasium

from rl_workbench.agents.pg.document import (
    GAMMA,
    POLICY_LEARNING_RATE,
    VALUE_LEARNING_RATE,
    PolicyGradientAgent,
)
from rl_workbench.agents.pg.reinforce import ReinforceAgent
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.pg.settings import Choice, from_config
from rl_workbench.training.run.environments import discrete_actions, make_environment

SCALE = (0.4, 1.0, 0.2, 2.0)  # [m], [m/s], [rad], [rad/s]: what an observation comes to

Agent = PolicyGradientAgent | ReinforceAgent


class Policy(NamedTuple):
    """A learned agent and an environment of the kind it learned in; the caller closes that."""

    agent: Agent
    env: gymnasium.Env[Any, Any]
    choice: Choice


def make_agent(choice: Choice, env: gymnasium.Env[Any, Any]) -> Agent:
    """A new agent for an environment.

    Raises:
        WorkbenchError: if the environment's actions don't suit it; says what does.
    """
    run = choice.run
    if run.algorithm == "document":
        return PolicyGradientAgent(run.seed, run.random_weights)
    actions = discrete_actions(env, run.env_id, "REINFORCE")
    (size,) = env.observation_space.shape or (0,)
    scale = SCALE if run.is_robot else (1.0,) * size
    return ReinforceAgent(run.seed, scale, choice.gae, actions)


def hyperparameters(choice: Choice) -> dict[str, Any]:
    """The algorithm's options, or the document's constants."""
    if choice.run.algorithm == "gae":
        return asdict(choice.gae)
    return {
        "gamma": GAMMA,
        "policy_learning_rate": POLICY_LEARNING_RATE,
        "value_learning_rate": VALUE_LEARNING_RATE,
    }


def policy_of(content: dict[str, Any], origin: str, env_options: Mapping[str, Any]) -> Policy:
    """The agent of a checkpoint that was read already.

    Args:
        content: what `run_checkpoints.read` gave.
        origin: its file, for the errors.
        env_options: further options of the environment, as `render_mode`.

    Raises:
        WorkbenchError: if it isn't policy gradient's, or its environment can't be made.
    """
    choice = from_config(content.get("config"), origin)
    env = make_environment(choice.run.env_id, {**choice.run.env_kwargs, **env_options})
    try:
        agent = make_agent(choice, env)
        restore(agent, content, origin)
    except WorkbenchError:
        env.close()
        raise
    return Policy(agent, env, choice)


def restore(agent: Agent, content: dict[str, Any], origin: str) -> None:
    """Gives an agent the state that a checkpoint holds.

    Raises:
        WorkbenchError: if it holds another one's.
    """
    try:
        agent.load_state_dict(content["agent"])
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise WorkbenchError(f"{origin} doesn't hold the agent that it tells of") from error
