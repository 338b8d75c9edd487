"""Environments and tasks that each break one promise (see robot_envs.testing)."""

import numpy as np
from support.scenes.solo_arm import SOLO, Hold, Reach

from robot_envs import InitialState, RobotEnv


def of(task, environment=RobotEnv, **own):
    """A function that makes environments, as the suite wants it."""
    return lambda **options: environment(SOLO, task(), **{**own, **options})


class Wobbling(Hold):
    """Its episodes begin somewhere, so that seeds matter."""

    def initial_state(self, rng):
        return InitialState({"elbow": rng.uniform(-0.1, 0.1)})


wobbling = Wobbling


def telling(change):
    """A class of environments whose steps tell what `change` makes of it."""

    class Changed(RobotEnv):
        def step(self, action):
            return change(*super().step(action))

    return Changed


BothEnds = telling(lambda seen, reward, end, cut, info: (seen, reward, end or cut, cut, info))
Miscounts = telling(lambda seen, reward, *rest: (seen, reward + 0.5, *rest))


class NoCut(RobotEnv):
    def step(self, action):
        most, self.max_steps = self.max_steps, None
        try:
            return super().step(action)
        finally:
            self.max_steps = most


class GoesOn(RobotEnv):
    def step(self, action):
        given = super().step(action)
        self._steps = 0
        return given


class NeedsNoReset(RobotEnv):
    def step(self, action):
        if self._steps is None:
            self.reset()
        return super().step(action)


class TakesAnyOption(RobotEnv):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)


class BeginsWhereItLikes(RobotEnv):
    begun = 0

    def reset(self, *, seed=None, options=None):
        self.begun += 1
        if options and "initial_state" in options:
            options = {"initial_state": InitialState({"elbow": 0.1 * self.begun})}
        return super().reset(seed=seed, options=options)


class Clips(RobotEnv):
    def step(self, action):
        space = self.action_space
        given = np.array(action)
        if given.dtype.kind == "f" and given.shape == space.shape:
            action = np.clip(np.nan_to_num(given), space.low, space.high)
        return super().step(action)


class MovesFirst(RobotEnv):
    def step(self, action):
        self.backend.act({"pair": (0.5, 0.5)})
        return super().step(action)


class NeverCloses(RobotEnv):
    def _check_open(self):
        pass


class OnePicture(RobotEnv):
    def render(self):
        return np.zeros((64, 96, 3), np.uint8)


class SmallPicture(RobotEnv):
    def render(self):
        return np.zeros((3, 3, 3), np.uint8)


class Forgets(RobotEnv):
    """A goal that somebody has asked for isn't the episode's."""

    def reset(self, *, seed=None, options=None):
        if options and np.isfinite(options.get("goal", np.nan)).all():
            options = {name: value for name, value in options.items() if name != "goal"}
        return super().reset(seed=seed, options=options)


class Deaf(RobotEnv):
    """Always the same seed."""

    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else 1, options=options)


def kept(task):
    """A task that observes into the same array."""
    buffer = np.zeros(2, np.float32)
    observe = task.observe

    def filled(state):
        buffer[:] = observe(state)
        return buffer

    task.observe = filled
    return task


def drawing(task):
    """A task that draws from NumPy's own stream of random numbers."""
    task.initial_state = lambda rng: InitialState({"elbow": np.random.uniform(-1.0, 1.0)})
    return task


def counting(task):
    """A task whose episodes go on from those before."""
    episodes = iter(range(10**6))
    task.initial_state = lambda rng: InitialState({"elbow": 0.001 * next(episodes)})
    return task


class OneByOne(Reach):
    """Its rewards are those of single goals."""

    def compute_reward(self, achieved, desired, info):
        return float(-np.linalg.norm(achieved - desired))


class NeverThere(Reach):
    def is_success(self, achieved, desired):
        return np.linalg.norm(achieved - desired, axis=-1) < -1.0


class FarGoals(Reach):
    """Achieves what is no goal."""

    def achieved(self, state):
        return self.observe(state) + 5.0
