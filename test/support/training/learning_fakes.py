"""Small, quick robots and environments to learn on; all but one deterministic."""

import random
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
import torch

from rl_workbench.agents.document import PolicyGradientAgent
from rl_workbench.agents.policy_gradient import Episode
from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.training.episodes import play, play_all

DT = 0.008  # [s]


def run_episode(
    env: gymnasium.Env,
    agent: PolicyGradientAgent | ReinforceAgent,
    should_stop: Callable[[], bool] = lambda: False,
) -> Episode | None:
    """Plays one episode alone."""
    draw = partial(agent.draw, generator=agent.generator)
    episodes = play_all([play(env, draw, agent.limited)], should_stop)
    return episodes[0] if episodes else None


def register_with(monkeypatch: pytest.MonkeyPatch, kind: type[gymnasium.Env]) -> str:
    """Makes an environment known to Gymnasium for as long as a test lasts; returns its id."""
    name = f"{kind.__name__}-v0"
    spec = gymnasium.envs.registration.EnvSpec(name, kind, disable_env_checker=True)
    monkeypatch.setitem(gymnasium.registry, name, spec)
    return name


class Still(gymnasium.Env):
    """Nothing happens in it, and nothing ends its episodes."""

    observation_space = gymnasium.spaces.Box(-9, 9, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)
    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode = render_mode

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(2, np.float32), {}

    def step(self, action):
        return np.zeros(2, np.float32), 1.0, False, False, {}


class Dicing(gymnasium.Env):
    """Draws from the generators that all of a process share."""

    observation_space = gymnasium.spaces.Box(-9, 9, (4,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.full(4, random.random(), np.float32), {}

    def step(self, action):
        ended = bool(np.random.random() < 0.1)
        return np.full(4, torch.rand(1).item(), np.float32), random.random(), ended, False, {}


class OnlyOne(gymnasium.Env):
    """As over ROS: another one of its kind would move the same robot."""

    observation_space, action_space = Dicing.observation_space, Dicing.action_space
    shares_robot = True

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation(), {}

    def step(self, action):
        seen, reward = self._observation(), self.np_random.random()
        return seen, reward, self.np_random.random() < 0.1, False, {}

    def _observation(self):
        return self.np_random.random(4, np.float32)


class Died(gymnasium.error.Error):
    """What an environment raises whose simulator has ended; those of robots are of this kind, too."""


class Pole(gymnasium.Env):
    """A pole on a cart that follows its set-point with a lag; an action nudges that. Semi-implicit Euler.

    Episodes start within ±`noise` [m], [rad]; after `dies_after` actions the simulator "dies".
    """

    observation_space = gymnasium.spaces.Box(-99, 99, (4,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, noise: float = 0.0, dies_after: int | None = None) -> None:
        self._noise, self._dies_after, self._actions = noise, dies_after, 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        drawn = self.np_random.uniform(-self._noise, self._noise, 2) if self._noise else np.zeros(2)
        x, angle = drawn.tolist()
        self._state, self._set_point = (x, 0.0, angle, 0.0), x
        return np.array(self._state, np.float32), {}

    def step(self, action):
        self._actions += 1
        if self._dies_after is not None and self._actions > self._dies_after:
            raise Died("the connection broke; the simulator has ended")
        x, v, angle, rate = self._state
        self._set_point += 0.02 if action == 1 else -0.02
        acceleration = 100.0 * (self._set_point - x) - 14.0 * v
        v += acceleration * DT
        x += v * DT
        rate += (30.0 * angle + 3.0 * acceleration) * DT  # leans towards -x
        angle += rate * DT
        self._state = (x, v, angle, rate)
        fallen = abs(x) > 0.4 or abs(angle) > 0.2
        reward = 0.5 + abs(angle) - abs(x) - 10.0 * fallen
        return np.array(self._state, np.float32), float(reward), bool(fallen), False, {}


POLE = "fakes/Pole-v0"
gymnasium.register(POLE, Pole, max_episode_steps=3000, disable_env_checker=True)


class Elsewhere(Pole):
    """Its steps take place elsewhere, as in a simulator: they are begun, then taken."""

    calls: ClassVar[list[tuple[str, int]]] = []

    def __init__(self, noise: float) -> None:
        super().__init__(noise)
        self._begun: Any = None

    def reset(self, *, seed=None, options=None):
        self._begun = None
        return super().reset(seed=seed, options=options)

    def begin_step(self, action):
        assert self._begun is None
        Elsewhere.calls.append(("begin", id(self)))
        self._begun = action

    def step(self, action):
        assert self._begun in (None, action), "an evaluation begins none"
        Elsewhere.calls.append(("step", id(self)))
        self._begun = None
        return super().step(action)


class Fragile(Pole):
    """The second one that was made dies, at its 40th step."""

    made = 0

    def __init__(self) -> None:
        super().__init__(0.05)
        self._is_second = Fragile.made == 1
        Fragile.made += 1

    def step(self, action):
        if self._is_second and self._actions == 40:
            raise Died("its simulator has ended")
        return super().step(action)


def learned_lengths(agent: PolicyGradientAgent | ReinforceAgent, episodes: int) -> list[int]:
    """Lets a policy gradient learn to hold the pole; returns how long it did, episode by episode."""
    env, lengths = gymnasium.make(POLE), []
    for _ in range(episodes):
        episode = run_episode(env, agent)
        agent.learn(episode)
        lengths.append(episode.length)
    return lengths


class Spoilt(gymnasium.Env):
    """Gives an observation and a reward at its 30th step that are no numbers, or too large to learn from."""

    observation_space = gymnasium.spaces.Box(-1, 1, (4,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, observation: float = 0.0, reward: float = 1.0) -> None:
        self._spoilt, self._steps = (observation, reward), 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(4, np.float32), {}

    def step(self, action):
        self._steps += 1
        number, reward = self._spoilt if self._steps == 30 else (0.0, 1.0)
        return np.array([0.0, 0.0, 0.0, number]), reward, self._steps % 7 == 0, False, {}


SPOILT = "fakes/Spoilt-v0"
gymnasium.register(SPOILT, Spoilt, disable_env_checker=True)
