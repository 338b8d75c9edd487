"""Options of a training: where they come from, what wins, their values and files, what is refused and how."""

import dataclasses
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.training.training_runs import ALL, EXACT, failure

import robot_envs.robots  # noqa: F401 - registers what some sections are for
from rl_workbench.agents.settings import DocumentSettings, DQNSettings, ReinforceSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithms import ALGORITHMS, AlgorithmKind, algorithm
from rl_workbench.training.options import RunOptions, TrainingOptions, default_file, known_options
from rl_workbench.training.train import choose

DQN, REINFORCE, DOCUMENT = (ALGORITHMS[name] for name in EXACT)


@pytest.fixture
def empty(tmp_path: Path) -> str:
    """A file that says nothing, so that the defaults show."""
    return written(tmp_path, "{}\n")


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "options.yaml"
    path.write_text(text)
    return f"--config={path}"


def read(tmp_path: Path, text: str, kind: AlgorithmKind = DQN, *flags: str) -> TrainingOptions:
    return choose(kind, [written(tmp_path, text), *flags])


def refusal(kind: AlgorithmKind, *flags: str, **parameters: Any) -> str:
    return failure(lambda: choose(kind, list(flags), parameters))


def test_defaults(empty: str) -> None:
    run = RunOptions(exp_name="dqn", total_timesteps=50_000, eval_frequency=1000,
                     confirm_episodes=100, checkpoint_frequency=5000)  # fmt: skip
    assert choose(DQN, [empty]) == TrainingOptions(DQN, run, DQNSettings())
    episodic = {"episodes": 600, "eval_frequency": 0, "eval_episodes": 20}
    run = RunOptions(exp_name="reinforce", **episodic)
    own = ReinforceSettings(normalize_observations=True)
    assert choose(REINFORCE, [empty]) == TrainingOptions(REINFORCE, run, own)
    run = RunOptions(exp_name="reinforce-document", **episodic)
    assert choose(DOCUMENT, [empty]) == TrainingOptions(DOCUMENT, run, DocumentSettings())


@pytest.mark.parametrize("kind", [REINFORCE, DOCUMENT])
def test_steps_without_episodes_mean_until_the_steps(kind: AlgorithmKind, tmp_path: Path) -> None:
    """Wherever the steps were given, the episodes of what is weaker don't count."""

    def length(text: str, *flags: str, **parameters: Any) -> tuple[int, int]:
        run = choose(kind, [written(tmp_path, text), *flags], parameters).run
        return run.total_timesteps, run.episodes

    assert length("{}\n") == (0, 600)
    assert length("{}\n", "--total-timesteps=5e3") == (5000, 0)
    assert length("{}\n", "--params", "total_timesteps=5e3") == (5000, 0)
    assert length("{}\n", total_timesteps=5000) == (5000, 0)
    assert length("total_timesteps: 5000\n") == (5000, 0)
    assert length("episodes: 70\n", "--total-timesteps=5e3") == (5000, 0)
    assert length("episodes: 70\ntotal_timesteps: 5000\n") == (5000, 70)
    assert length("{}\n", "--total-timesteps=5e3", "--episodes=9") == (5000, 9)
    assert length("{}\n", "--total-timesteps=0") == (0, 600)


def test_episodes_do_not_prolong_what_schedules_depend_on(empty: str) -> None:
    run = choose(DQN, [empty, "--episodes=9"]).run
    assert (run.total_timesteps, run.episodes) == (50_000, 9)


def test_file_params_rosparams_flags_in_this_order(tmp_path: Path) -> None:
    """And all of them over the algorithm's own defaults, which win over the common ones."""
    section = "{eval_frequency: 1, seed: 1, eval_episodes: 1, keep_checkpoints: 1}"
    file = written(tmp_path, f"CartPole-v1: {section}")
    flags = [file, "--params", "seed=2", "eval_episodes=2", "keep-checkpoints=2"]
    flags += ["--keep-checkpoints=4"]
    run = choose(DQN, flags, {"eval_episodes": 3, "keep_checkpoints": 3}).run
    assert (run.eval_frequency, run.seed, run.eval_episodes, run.keep_checkpoints) == (1, 2, 3, 4)
    assert run.confirm_episodes == 100 != RunOptions(episodes=1).confirm_episodes


def test_the_environment_chooses_the_section(tmp_path: Path) -> None:
    text = """CartPole-v1: {gamma: 0.1}
Acrobot-v1: {gamma: 0.2}
reinforce-document CartPole-v1: {gamma: 0.3}
"""
    file = written(tmp_path, text)
    found = [
        choose(kind, [file, *flags]).hyperparameters.gamma
        for kind, flags in [(DQN, []), (DQN, ["--env-id=Acrobot-v1"]), (REINFORCE, []),
                            (DOCUMENT, []), (DOCUMENT, ["--env-id=Acrobot-v1"])]
    ]  # fmt: skip
    assert found == [0.1, 0.2, 0.1, 0.3, 0.99]
    assert choose(DQN, [file], env_id="Acrobot-v1").hyperparameters.gamma == 0.2
    assert choose(DQN, [file], {"env_id": "Acrobot-v1"}).run.env_id == "Acrobot-v1"


def test_a_file_without_sections_counts_everywhere(tmp_path: Path) -> None:
    file = written(tmp_path, "gamma: 0.5")
    assert choose(DQN, [file, "--env-id=X-v0"]).hyperparameters.gamma == 0.5
    assert "has no sections, so no preset 'a' either" in refusal(DQN, file, "--preset=a")


def test_parameters_as_roslaunch_has_them(empty: str) -> None:
    parameters = {"params": "gamma=0.9 n-step=2", "dueling": True, "seed": "4"}
    _, run, dqn, *_ = choose(DQN, [empty], parameters)
    assert (dqn.gamma, dqn.n_step, dqn.dueling, run.seed) == (0.9, 2, True, 4)
    nothing = {"seed": "", "resume": "", "config": "", "env_id": "", "dueling": False, "tau": ""}
    assert choose(DQN, [empty], nothing) == choose(DQN, [empty])


def test_a_preset_may_name_the_environment_and_a_flag_another() -> None:
    assert choose(DQN, ["--preset=tutorial"]).run.env_id == "CartPole-v1"
    _, run, dqn, *_ = choose(DQN, ["--preset=tutorial", "--env-id=Acrobot-v1"])
    assert run.env_id == "Acrobot-v1" and dqn.target_network_frequency == 10
    assert "unknown preset 'tutoral'; did you mean tutorial" in refusal(DQN, "--preset=tutoral")


@pytest.mark.parametrize(
    ("kind", "flags", "words"),
    [
        (DQN, ["--gamma", "x"], "must be a number, not 'x'"),
        (DQN, ["--batch-size", "1.5"], "must be a whole number, not '1.5'"),
        (DQN, ["--hidden-sizes", "a"], "must be whole numbers, as in 128,128"),
        (DQN, ["--loss", "l1"], "invalid choice: 'l1'"),
        (DQN, ["--params"], "expected at least one argument"),
        (DQN, ["--gama", "1"], "unknown flag '--gama'; did you mean --gamma?"),
        (DQN, ["--hidden"], "unknown flag '--hidden'"),  # nothing is abbreviated
        (DQN, ["--save-every=3"], "unknown flag '--save-every'"),  # of another algorithm
        (DQN, ["surplus"], "unknown flag 'surplus'"),
        (REINFORCE, ["--episods=5"], "unknown flag '--episods'; did you mean --episodes?"),
        (REINFORCE, ["--episodes", "many"], "must be a whole number, not 'many'"),
        (DOCUMENT, ["--batch-episodes=2"], "unknown flag '--batch-episodes'"),
    ],
)
def test_wrong_flags_exit_with_2(kind: AlgorithmKind, flags: list[str], words: str, capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        choose(kind, flags)
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert "error:" in error and words in error
    assert len(error.splitlines()) == 2, "no list of all flags"


def test_wrong_names_elsewhere_name_the_nearest(empty: str) -> None:
    line = refusal(DQN, empty, "--params", "gama=1")
    assert "--params: unknown option 'gama'; did you mean gamma" in line
    assert "parameters: unknown parameter 'gama'; did you mean gamma" in refusal(DQN, empty, gama=1)
    assert "--params: 'gamma' isn't KEY=VALUE" in refusal(DQN, empty, "--params", "gamma")
    line = refusal(DQN, empty, double="maybe")
    assert "parameters: double must be true or false, not 'maybe'" in line


def test_a_training_has_an_end(empty: str) -> None:
    assert "a training needs an end" in refusal(REINFORCE, empty, "--episodes=0")
    assert choose(REINFORCE, [empty, "--episodes=0", "--total-timesteps=9"]).run.episodes == 0


@pytest.mark.parametrize(
    ("kind", "flags", "words"),
    [
        (DQN, "1000 --learning-starts=5000", "learning starts after 5000 .* training ends after 1000"),
        (DQN, "3000 --learning-starts=300", ""),
        (REINFORCE, "1000", ""),
        pytest.param(
            ALGORITHMS["sac"], "100", "after 100 .* ends after 100",
            marks=pytest.mark.extras("stable_baselines3"),
        ),
    ],
)  # fmt: skip
def test_options_that_leave_nothing_to_learn_are_doubted(empty, kind, flags, words) -> None:
    doubt = choose(kind, [empty, *f"--total-timesteps={flags}".split()]).doubt()
    assert bool(doubt) == bool(words) and re.search(words, doubt)


@pytest.mark.parametrize("name", ALL)
def test_help_explains_every_option(name: str, capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        choose(algorithm(name), ["--help"], prog="node.py")
    assert stop.value.code == 0
    told = capsys.readouterr().out
    assert algorithm(name).config in told
    own = {"dqn": "--preset", "ppo": "--clip-range", "sac": "--ent-coef"}.get(name, "--save-every")
    assert all(flag in told for flag in ("--params", "--resume", "--stop-at-return", own))


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
        assert getattr(read(tmp_path, "{}", DQN, f"{flag}={text}").run, name) == wanted


def test_which_of_them_count_where(tmp_path: Path) -> None:
    flags = ["--env-kwargs=a=1,b=1,c=1", "--train-env-kwargs=b=2,c=2", "--eval-env-kwargs=c=3"]
    run = read(tmp_path, "{}", DQN, *flags).run
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
