"""What the user sees of a training with Stable-Baselines3: a bar, and a line every 20 episodes."""

from rl_workbench.training.dqn.progress import DQNProgress
from rl_workbench.training.run.progress import LINE_EVERY


class SB3Progress(DQNProgress):
    """That of our DQN, without ε, which few of these algorithms have."""

    def show(self, total: float, steps_per_second: float) -> None:
        """Puts the figures of an episode that has just ended beside the bar."""
        if self._bar is not None:
            text = f"return {total:.2f}, {steps_per_second:.0f} steps/s"
            self._bar.set_postfix_str(text, refresh=False)
        count = len(self._returns)
        if count % LINE_EVERY == 0:
            self.say(
                f"Episode {count:4d} | Reward: {total:8.2f} | "
                f"Avg({LINE_EVERY}): {sum(self._returns[-LINE_EVERY:]) / LINE_EVERY:8.2f} | "
                f"{steps_per_second:.0f} steps/s"
            )
