"""Behaviour cloning as an algorithm of the training loop: demonstrations are replayed, then learned from.

A step is one of the gradient; the environment is needed for the replay and for evaluations alone.
"""

import hashlib
from typing import Any

import numpy as np
from gymnasium import spaces

from rl_workbench.agents.cloning import CloningAgent
from rl_workbench.agents.policy_networks import Bounds
from rl_workbench.errors import WorkbenchError
from rl_workbench.training import demonstrations
from rl_workbench.training.algorithm import Algorithm, Policy, check_finite
from rl_workbench.training.checked import Env
from rl_workbench.training.checkpoints import fitting
from rl_workbench.training.environments import is_continuous
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.training import Training


def make(options: TrainingOptions, envs: list[Any]) -> "Cloning":
    """Makes a new training; see `algorithm`."""
    if not options.run.total_timesteps:
        raise WorkbenchError("bc needs total_timesteps: of its gradient")
    agent, env = make_agent(options, envs[0]), envs[0]
    observations, actions = [], []
    for episode in demonstrations.replayed(options.hyperparameters.demos, options.run, env):
        observations += [_side_by_side(env, played.observation) for played in episode[:-1]]
        actions += [played.action for played in episode[1:]]
    seen, taken = np.array(observations, np.float32), np.array(actions)
    agent.begin(seen, taken)
    digest = hashlib.blake2b(seen.tobytes() + taken.tobytes()).hexdigest()[:16]
    return Cloning(agent, env, digest, options.run.log_frequency)


def make_agent(options: TrainingOptions, env: Env) -> CloningAgent:
    """Makes a new agent for an environment."""
    run, space = options.run, env.action_space
    if is_continuous(space):
        actions: Bounds | int = Bounds(space.low, space.high)
    elif isinstance(space, spaces.Discrete) and space.start == 0:
        actions = int(space.n)
    else:
        raise WorkbenchError(f"bc needs actions of Box or Discrete(n); {run.env_id} has {space}")
    seen: Any = env.observation_space
    parts = seen.values() if isinstance(seen, spaces.Dict) else [seen]
    shapes: list[Any] = [part.shape for part in parts]
    return CloningAgent(options.hyperparameters, shapes, actions, run.seed, run.device)


def load_policy(options: TrainingOptions, content: dict[str, Any], env: Env) -> Policy:
    """Makes the policy of a checkpoint; see `algorithm`."""
    agent = make_agent(options, env)
    agent.load_state_dict(content["agent"])
    return Policy(lambda seen: agent.act_greedily(_side_by_side(env, seen)), agent.greedy_network())


def _side_by_side(env: Env, observation: Any) -> np.ndarray:
    return np.asarray(spaces.flatten(env.observation_space, observation), np.float32)


class Cloning(Algorithm):
    """Learns from the demonstrations; can be saved after each step."""

    def __init__(self, agent: CloningAgent, env: Env, digest: str, log_frequency: int) -> None:
        self._agent, self._env = agent, env
        self._digest, self._log_frequency = digest, log_frequency

    @property
    def steps(self) -> int:
        return self._agent.steps

    def act_greedily(self, observation: Any) -> Any:
        return self._agent.act_greedily(_side_by_side(self._env, observation))

    def learn(self, frame: Training) -> None:
        while not frame.is_over():
            loss = self._agent.learn()
            if self.steps % self._log_frequency == 0:
                frame.log.add(self.steps, {"losses/cloning": loss})
            frame.step_done()

    def check_weights(self) -> None:
        check_finite(self._agent.network.parameters())

    def state_dict(self) -> dict[str, Any]:
        self.check_weights()
        return {"agent": self._agent.state_dict(), "demonstrations": self._digest}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        if state.get("demonstrations") != self._digest:
            raise WorkbenchError("the demonstrations are others than those that this training began with")
        with fitting("agent"):
            self._agent.load_state_dict(state["agent"])
