"""Agents for environments: new ones, and those that a training left in its folder."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium

from cartpole.agents.policy_gradient import (
    GAMMA,
    POLICY_LEARNING_RATE,
    VALUE_LEARNING_RATE,
    PolicyGradientAgent,
)
from cartpole.agents.reinforce import ReinforceAgent
from cartpole.errors import CartpoleError
from cartpole.training.environments import discrete_actions, make_environment
from cartpole.training.pg_settings import Choice, from_config
from cartpole.training.run_checkpoints import LAST, candidates, read

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
        CartpoleError: if the environment's actions don't suit it; says what does.
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


def load_policy(path: Path, **env_options: Any) -> Policy:
    """The agent of a checkpoint; of a run folder the best one, or else the last.

    Args:
        path: a checkpoint or a run folder.
        env_options: further options of the environment, as `render_mode`.

    Raises:
        CartpoleError: if it can't be read, or its environment can't be made.
    """
    if path.is_dir():
        path = next(iter(candidates(path, best_first=True)), path / LAST)
    content = read(path)
    choice = from_config(content.get("config"), str(path))
    env = make_environment(choice.run.env_id, {**choice.run.env_kwargs, **env_options})
    try:
        agent = make_agent(choice, env)
        restore(agent, content, str(path))
    except CartpoleError:
        env.close()
        raise
    return Policy(agent, env, choice)


def restore(agent: Agent, content: dict[str, Any], origin: str) -> None:
    """Gives an agent the state that a checkpoint holds.

    Raises:
        CartpoleError: if it holds another one's.
    """
    try:
        agent.load_state_dict(content["agent"])
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise CartpoleError(f"{origin} doesn't hold the agent that it tells of") from error
