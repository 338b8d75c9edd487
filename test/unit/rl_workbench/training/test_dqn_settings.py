"""The options of dqn_train.py: flags, rosparams, --params and YAML."""

from pathlib import Path

import pytest
import yaml

from rl_workbench.agents.dqn.settings import DQNSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn.settings import Choice, RunSettings, choose, config, from_config

EMPTY = "{}\n"


@pytest.fixture
def empty(tmp_path: Path) -> str:
    """A configuration that says nothing, so that the defaults show."""
    path = tmp_path / "empty.yaml"
    path.write_text(EMPTY)
    return f"--config={path}"


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "options.yaml"
    path.write_text(text)
    return f"--config={path}"


def test_defaults(empty: str) -> None:
    assert choose([empty], {}) == Choice(RunSettings(), DQNSettings(), None)


def test_the_fields_names(empty: str) -> None:
    text = """--env-id Acrobot-v1 --seed 3 --total-timesteps 2e4 --learning-rate 0.01
        --buffer-size 9 --gamma 0.9 --batch-size 8 --target-network-frequency 7 --tau 0.5
        --start-e 0.9 --end-e 0.1 --exploration-fraction 0.3 --learning-starts 6
        --train-frequency 5 --gradient-steps 4 --no-double --dueling --hidden-sizes 8,9
        --exp-name mine --run-dir out --eval-frequency 0 --checkpoint-frequency 2"""
    run, dqn, resume = choose([empty, *text.split()], {})
    assert (run.env_id, run.seed, run.exp_name, run.run_dir) == ("Acrobot-v1", 3, "mine", "out")
    assert (run.eval_frequency, run.checkpoint_frequency, resume) == (0, 2, None)
    assert dqn == DQNSettings(
        total_timesteps=20_000, learning_rate=0.01, buffer_size=9, gamma=0.9, batch_size=8,
        target_network_frequency=7, tau=0.5, start_e=0.9, end_e=0.1, exploration_fraction=0.3,
        learning_starts=6, train_frequency=5, gradient_steps=4, double=False, dueling=True,
        hidden_sizes=(8, 9),
    )  # fmt: skip


def test_file_params_rosparams_flags_in_this_order(tmp_path: Path) -> None:
    file = written(tmp_path, "CartPole-v1: {gamma: 0.1, n_step: 1, tau: 0.1, batch_size: 1}")
    flags = [file, "--params", "n_step=2", "tau=0.2", "batch_size=2", "--batch-size=4"]
    dqn = choose(flags, {"tau": 0.3, "batch_size": 3}).dqn
    assert (dqn.gamma, dqn.n_step, dqn.tau, dqn.batch_size) == (0.1, 2, 0.3, 4)


def test_empty_parameters_are_not_given(empty: str) -> None:
    assert choose([empty], {"seed": "", "resume": "", "config": "", "env_id": ""}).run.seed == 0


def test_parameters_as_roslaunch_has_them(empty: str) -> None:
    choice = choose([empty], {"params": "gamma=0.9 n-step=2", "dueling": True, "seed": "4"})
    assert (choice.dqn.gamma, choice.dqn.n_step, choice.dqn.dueling) == (0.9, 2, True)
    assert choice.run.seed == 4


def test_options_of_the_environment(empty: str) -> None:
    run = choose([empty, "--env-kwargs=max_steps=5,backend=bullet"], {}).run
    assert run.env_kwargs == {"max_steps": 5, "backend": "bullet"}
    run = choose([empty, "--env-kwargs=noise=1e-3,render_mode=1e,backend=null"], {}).run
    assert run.env_kwargs == {"noise": 0.001, "render_mode": "1e", "backend": None}


@pytest.mark.parametrize("text", ["noise=[1", "noise", "a={"])
def test_options_of_the_environment_that_cannot_be_read(text: str, tmp_path: Path, capsys) -> None:
    with pytest.raises(SystemExit):
        choose([f"--env-kwargs={text}"], {})
    assert "env-kwargs: must be KEY=VALUE" in capsys.readouterr().err
    with pytest.raises(WorkbenchError, match="env_kwargs must be KEY=VALUE"):
        choose([], {"env_kwargs": text})


@pytest.mark.parametrize("value", [".inf", "2020-01-01", "[1, .nan]", "{a: 2020-01-01}", "{1: 2}"])
def test_options_of_the_environment_that_no_record_can_hold(tmp_path: Path, value: str) -> None:
    file = written(tmp_path, f"CartPole-v1: {{env_kwargs: {{noise: {value}}}}}")
    with pytest.raises(WorkbenchError, match="env_kwargs has values that no file can hold"):
        choose([file], {})


def test_infinity_is_beyond_every_limit(tmp_path: Path) -> None:
    """config.json couldn't hold it."""
    with pytest.raises(WorkbenchError, match="max_grad_norm lies between"):
        choose([written(tmp_path, "max_grad_norm: .inf")], {})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("CartPole-v1: {gama: 1}", "unknown option 'gama'; did you mean gamma"),
        ("CartPole-v1: {gamma: high}", "gamma must be a number, not 'high'"),
        ("CartPole-v1: {gamma: 1.5}", "gamma lies between 0 and 1, not 1.5"),
        ("CartPole-v1: {gamma: .nan}", "gamma lies between"),
        ("CartPole-v1: {double: 1}", "double must be true or false, not 1"),
        ("CartPole-v1: {batch_size: 1.5}", "batch_size must be a whole number"),
        ("CartPole-v1: {hidden_sizes: [a]}", "hidden_sizes must be whole numbers"),
        ("CartPole-v1: {hidden_sizes: [0]}", "hidden_sizes are positive"),
        ("CartPole-v1: {loss: l1}", "loss is one of mse, huber"),
        ("CartPole-v1: [1", "isn't YAML"),
        ("just text", "isn't a YAML file of options"),
        ("gamma: 0.9\ntau: 2", "tau lies between"),
    ],
)
def test_wrong_files_are_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(WorkbenchError, match=message) as raised:
        choose([written(tmp_path, text)], {})
    assert "\n" not in str(raised.value)


def test_a_missing_file_and_an_unknown_preset(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="can't read .*No such file"):
        choose([f"--config={tmp_path / 'none.yaml'}"], {})
    with pytest.raises(WorkbenchError, match="unknown preset 'tutoral'; did you mean tutorial"):
        choose(["--preset=tutoral"], {})


@pytest.mark.parametrize(
    "flags",
    [["--gamma", "x"], ["--batch-size", "1.5"], ["--loss", "l1"], ["--gama", "1"], ["surplus"],
     ["--hidden-sizes", "a"], ["--params"]],
)  # fmt: skip
def test_wrong_flags_exit_with_2(flags: list[str], capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        choose(flags, {})
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert "error:" in error and len(error.splitlines()) == 2, "no list of all flags"
    assert flags[0] != "--gama" or "unknown flag '--gama'; did you mean --gamma?" in error


def test_wrong_names_elsewhere_name_the_nearest(empty: str) -> None:
    with pytest.raises(WorkbenchError, match="--params: unknown option 'gama'; did you mean gamma"):
        choose([empty, "--params", "gama=1"], {})
    with pytest.raises(WorkbenchError, match="'gama'; did you mean gamma"):
        choose([empty], {"gama": 1})
    with pytest.raises(WorkbenchError, match="isn't KEY=VALUE"):
        choose([empty, "--params", "gamma"], {})


def test_every_section_of_the_file_is_right(root: Path) -> None:
    sections = yaml.safe_load((root / "config/dqn.yaml").read_text())
    for name in sections:
        run, _, _ = choose(["--preset", name], {})
        if name != "tutorial":
            assert choose(["--env-id", name], {}).run.env_id == name
        assert run.seed == 0, "a seed is nothing to tune"


def test_the_tutorials_defaults() -> None:
    run, dqn, _ = choose(["--preset", "tutorial"], {})
    assert (run.env_id, run.episodes) == ("CartPole-v1", 500)
    assert dqn == DQNSettings(
        total_timesteps=250_000, learning_rate=1e-3, buffer_size=10_000, learning_starts=0,
        batch_size=64, train_frequency=1, gradient_steps=1, gamma=0.99, double=False,
        hidden_sizes=(128, 128), loss="mse", max_grad_norm=10, target_network_frequency=10,
        epsilon_schedule="step", start_e=1, end_e=0.01, epsilon_decay=0.995,
        bootstrap_truncated=False,
    )  # fmt: skip


def test_a_preset_may_name_the_environment_and_a_flag_another() -> None:
    run, dqn, _ = choose(["--preset=tutorial", "--env-id=Acrobot-v1"], {})
    assert run.env_id == "Acrobot-v1" and dqn.target_network_frequency == 10


def test_resuming_takes_no_other_settings(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="allows no --gamma, only --total-timesteps"):
        choose(["--resume", str(tmp_path), "--gamma=0.5"], {})


def test_a_configuration_survives_being_written() -> None:
    run, dqn, _ = choose(["--env-kwargs=max_steps=5"], {})
    assert from_config(config(run, dqn), "here") == (run, dqn)
    with pytest.raises(WorkbenchError, match="isn't the configuration of a DQN"):
        from_config({"algorithm": "pg"}, "here")
