"""DQN as an algorithm of the training loop: one environment step, then learning if it is due."""

from typing import Any

import gymnasium
import numpy as np

from rl_workbench.agents.dqn_agent import DQNAgent, Learned
from rl_workbench.states import mark_random_states, rewind_random_states
from rl_workbench.training.algorithm import Algorithm, Policy, Say
from rl_workbench.training.checked import CURVES
from rl_workbench.training.checkpoints import fitting
from rl_workbench.training.environments import as_vector, discrete_actions, succeeded
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.repeatable import RepeatableEnvironment
from rl_workbench.training.training import Training


def make(options: TrainingOptions, envs: list[Any]) -> "DQNTraining":
    """Makes a new training; see `algorithm`."""
    return DQNTraining(options, envs[0], make_agent(options, envs[0]))


def make_agent(options: TrainingOptions, env: gymnasium.Env[Any, Any]) -> DQNAgent:
    """Makes a new agent for an environment."""
    run = options.run
    actions = discrete_actions(env, run.env_id, "DQN")
    shape = env.observation_space.shape or (0,)
    return DQNAgent(options.hyperparameters, shape[0], actions, run.seed, run.device)


def load_policy(options: TrainingOptions, content: dict[str, Any], env: gymnasium.Env[Any, Any]) -> Policy:
    """Makes the policy of a checkpoint; see `algorithm`."""
    agent = make_agent(options, env)
    agent.load_policy_state(content)
    return Policy(agent.act_greedily, agent.greedy_network())


class DQNTraining(Algorithm):
    """Steps the environment and lets the agent learn."""

    def __init__(self, options: TrainingOptions, env: gymnasium.Env[Any, Any], agent: DQNAgent) -> None:
        self._agent = agent
        self._seed, self._log_frequency = options.run.seed, options.run.log_frequency
        self._repeatable = RepeatableEnvironment(env)
        self._observation: np.ndarray | None = None  # None: the next step begins an episode
        self._reward = 0.0  # of the episode so far
        self._last: Learned | None = None
        # What `settle` takes back.
        self._mark: Any = None  # before a reset or an evaluation, while that is under way
        self._is_acting = self._is_learning = False

    @property
    def steps(self) -> int:
        return self._agent.steps

    def act_greedily(self, observation: np.ndarray) -> int:
        return self._agent.act_greedily(observation)

    def learn(self, frame: Training) -> None:
        while not frame.is_over():
            self._step(frame)
            frame.step_done()

    def _step(self, frame: Training) -> None:
        agent, env = self._agent, self._repeatable
        observation = self._observation
        if observation is None:
            self._set_mark()
            self._observation = observation = as_vector(env.reset()[0])
            self._mark = None
        self._is_acting = True
        action = agent.act(observation)
        seen, reward, terminated, truncated, info = env.step(action)
        self._is_acting = False
        following, reward = as_vector(seen), float(reward)
        self._reward += reward
        agent.observe((observation, action, reward), following, bool(terminated), bool(truncated))
        if agent.is_due:
            self._is_learning = True
            self._last = agent.learn()
            self._is_learning = False
        self._observation = following
        if self._last is not None and self.steps % self._log_frequency == 0:
            td_loss, q_values = self._last
            losses = {"losses/td_loss": td_loss, "losses/q_values": q_values}
            frame.log.add(self.steps, losses)
        if terminated or truncated:
            agent.episode_done()
            total, self._reward, self._observation = self._reward, 0.0, None
            scalars = {"charts/epsilon": agent.epsilon, **info.get(CURVES, {})}
            note = f"ε: {agent.epsilon:.3f}"
            frame.episode_done(total, env.length, scalars, note, succeeded(info))

    def _set_mark(self) -> None:
        self._mark = self._repeatable.mark(), mark_random_states()

    def settle(self) -> bool:
        """Undoes the step that failed. A round of gradient steps can't be undone."""
        if self._is_learning:
            return False
        if self._mark is not None:
            place, process = self._mark
            self._repeatable.take_back(place)
            rewind_random_states(process)
        if self._is_acting:
            self._agent.take_back_action()
        return True

    def state_dict(self) -> dict[str, Any]:
        return self._agent.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        with fitting("agent"):
            self._agent.load_state_dict(state)

    def environment_state(self) -> dict[str, Any]:
        """Returns the episode under way, if there is one, the generator, and the last loss."""
        under_way = self._observation is not None
        return {
            "episode": self._repeatable.state_dict() if under_way else None,
            "generator": self._repeatable.generator,
            "reward": self._reward,
            "last": None if self._last is None else list(self._last),
        }

    def leave_environment(self) -> dict[str, Any]:
        self._set_mark()
        return self.environment_state()

    def start_environment(self, state: dict[str, Any] | None, say: Say) -> None:
        self._repeatable.reset(seed=self._seed)  # the resets of the episodes continue from here
        if state is not None:
            self.restore_environment(state, say)

    def restore_environment(self, state: dict[str, Any], say: Say) -> None:
        """Repeats the episode under way; logs if it goes differently."""
        last = state["last"]
        self._last = None if last is None else Learned(*map(float, last))
        self._repeatable.generator = state["generator"]
        if state["episode"] is not None:
            self._repeat(state, say)
        self._mark = None

    def _repeat(self, state: dict[str, Any], say: Say) -> None:
        self._observation = self._repeatable.load_state_dict(state["episode"])
        self._reward = float(state["reward"])
        if self._observation is None:
            say("the environment is not repeatable: the current episode is abandoned")
            self._reward = 0.0
            self._agent.episode_done()
