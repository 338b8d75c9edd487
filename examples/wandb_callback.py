"""Logs a training to Weights & Biases. WANDB_MODE=offline keeps everything on this machine.

    ./ws python3 -m pip install wandb
    WANDB_MODE=offline ./ws --with examples rosrun cartpole workbench.py train --algo dqn \
        --env-id CartPole-v1 --callback wandb_callback:WandbCallback
"""

from pathlib import Path
from typing import Any

import wandb

from rl_workbench import Callback


class WandbCallback(Callback):
    """Returns, evaluations and the best policy; a resumed training continues its W&B run."""

    def on_training_start(self, training: Any) -> None:
        name = training.folder.name
        self.run = wandb.init(
            project="rl-workbench",
            name=name,
            id=name,
            resume="allow",
            config=training.options.record(),
            dir=training.folder,
        )

    def on_episode(self, training: Any, episode: Any) -> None:
        figures = {"episode/return": episode.total_reward, "episode/length": episode.length}
        self.run.log(figures | dict(episode.scalars), step=episode.step)

    def on_evaluation(self, training: Any, result: Any) -> None:
        self.run.log({"eval/return": result.confirmed}, step=result.step)

    def on_training_end(self, training: Any) -> None:
        best: Path = training.folder / "best.pt"
        if best.exists():
            self.run.save(best, base_path=training.folder)
        self.run.finish()
