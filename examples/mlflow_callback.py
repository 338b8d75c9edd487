"""Logs a training to MLflow; MLFLOW_TRACKING_URI says where, by default to this machine.

    ./ws python3 -m pip install mlflow
    ./ws --with examples rosrun cartpole workbench.py train --algo dqn \
        --env-id CartPole-v1 --callback mlflow_callback:MlflowCallback
    ./ws mlflow ui
"""

from typing import Any

import mlflow

from rl_workbench import Callback


class MlflowCallback(Callback):
    """Options, returns, evaluations, and the best policy as an artifact."""

    def on_training_start(self, training: Any) -> None:
        mlflow.set_experiment(training.options.run.env_id)
        mlflow.start_run(run_name=training.folder.name)
        record = training.options.record()
        mlflow.log_params(record["run"] | record["hyperparameters"])

    def on_episode(self, training: Any, episode: Any) -> None:
        mlflow.log_metric("episode/return", episode.total_reward, step=episode.step)
        mlflow.log_metric("episode/length", episode.length, step=episode.step)

    def on_evaluation(self, training: Any, result: Any) -> None:
        mlflow.log_metric("eval/return", result.confirmed, step=result.step)

    def on_training_end(self, training: Any) -> None:
        best = training.folder / "best.pt"
        if best.exists():
            mlflow.log_artifact(str(best))
        mlflow.end_run()
