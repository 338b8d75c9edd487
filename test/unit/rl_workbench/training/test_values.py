"""Values of options: their types, limits, and files that hold them."""

import dataclasses
from pathlib import Path

import pytest
import yaml
from support.training.training_runs import EXACT

import robot_envs.robots  # noqa: F401 - registers what some sections are for
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import default_file, known_options
from rl_workbench.training.train import choose

DQN, REINFORCE, DOCUMENT = (ALGORITHMS[name] for name in EXACT)
EMPTY = "{}"


def read(tmp_path: Path, text: str, kind=DQN, *flags: str):
    path = tmp_path / "options.yaml"
    path.write_text(text)
    return choose(kind, [f"--config={path}", *flags])


# The environment's.


@pytest.mark.parametrize("name", ["env_kwargs", "train_env_kwargs", "eval_env_kwargs"])
def test_options_of_the_environment(tmp_path: Path, name: str) -> None:
    flag = f"--{name.replace('_', '-')}"
    for text, wanted in [("max_steps=5,backend=bullet", {"max_steps": 5, "backend": "bullet"}),
                         ("noise=1e-3,render_mode=1e,backend=null",
                          {"noise": 0.001, "render_mode": "1e", "backend": None}),
                         ("randomisation={mass: 1e-1, com: {pole: [0, 2e-2]}} backend=ros,sizes=[1, 2]",
                          {"randomisation": {"mass": 0.1, "com": {"pole": [0, 0.02]}}, "backend": "ros",
                           "sizes": [1, 2]}),
                         ("page=http://a/?x=1 n=5", {"page": "http://a/?x=1", "n": 5})]:  # fmt: skip
        assert getattr(read(tmp_path, EMPTY, DQN, f"{flag}={text}").run, name) == wanted


def test_which_of_them_count_where(tmp_path: Path) -> None:
    flags = ["--env-kwargs=a=1,b=1,c=1", "--train-env-kwargs=b=2,c=2", "--eval-env-kwargs=c=3"]
    run = read(tmp_path, EMPTY, DQN, *flags).run
    assert run.training_environment == {"a": 1, "b": 2, "c": 2}
    assert run.evaluation_environment == {"a": 1, "b": 2, "c": 3}


@pytest.mark.parametrize("text", ["noise=[1", "noise", "a={", "a={b: 1}}", "a={b: [1}"])
def test_options_of_the_environment_that_cannot_be_read(text: str, capsys) -> None:
    with pytest.raises(SystemExit):
        choose(DQN, [f"--env-kwargs={text}"])
    assert "env-kwargs: must be KEY=VALUE" in capsys.readouterr().err
    with pytest.raises(WorkbenchError, match="env_kwargs must be KEY=VALUE"):
        choose(DQN, [], {"env_kwargs": text})


@pytest.mark.parametrize("value", [".inf", "2020-01-01", "[1, .nan]", "{a: 2020-01-01}", "{1: 2}"])
def test_options_of_the_environment_that_no_record_can_hold(tmp_path: Path, value: str) -> None:
    with pytest.raises(WorkbenchError, match="env_kwargs has values that JSON can't hold"):
        read(tmp_path, f"CartPole-v1: {{env_kwargs: {{noise: {value}}}}}")


# Wrong ones.


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        (DQN, "CartPole-v1: {gama: 1}", "unknown option 'gama'; did you mean gamma"),
        (DQN, "CartPole-v1: {gamma: high}", "gamma must be a number, not 'high'"),
        (DQN, "CartPole-v1: {gamma: true}", "gamma must be a number, not True"),
        (DQN, "CartPole-v1: {gamma: 1.5}", "gamma must be between 0 and 1, not 1.5"),
        (DQN, "CartPole-v1: {gamma: .nan}", "gamma must be between"),
        (DQN, "CartPole-v1: {double: 1}", "double must be true or false, not 1"),
        (DQN, "CartPole-v1: {batch_size: 1.5}", "batch_size must be a whole number"),
        (DQN, "CartPole-v1: {hidden_sizes: [a]}", "hidden_sizes must be whole numbers"),
        (DQN, "CartPole-v1: {hidden_sizes: [0]}", "hidden_sizes must be one or more positive"),
        (DQN, "CartPole-v1: {loss: l1}", "loss must be one of mse, huber"),
        (DQN, "CartPole-v1: {seed: -1}", "seed must be between 0 and"),
        (DQN, "CartPole-v1: {seed: 1099511627776}", "seed must be between 0 and"),
        (DQN, "CartPole-v1: {eval_episodes: 0}", "eval_episodes must be between 1 and"),
        (DQN, "CartPole-v1: {env_kwargs: 3}", "env_kwargs must be KEY=VALUE"),
        (DQN, "CartPole-v1: 3", "unknown option 'CartPole-v1'"),
        (DQN, "CartPole-v1: 3\nA-v0: {}", "CartPole-v1 isn't a section of options"),
        (DQN, "CartPole-v1: [1", "isn't YAML"),
        (DQN, "just text", "isn't a YAML file of options"),
        (DQN, "gamma: 0.9\ntau: 2", "tau must be between"),
        (DQN, "max_grad_norm: .inf", "max_grad_norm must be between"),  # no record could hold it
        (REINFORCE, "episodes: -3", "episodes must be between 0 and"),
        (REINFORCE, "save_every: -1", "save_every must be between 0 and"),
        (REINFORCE, "stop_at_length: .nan", "stop_at_length must be between"),
        (REINFORCE, "observation_scale: [1, 0]", "observation_scale must be positive"),
        (REINFORCE, "observation_scale: [1, a]", "observation_scale must be numbers, as in 0.5,2"),
        (REINFORCE, "random_weights: true", "unknown option 'random_weights'"),
        (DOCUMENT, "gae_lambda: 1", "unknown option 'gae_lambda'"),
        (DOCUMENT, "policy_learning_rate: -1", "policy_learning_rate must be between"),
    ],
)
def test_wrong_files_are_one_line(tmp_path: Path, kind, text: str, message: str) -> None:
    with pytest.raises(WorkbenchError, match=message) as raised:
        read(tmp_path, text, kind)
    assert "\n" not in str(raised.value)
    if "isn't" not in message and "between" not in message:
        assert "options.yaml" in str(raised.value) or "positive" in message or "one of" in message


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match=r"can't read .*none.yaml: No such file"):
        choose(DQN, [f"--config={tmp_path / 'none.yaml'}"])
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(WorkbenchError, match=r"bytes.yaml isn't YAML"):
        choose(DQN, [f"--config={tmp_path / 'bytes.yaml'}"])


# The package's own files.

SECTIONS = [
    (kind.name, name)
    for file in ("dqn.yaml", "pg.yaml", "sb3.yaml")
    for name in yaml.safe_load(default_file(file).read_text())
    for kind in ALGORITHMS.values()
    if kind.config == file and kind.section.format(env_id=name.split()[-1]) == name
]


def test_every_section_belongs_to_an_algorithm() -> None:
    for file in ("dqn.yaml", "pg.yaml", "sb3.yaml"):
        names = set(yaml.safe_load(default_file(file).read_text()))
        assert names == {name for kind, name in SECTIONS if ALGORITHMS[kind].config == file}


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize(("algorithm", "name"), SECTIONS)
def test_every_section_is_valid_and_counts(algorithm: str, name: str) -> None:
    kind, env_id = ALGORITHMS[algorithm], name.rsplit(maxsplit=1)[-1]
    section = yaml.safe_load(default_file(kind.config).read_text())[name]
    chosen = ["--preset=tutorial"] if name == "tutorial" else [f"--env-id={env_id}"]
    options = choose(kind, chosen)
    found = options.record()["run"] | options.record()["hyperparameters"]
    wanted = known_options(kind).read(section, name)
    assert wanted and {key: found[key] for key in wanted} == wanted
    assert options.run.seed == 0, "a seed is nothing to tune"
    if kind.config == "sb3.yaml":
        from rl_workbench.training.environments import training_environments
        from rl_workbench.training.sb3.models import make_learning_model

        assert options.run.total_timesteps >= 5_000
        is_continuous = "SwingUp" in name or "Continuous" in name
        like_it = {"LunarLanderContinuous-v3": "Pendulum-v1", "LunarLander-v3": "CartPole-v1"}
        if env_id.startswith("cartpole/"):
            like_it[env_id] = "Pendulum-v1" if is_continuous else "CartPole-v1"
        run = dataclasses.replace(options.run, env_id=like_it.get(env_id, env_id), env_kwargs={})
        options = options._replace(run=run)
        make_learning_model(options, training_environments(options)).get_env().close()
