"""`train`: one training with Stable-Baselines3, in a run folder like those of dqn_train.py."""

import contextlib
import time
from pathlib import Path
from typing import Any

import torch

from cartpole.errors import CartpoleError
from cartpole.training import run_folder
from cartpole.training.dqn_run import EVALUATION_SEED, LAST, say
from cartpole.training.dqn_settings import CONFIG_RECORD
from cartpole.training.environments import make_environment
from cartpole.training.evaluation import run_greedily
from cartpole.training.interrupt import Interrupt
from cartpole.training.plots import learning_curve
from cartpole.training.run_checkpoints import Checkpoints
from cartpole.training.scalar_log import ScalarLog
from cartpole.workbench.files import write_file
from cartpole.workbench.sb3_callback import Follower, logger_to
from cartpole.workbench.sb3_model import greedy, make_model
from cartpole.workbench.sb3_settings import SB3Choice, record

MODEL = "model.zip"  # Stable-Baselines3's own form, for its own load()
KEEP = 3  # of the newest checkpoints


class SB3Training:
    """The training proper.

    Args:
        choice: what the user chose.
        folder: an empty folder for all results.
        interrupt: tells when to stop.

    Raises:
        CartpoleError: if the environment can't be made or doesn't suit.
    """

    def __init__(self, choice: SB3Choice, folder: Path, interrupt: Interrupt) -> None:
        torch.set_num_threads(1)  # networks this small only lose by more
        self._choice, self._run = choice, choice.run
        self._folder, self._interrupt = folder, interrupt
        self._model = make_model(choice)
        self._judge = make_environment(self._run.env_id, self._run.env_kwargs)
        self._checkpoints = Checkpoints(folder, KEEP)
        self._evaluations: list[tuple[int, float]] = []
        self._best: tuple[int, float] | None = None
        self._follower: Follower | None = None
        self._began = time.monotonic()

    def run(self) -> None:
        """Trains and writes everything; what was learned is saved also when it fails.

        Raises:
            CartpoleError: if the disk, the environment or the arithmetic fails.
        """
        failure: CartpoleError | None = None
        try:
            self._train()
        except CartpoleError as error:
            failure = error
        except OSError as error:
            place = error.filename or self._folder
            failure = CartpoleError(f"can't write {place}: {error.strerror}")
        except ValueError as error:  # torch's distributions refuse weights that are no numbers
            failure = CartpoleError(f"{self._choice.algorithm} failed: {str(error).splitlines()[0]}")
        finally:
            self._model.get_env().close()
            self._judge.close()
        self._finish(failure)

    def _train(self) -> None:
        content = {**record(self._choice), "versions": run_folder.versions(), "began": time.time()}
        run_folder.write_summary(self._folder / CONFIG_RECORD, content)
        say(f"training {self._choice.algorithm} in {self._run.env_id} with seed {self._run.seed}: "
            f"{self._folder}")  # fmt: skip
        log = ScalarLog(self._folder, {**content["run"], **content["sb3"]})
        self._model.set_logger(logger_to(log))
        self._follower = Follower(log, self._run, self._evaluate, self._interrupt.requested)
        try:
            self._model.learn(self._run.total_timesteps, callback=self._follower)
            self._checkpoints.save(self._steps, self._content())
            write_file(self._folder / MODEL, self._model.save)
        finally:
            log.close()

    @property
    def _steps(self) -> int:
        return int(self._model.num_timesteps)

    def _evaluate(self, log: ScalarLog) -> None:
        """Saves the policy, as the best one if no evaluation was better."""
        result = run_greedily(
            self._judge,
            greedy(self._model),
            self._run.seed + EVALUATION_SEED,
            self._run.eval_episodes,
            self._interrupt.requested,
        )
        if result is None:
            return
        mean = result.mean_return
        log.add(self._steps, {"eval/mean_reward": mean})
        self._evaluations.append((self._steps, mean))
        is_best = self._best is None or mean > self._best[1]
        if is_best:
            self._best = (self._steps, mean)
        log.sync()
        self._checkpoints.save(self._steps, self._content(), is_best)

    def _content(self) -> dict[str, Any]:
        policy = {name: each.cpu() for name, each in self._model.policy.state_dict().items()}
        return {"policy": policy, "steps": self._steps, "config": record(self._choice)}

    def _finish(self, failure: CartpoleError | None) -> None:
        summary = self._summary(failure)
        try:
            if summary["returns"]:
                title = f"{self._choice.algorithm}, {self._run.env_id}, seed {self._run.seed}"
                path = self._folder / "learning_curve.png"
                learning_curve(path, summary["lengths"], summary["returns"], title)
            run_folder.write_summary(self._folder / "summary.json", summary)
        except OSError as error:
            failure = failure or CartpoleError(f"can't write to {self._folder}: {error.strerror}")
        self._tell(summary)
        if failure and not self._interrupt.requested():
            raise CartpoleError(f"{failure}; stopped after {self._steps} steps")

    def _summary(self, failure: CartpoleError | None) -> dict[str, Any]:
        returns = self._follower.returns if self._follower else []
        recent = returns[-LAST:]
        return {
            **record(self._choice),
            "versions": run_folder.versions(),
            "failure": str(failure) if failure else None,
            "complete": self._steps >= self._run.total_timesteps,
            "interrupted": self._interrupt.requested(),
            "episodes": len(returns),
            "steps": self._steps,
            "seconds": round(time.monotonic() - self._began, 3),
            f"mean_return_last_{LAST}": sum(recent) / len(recent) if recent else None,
            "best": self._best,
            "evaluations": self._evaluations,
            "lengths": self._follower.lengths if self._follower else [],
            "returns": returns,
        }

    def _tell(self, summary: dict[str, Any]) -> None:
        line = f"trained {summary['episodes']} episodes, {self._steps} steps in "
        line += f"{summary['seconds']:.1f} s"
        if self._best:
            line += f"; best evaluation {self._best[1]:.1f} at step {self._best[0]}"
        say(line)
        say(f"everything lies in {self._folder}")


def train(choice: SB3Choice, interrupt: Interrupt) -> Path:
    """Trains into the choice's folder, or a new one below runs/; returns it.

    Raises:
        CartpoleError: if something fails that the user can mend; what was learned is saved.
    """
    run = choice.run
    name = run.env_id.replace("/", "-").replace(":", "-")
    folder = run_folder.create(run.run_dir or None, name, run.exp_name, run.seed)
    try:
        with run_folder.held(folder):
            training = SB3Training(choice, folder, interrupt)
            interrupt.defer()
            training.run()
    finally:
        interrupt.defer()
        _remove_if_empty(folder)
    return folder


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()
