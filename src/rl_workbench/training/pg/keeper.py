"""Evaluates and saves at the ends of episodes, and knows the way back to the last of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.training.pg.loop import EpisodeRecord, is_complete
from rl_workbench.training.pg.policy import Agent, hyperparameters
from rl_workbench.training.pg.settings import Choice, config
from rl_workbench.training.pg.stage import OTHER_SEED, Stage
from rl_workbench.training.run.checkpoints import Checkpoints
from rl_workbench.training.run.evaluation import Evaluation, run_greedily
from rl_workbench.training.run.history import History
from rl_workbench.training.run.random_states import Generators
from rl_workbench.training.run.scalar_log import ScalarLog


class Verdict(NamedTuple):
    """An evaluation, and the mean return to compare policies by."""

    evaluation: Evaluation
    confirmed: float


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
        self._checkpoints.remove_leftovers()
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
        verdict = self._judge()
        if verdict and self._enter(steps, verdict):
            self.save(best=True)

    def _best_return(self) -> float:
        return self._history.best[1] if self._history.best else float("-inf")

    def _enter(self, steps: int, verdict: Verdict) -> bool:
        """Writes an evaluation down; returns whether the policy is the best one."""
        mean = verdict.evaluation.mean_return
        self._log.add(steps, {"eval/mean_reward": mean})
        self._history.evaluations.append((steps, mean))
        if verdict.confirmed <= self._best_return():
            return False
        if self._run.confirm_episodes:
            self._log.add(steps, {"eval/confirmed_reward": verdict.confirmed})
        self._history.best = (steps, verdict.confirmed)
        return True

    def _judge(self) -> Verdict | None:
        """Evaluates the policy; one that seems to be the best is confirmed. None if interrupted."""
        run, result = self._run, self._evaluate(self._run.eval_episodes, 0)
        if result is None:
            return None
        if result.mean_return <= self._best_return() or not run.confirm_episodes:
            return Verdict(result, result.mean_return)
        confirmed = self._evaluate(run.confirm_episodes, OTHER_SEED)
        return None if confirmed is None else Verdict(result, confirmed.mean_return)

    def _evaluate(self, episodes: int, further: int) -> Evaluation | None:
        """Runs greedy episodes, which leave nothing behind in the training."""
        seed = self._run.seed + self._stage.seed_offset + further
        judge, act = self._stage.judge, self._agent.act_greedily
        result = run_greedily(judge, act, seed, episodes, self._should_stop)
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
        verdict = self._judge()
        if verdict is None:
            return None
        if self._enter(self._history.steps, verdict):
            self._checkpoints.save(self._history.steps, content, best=True)
        return verdict.evaluation

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

    def go_on(self, content: dict[str, Any]) -> None:
        """Takes over a checkpoint's generators; agent and history have its state already."""
        self._generators.load_state_dict(content["random"])
