"""Small trainings of every kind, for the tests of the workbench."""

import json
from pathlib import Path

import pg_runs
from dqn_runs import SMALL

from rl_workbench.training.dqn.run import DQNTraining
from rl_workbench.training.dqn.settings import choose
from rl_workbench.training.run.interrupt import Interrupt

PPO = {"n_steps": 64, "batch_size": 64, "total_timesteps": 256, "eval_frequency": 128,
       "eval_episodes": 2}  # fmt: skip


def dqn(folder: Path, **changed: object) -> Path:
    folder.mkdir(parents=True)
    options = {name: str(value) for name, value in (SMALL | changed).items()}
    DQNTraining(choose([], options), folder, Interrupt()).run()
    return folder


def policy_gradient(folder: Path, **choices: object) -> Path:
    return pg_runs.train(folder, **{"episodes": 4, "save_every": 2, **choices})


def sb3(folder: Path, algorithm: str = "ppo", **changed: object) -> Path:
    from rl_workbench.training.sb3.run import train
    from rl_workbench.training.sb3.settings import choose as choose_sb3

    options = {"env_id": "CartPole-v1", **PPO, "run_dir": folder, **changed}
    pairs = [f"{name}={value}" for name, value in options.items() if value is not None]
    return train(choose_sb3(algorithm, ["--params", *pairs]), Interrupt())


def record(folder: Path, returns: list[float], **run: object) -> Path:
    """A run folder with figures alone, as if its checkpoints were lost."""
    folder.mkdir(parents=True)
    settings = {"exp_name": "dqn", "env_id": "CartPole-v1", "env_kwargs": {}, "seed": 0, **run}
    (folder / "config.json").write_text(json.dumps({"algorithm": "dqn", "run": settings}))
    rows = ["step,tag,value,wall_time"]
    rows += [f"{10 * i + 10},charts/episodic_return,{value},0" for i, value in enumerate(returns)]
    (folder / "scalars.csv").write_text("\n".join(rows) + "\n")
    return folder
