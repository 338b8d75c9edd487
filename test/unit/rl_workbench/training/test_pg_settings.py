"""The options of pg_train.py: flags, rosparams, --params and YAML."""

from pathlib import Path

import pytest
import yaml

from rl_workbench.agents.pg.settings import ReinforceSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.config_file import default_file
from rl_workbench.training.pg.settings import (
    OPTIONS,
    Choice,
    Settings,
    choose,
    config,
    from_config,
)


def run_of(flags: list[str], parameters: dict | None = None) -> Settings:
    return choose(flags, parameters or {}).run


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "options.yaml"
    path.write_text(text)
    return f"--config={path}"


def refused(capsys, flags: list[str]) -> str:
    with pytest.raises(SystemExit) as stop:
        choose(flags, {})
    assert stop.value.code == 2
    return capsys.readouterr().err


def test_defaults() -> None:
    assert choose([], {}) == Choice(Settings(), ReinforceSettings(), None)
    assert Settings() == Settings(600, 0, "", 100, False, False, False, 0.0, "document", "ros", 0.0)


def test_every_flag_there_ever_was() -> None:
    flags = ["--episodes=5", "--seed=3", "--run-dir=out", "--save-every=2", "--realtime", "--gui"]
    flags += ["--random-weights", "--start-noise=0.05", "--stop-at=7"]
    assert run_of(flags) == Settings(5, 3, "out", 2, True, True, True, 0.05, stop_at=7.0)


def test_every_parameter() -> None:
    parameters = {
        "episodes": 5,
        "seed": 3,
        "run_dir": "my run",
        "save_every": 2,
        "realtime": True,
        "gui": True,
        "random_weights": True,
        "start_noise": 0.05,
    }
    assert run_of([], parameters) == Settings(5, 3, "my run", 2, True, True, True, 0.05)


def test_the_fields_names() -> None:
    text = """--algorithm gae --gamma 0.9 --gae-lambda 0.8 --policy-learning-rate 0.1 --value-epochs 3
        --value-learning-rate 0.2 --batch-episodes 4 --policy-hidden 8 --value-hidden 9
        --entropy-coefficient 0.01 --normalize-observations"""
    run, gae, _ = choose(text.split(), {})
    assert (run.algorithm, run.exp_name) == ("gae", "gae")
    assert gae == ReinforceSettings(
        gamma=0.9, gae_lambda=0.8, policy_learning_rate=0.1, value_learning_rate=0.2,
        value_epochs=3, batch_episodes=4, entropy_coefficient=0.01, policy_hidden=8,
        value_hidden=9, normalize_observations=True,
    )  # fmt: skip


def test_flags_win_over_parameters() -> None:
    chosen = run_of(["--episodes", "7", "--headless"], {"episodes": 5, "seed": 3, "gui": True})
    assert chosen == Settings(episodes=7, seed=3, gui=False)


def test_empty_and_false_parameters_are_defaults() -> None:
    parameters = {"run_dir": "", "realtime": False, "gui": False, "resume": "", "config": ""}
    assert run_of([], parameters) == Settings()


def test_file_params_rosparams_flags_in_this_order(tmp_path: Path) -> None:
    text = "cartpole/Balance-v0: {gamma: 0.1, value_epochs: 1, seed: 1, batch_episodes: 1}"
    flags = [written(tmp_path, text), "--algorithm=gae", "--batch-episodes=4"]
    flags += ["--params", "value_epochs=2", "seed=2", "batch-episodes=2"]
    run, gae, _ = choose(flags, {"seed": 3, "batch_episodes": 3})
    assert (gae.gamma, gae.value_epochs, run.seed, gae.batch_episodes) == (0.1, 2, 3, 4)


@pytest.mark.parametrize(
    "flags",
    [
        ["--episodes", "0"],
        ["--episodes", "-3"],
        ["--episodes", "many"],
        ["--episodes", "1.5"],
        ["--seed", "-1"],
        ["--seed", str(2**40)],
        ["--save-every", "-1"],
        ["--start-noise", "-0.1"],
        ["--start-noise", "0.3"],
        ["--start-noise", "nan"],
        ["--stop-at", "3001"],
        ["--gui", "--headless"],
        ["--algorithm", "sac"],
        ["--algorithm=gae", "--gamma=1.5"],
        ["surplus"],
    ],
)
def test_wrong_flags_exit_with_2_and_a_line(flags: list[str], capsys) -> None:
    assert "error:" in refused(capsys, flags)


def test_an_unknown_flag_is_refused_with_the_nearest(capsys) -> None:
    assert "unknown flag '--episods'; did you mean --episodes?" in refused(capsys, ["--episods=5"])


def test_an_unknown_parameter_is_refused_with_the_nearest() -> None:
    with pytest.raises(WorkbenchError, match="'episods'; did you mean episodes"):
        choose([], {"episods": 5})


def test_a_switch_must_be_true_or_false() -> None:
    with pytest.raises(WorkbenchError, match="realtime must be true or false, not 'yes'"):
        choose([], {"realtime": "yes"})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cartpole/Balance-v0: {gama: 1}", "unknown option 'gama'; did you mean gamma"),
        ("cartpole/Balance-v0: {gamma: high}", "gamma must be a number, not 'high'"),
        ("cartpole/Balance-v0: 3", "unknown option .cartpole/Balance-v0."),
        ("[", "isn't YAML"),
    ],
)
def test_a_wrong_file(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(WorkbenchError, match=words):
        choose([written(tmp_path, text)], {})


def test_another_environment_is_learned_by_gae_in_this_process() -> None:
    run, gae, _ = choose(["--env-id=MountainCar-v0"], {})
    assert (run.algorithm, run.backend, run.over_ros) == ("gae", "bullet", False)
    assert gae.normalize_observations


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--algorithm=document"], "the document's algorithm is made for the robot: X-v0 needs"),
        (["--backend=ros"], "X-v0 is made in this process"),
        (["--start-noise=0.1"], "--start-noise is of the robot"),
        (["--gui"], "--gui is of the robot"),
    ],
)
def test_what_is_the_robots_alone(capsys, flags: list[str], words: str) -> None:
    assert words in refused(capsys, ["--env-id=X-v0", *flags])


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--gamma=0.9"], "--gamma is an option of --algorithm gae"),
        (["--params", "batch_episodes=2"], "--batch-episodes is an option of --algorithm gae"),
        (["--env-kwargs=noise=0.1"], "--env-kwargs are for other environments"),
        (["--backend=bullet", "--gui"], "not with --backend bullet"),
        (["--algorithm=gae", "--random-weights"], "not with --algorithm gae"),
    ],
)
def test_what_does_not_go_together(capsys, flags: list[str], words: str) -> None:
    assert words in refused(capsys, flags)


def test_every_section_of_the_file_is_valid() -> None:
    sections = yaml.safe_load(default_file("pg.yaml").read_text())
    assert "CartPole-v1" in sections
    for env_id, section in sections.items():
        run, gae, _ = choose([f"--env-id={env_id}", "--algorithm=gae", "--backend=bullet"], {})
        for name, value in OPTIONS.read(section, env_id).items():
            assert getattr(run if hasattr(run, name) else gae, name) == value


def test_the_robots_section_is_the_defaults() -> None:
    """So that benchmark and documentation say the same."""
    assert choose(["--algorithm=gae"], {}).gae == ReinforceSettings()


def test_the_configuration_comes_back() -> None:
    choice = choose(["--env-id=CartPole-v1", "--seed=3", "--gamma=0.9", "--env-kwargs=a=1"], {})
    hyperparameters = {"gamma": 0.9, "batch_episodes": choice.gae.batch_episodes}
    again = from_config(config(choice, hyperparameters), "here")
    assert again.run == choice.run and again.gae.gamma == 0.9
    with pytest.raises(WorkbenchError, match="here isn't the configuration of a policy-gradient"):
        from_config({"algorithm": "dqn"}, "here")


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ([], "is no run folder"),
        (["--seed=1"], "--resume allows no --seed, only --episodes, --stop-at"),
        (["--config=x"], "allows no --config"),
    ],
)
def test_what_may_change_when_resuming(tmp_path: Path, flags: list[str], words: str) -> None:
    with pytest.raises(WorkbenchError, match=words):
        choose([f"--resume={tmp_path}", *flags], {})
