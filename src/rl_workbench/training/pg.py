"""Policy gradients as algorithms of the training loop: a round of episodes, then learning."""

from pathlib import Path
from typing import Any

import numpy as np

from rl_workbench.agents.document import PolicyGradientAgent
from rl_workbench.agents.policy_gradient import Episode, Losses
from rl_workbench.agents.policy_networks import Bounds
from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.agents.settings import DocumentSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import save_tensors
from rl_workbench.training.algorithm import Algorithm, Policy, Say
from rl_workbench.training.checked import Env
from rl_workbench.training.checkpoints import fitting
from rl_workbench.training.environments import discrete_actions, is_continuous
from rl_workbench.training.episodes import Agent, EpisodeSource
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.training import Training


def make(options: TrainingOptions, envs: list[Any]) -> "PolicyGradientTraining":
    """Makes a new training; see `algorithm`."""
    agent = make_agent(options, envs[0])
    source = EpisodeSource(envs, agent, options.run.seed)
    return PolicyGradientTraining(agent, source, options.hyperparameters.save_every)


def make_agent(options: TrainingOptions, env: Env) -> Agent:
    """Makes a new agent for an environment."""
    run, settings = options.run, options.hyperparameters
    (size,) = env.observation_space.shape or (0,)
    space = env.action_space
    if is_continuous(space) and not isinstance(settings, DocumentSettings):
        actions: int | Bounds = Bounds(space.low, space.high)
    else:
        actions = discrete_actions(env, run.env_id, "REINFORCE")
    if isinstance(settings, DocumentSettings):
        if (size, actions) != (4, 2):
            raise WorkbenchError(
                f"{options.kind.name} needs 4 observations and 2 actions; {run.env_id} has {size} "
                f"and {actions}: --algo reinforce learns in it"
            )
        return PolicyGradientAgent(run.seed, settings)
    if settings.observation_scale and len(settings.observation_scale) != size:
        raise WorkbenchError(
            f"observation_scale has {len(settings.observation_scale)} numbers, the observations of "
            f"{run.env_id} {size}"
        )
    scale = settings.observation_scale or (1.0,) * size
    return ReinforceAgent(run.seed, scale, settings, actions, run.num_envs)


def load_policy(options: TrainingOptions, content: dict[str, Any], env: Env) -> Policy:
    """Makes the policy of a checkpoint; see `algorithm`."""
    if not isinstance(content["agent"], dict):  # a tensor would be indexed by names
        raise TypeError("it holds no agent")
    agent = make_agent(options, env)
    agent.load_state_dict(content["agent"])
    return Policy(agent.act_greedily, agent.greedy_network())


class PolicyGradientTraining(Algorithm):
    """Learns from rounds of one episode from each environment; can be saved between two rounds."""

    def __init__(self, agent: Agent, source: EpisodeSource, save_every: int) -> None:
        self._agent, self._source, self._save_every = agent, source, save_every
        self._episodes = self._steps = self._stride = 0
        self._is_learning = False  # until the round's episodes are recorded, too

    @property
    def steps(self) -> int:
        return self._steps

    @property
    def stride(self) -> int:
        return self._stride

    def act_greedily(self, observation: np.ndarray) -> Any:
        return self._agent.act_greedily(observation)

    def learn(self, frame: Training) -> None:
        self._source.mark()
        while not frame.is_over():
            episodes = self._source.collect(frame.is_interrupted)
            if episodes is None:
                break
            self._is_learning = True
            losses = self._agent.learn(*episodes)
            self._stride = 0
            for episode in episodes:
                # A batch ends with the last episode of a round, which has its losses.
                self._record(episode, losses if episode is episodes[-1] else None, frame)
            self._source.mark()
            self._is_learning = False
            frame.step_done()
        self._source.rewind()

    def _record(self, episode: Episode, losses: Losses | None, frame: Training) -> None:
        self._steps += episode.length
        self._stride += episode.length
        by_episode = {"Reward": episode.total_reward}  # the tags of the existing script
        by_step = dict(episode.curves)
        if losses is not None:
            by_episode |= {"Value Loss": losses.value, "Policy Loss": losses.policy}
            by_step |= {"losses/value_loss": losses.value, "losses/policy_loss": losses.policy}
        frame.log.add(self._episodes, by_episode)
        frame.episode_done(episode.total_reward, episode.length, by_step, success=episode.success)
        if self._save_every and self._episodes % self._save_every == 0:
            self.export(frame.folder, f"_episode_{self._episodes}")
        self._episodes += 1

    def export(self, folder: Path, suffix: str = "") -> None:
        networks = {"policy_network": self._agent.policy, "value_network": self._agent.value}
        for name, network in networks.items():
            save_tensors(folder / f"{name}{suffix}.pth", network.state_dict())

    def settle(self) -> bool:
        """Takes back the draws of a round that failed; a round that is learned from can't be taken back."""
        self._source.rewind()
        return not self._is_learning

    def state_dict(self) -> dict[str, Any]:
        return {"agent": self._agent.state_dict(), "episodes": self._episodes, "stride": self._stride}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        with fitting("agent"):
            self._agent.load_state_dict(state["agent"])
            self._episodes, self._stride = int(state["episodes"]), int(state["stride"])
            self._steps = int(state["steps"])

    def environment_state(self) -> Any:
        """Returns the states of the environments' generators. No episode is under way."""
        return self._source.state()

    def start_environment(self, state: Any, say: Say) -> None:
        self._source.seed()  # the resets of the episodes continue from here
        if state is not None:
            self._source.load_state(state)
        self._source.mark()

    def restore_environment(self, state: Any, say: Say) -> None:
        self._source.load_state(state)  # the next episode begins with a reset anyway
