"""Small trainings of every kind, for the tests of the workbench."""

import json
from pathlib import Path

from support.training import training_runs
from support.training.training_runs import train

from rl_workbench import cli
from rl_workbench.tools.benchmark import make_variant, training_flags
from rl_workbench.tools.jobs import Job

PPO = {"env_id": "CartPole-v1", "n_steps": 64, "batch_size": 64, "total_timesteps": 256,
       "eval_frequency": 128, "eval_episodes": 2}  # fmt: skip
QUICK = {"total_timesteps": 300, "learning_starts": 50, "batch_size": 8, "hidden_sizes": [8],
         "eval_frequency": 150, "eval_episodes": 1, "confirm_episodes": 1}  # fmt: skip


def work(*words: object) -> int:
    """Runs a command of rl-workbench; returns its exit code."""
    return cli.main([str(each) for each in words])


def dqn(folder: Path, **changed: object) -> Path:
    return train(folder, "dqn", **changed)


def policy_gradient(folder: Path, algorithm: str = "reinforce-document", **changed: object) -> Path:
    few = {"env_id": "CartPole-v1", "env_kwargs": None, "episodes": 4, "save_every": 2}
    return train(folder, algorithm, **{**few, **changed})


def sb3(folder: Path, algorithm: str = "ppo", **changed: object) -> Path:
    """Of PPO's options above those count that aren't given as None."""
    given = {key: value for key, value in {**PPO, **changed}.items() if value is not None}
    return training_runs.run(training_runs.options_of(algorithm, given), folder)


def record(folder: Path, returns: list[float], **run: object) -> Path:
    """A run folder with figures alone, as if its checkpoints were lost."""
    folder.mkdir(parents=True)
    settings = {"exp_name": "dqn", "env_id": "CartPole-v1", "env_kwargs": {}, "seed": 0, **run}
    content = {"algorithm": "dqn", "run": settings, "hyperparameters": {}}
    (folder / "config.json").write_text(json.dumps(content))
    rows = ["step,tag,value,wall_time"]
    rows += [f"{10 * i + 10},charts/episodic_return,{value},0" for i, value in enumerate(returns)]
    (folder / "scalars.csv").write_text("\n".join(rows) + "\n")
    return folder


def job(folder: Path, seed: int = 0, **options: object) -> Job:
    """A quick training of DQN, as a benchmark begins it."""
    variant = make_variant("test", "quick", {**QUICK, **options})
    return Job(folder, variant.name, seed, training_flags(variant))
