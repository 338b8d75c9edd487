"""Evaluates and saves at the ends of episodes, and knows the way back to the last of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cartpole.training.evaluation import Evaluation, run_greedily
from cartpole.training.history import History
from cartpole.training.loop import EpisodeRecord, is_complete
from cartpole.training.pg_policy import Agent, hyperparameters
from cartpole.training.pg_settings import Choice, config
from cartpole.training.pg_stage import Stage
from cartpole.training.random_states import Generators
from cartpole.training.run_checkpoints import Checkpoints
from cartpole.training.scalar_log import ScalarLog


class Keeper:
    """The loop's last observer: when it is told, all others have been.

    Args:
        choice: what the user chose.
        folder: the run's.
        stage: its environment was seeded.
        agent: acts, and is saved.
        history: is saved, too, and gets the evaluations.
        log: of the evaluations; checkpoints know its length.
        should_stop: breaks an evaluation off.
    """

    def __init__(
        self,
        choice: Choice,
        folder: Path,
        stage: Stage,
        agent: Agent,
        history: History,
        log: ScalarLog,
        should_stop: Callable[[], bool],
    ) -> None:
        self._choice, self._run = choice, choice.run
        self._stage, self._agent, self._history = stage, agent, history
        self._log = log
        self._should_stop = should_stop
        self._checkpoints = Checkpoints(folder, self._run.keep_checkpoints)
        self._generators = Generators(stage.env, agent.generator)
        self._saved_at = -1  # [steps]

    def episode_done(self, record: EpisodeRecord) -> None:
        """Does what is due: an evaluation, a checkpoint."""
        self._generators.mark()
        self.evaluate_if_due()
        every = self._run.checkpoint_frequency
        if every and (record.index + 1) % every == 0:
            self.save()

    def evaluate_if_due(self) -> None:
        """Evaluates the policy, unless that was done at this episode already, or it is the last."""
        run, history = self._run, self._history
        episodes, steps = len(history.lengths), history.steps
        done = bool(history.evaluations) and history.evaluations[-1][0] == steps
        is_due = bool(run.eval_frequency and episodes) and episodes % run.eval_frequency == 0
        if done or not is_due or is_complete(history, run.episodes, run.stop_at):
            return
        evaluation = self._evaluate()
        if evaluation is None:
            return
        is_best = self._enter(steps, evaluation.mean_return)
        if is_best:
            self.save(best=True)

    def _enter(self, steps: int, mean: float) -> bool:
        """Writes an evaluation down; returns whether it is the best one."""
        self._log.add(steps, {"eval/mean_reward": mean})
        self._history.evaluations.append((steps, mean))
        if self._history.best is not None and mean <= self._history.best[1]:
            return False
        self._history.best = (steps, mean)
        return True

    def _evaluate(self) -> Evaluation | None:
        """Runs greedy episodes, which leave nothing behind in the training."""
        seed = self._run.seed + self._stage.seed_offset
        judge, act = self._stage.judge, self._agent.act_greedily
        result = run_greedily(judge, act, seed, self._run.eval_episodes, self._should_stop)
        self._generators.rewind()
        return result

    def finish(self) -> Evaluation | None:
        """Saves and evaluates the complete training; None if it was interrupted.

        The last checkpoint doesn't know of this evaluation: a training that is prolonged goes on
        as if it had been longer from the beginning.
        """
        self.save()
        if not is_complete(self._history, self._run.episodes, self._run.stop_at):
            return None
        content = self._content()
        evaluation = self._evaluate()
        if evaluation and self._enter(self._history.steps, evaluation.mean_return):
            self._checkpoints.save(self._history.steps, content, best=True)
        return evaluation

    def rewind(self) -> None:
        """Takes back the draws of an episode that was broken off."""
        self._generators.rewind()

    def save(self, best: bool = False) -> None:
        """Writes a checkpoint, unless this episode has one already.

        Raises:
            OSError: if the disk refuses; the earlier checkpoints are untouched.
        """
        steps = self._history.steps
        if steps != self._saved_at:
            self._checkpoints.save(steps, self._content(), best)
            self._saved_at = steps

    def _content(self) -> dict[str, Any]:
        return {
            "config": config(self._choice, hyperparameters(self._choice)),
            "agent": self._agent.state_dict(),
            "history": self._history.state_dict(),
            "random": self._generators.state_dict(),
            "steps": self._history.steps,
            "log_bytes": self._log.sync(),
        }

    def load_state_dict(self, content: dict[str, Any]) -> None:
        """Goes on from a checkpoint: agent, history and generators."""
        self._checkpoints.remove_leftovers()
        self._agent.load_state_dict(content["agent"])
        self._history.load_state_dict(content["history"])
        self._generators.load_state_dict(content["random"])
