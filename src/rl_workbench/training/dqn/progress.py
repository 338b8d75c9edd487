"""What the user sees of a DQN training: a bar on a terminal, and a line every 20 episodes."""

import sys
import time
from typing import Any, TextIO

from rl_workbench.agents.dqn.agent import Learned
from rl_workbench.training.dqn.loop import Episode
from rl_workbench.training.run.history import History
from rl_workbench.training.run.progress import LINE_EVERY, terminal_bar

REFRESH = 0.1  # [s]


class DQNProgress:
    """An observer of the loop.

    Args:
        total: steps of the whole training.
        done: of these, steps that were made before.
        history: of the returns so far.
        stream: where it goes; standard error unless told otherwise.
    """

    def __init__(
        self, total: int, done: int, history: History, stream: TextIO | None = None
    ) -> None:
        self._stream = stream or sys.stderr
        self._returns = history.returns
        self._steps = self._shown = done
        self._time = time.monotonic()
        self._bar: Any = None
        if self._stream.isatty():
            self._bar = terminal_bar(total, "step", self._stream, done)

    def step_done(self, steps: int) -> None:
        """Moves the bar, now and then."""
        self._steps = steps
        if self._bar is not None and time.monotonic() - self._time > REFRESH:
            self._move()

    def _move(self) -> None:
        self._bar.update(self._steps - self._shown)
        self._shown, self._time = self._steps, time.monotonic()

    def learned(self, steps: int, learned: Learned) -> None:
        """Nothing to see."""

    def episode_done(self, episode: Episode) -> None:
        """Puts the episode's figures beside the bar; the document's line for each 20th."""
        if self._bar is not None:
            self._bar.set_postfix_str(
                f"return {episode.total_reward:.0f}, ε {episode.epsilon:.3f}, "
                f"{episode.steps_per_second:.0f} steps/s",
                refresh=False,
            )
        if (episode.index + 1) % LINE_EVERY == 0:
            recent = self._returns[-LINE_EVERY:]
            self.say(
                f"Episode {episode.index + 1:4d} | Reward: {episode.total_reward:3.0f} | "
                f"Avg({LINE_EVERY}): {sum(recent) / len(recent):6.1f} | ε: {episode.epsilon:.3f}"
            )

    def say(self, text: str) -> None:
        """A line of its own, above the bar."""
        if self._bar is not None:
            self._bar.write(text, file=self._stream)
        else:
            print(text, file=self._stream, flush=True)

    def close(self) -> None:
        """Ends the bar, where the training has come to."""
        if self._bar is not None:
            self._move()
            self._bar.close()
