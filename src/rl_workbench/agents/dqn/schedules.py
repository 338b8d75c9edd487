"""How exploration and learning rate change while the training goes on."""

from rl_workbench.agents.dqn.settings import DQNSettings


class Epsilon:
    """The probability of a random action.

    - linear: from start_e to end_e over exploration_fraction of total_timesteps
    - step: times epsilon_decay after each round of learning, as in the DQN tutorial's code
    - episode: times epsilon_decay after each episode, as in the DQN tutorial's table
    """

    def __init__(self, settings: DQNSettings) -> None:
        self._settings = settings
        self._duration = settings.exploration_fraction * settings.total_timesteps
        self.value = settings.start_e

    def step_done(self, steps: int) -> None:
        """Tells how many steps of the environment there have been."""
        if self._settings.epsilon_schedule == "linear":
            start, end = self._settings.start_e, self._settings.end_e
            share = min(1.0, steps / self._duration) if self._duration else 1.0
            self.value = start + (end - start) * share

    def learned(self) -> None:
        """Tells of a round of learning."""
        if self._settings.epsilon_schedule == "step":
            self._decay()

    def episode_done(self) -> None:
        """Tells of an episode's end."""
        if self._settings.epsilon_schedule == "episode":
            self._decay()

    def _decay(self) -> None:
        self.value = max(self._settings.end_e, self.value * self._settings.epsilon_decay)


def learning_rate(settings: DQNSettings, steps: int) -> float:
    """The learning rate after that many steps of the environment."""
    if settings.lr_schedule == "constant":
        return settings.learning_rate
    return settings.learning_rate * max(0.0, 1.0 - steps / settings.total_timesteps)
