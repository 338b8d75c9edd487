"""The command line of pg_train.py, and its twin, the rosparams."""

import pytest

from cartpole.errors import CartpoleError
from cartpole.training.pg_settings import Settings, settings


def test_defaults() -> None:
    assert settings([], {}) == Settings(600, 0, None, 100, False, False, False, 0.0)


def test_every_flag() -> None:
    flags = ["--episodes=5", "--seed=3", "--run-dir=out", "--save-every=2", "--realtime", "--gui"]
    flags += ["--random-weights", "--start-noise=0.05"]
    assert settings(flags, {}) == Settings(5, 3, "out", 2, True, True, True, 0.05)


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
    assert settings([], parameters) == Settings(5, 3, "my run", 2, True, True, True, 0.05)


def test_flags_win_over_parameters() -> None:
    chosen = settings(["--episodes", "7", "--headless"], {"episodes": 5, "seed": 3, "gui": True})
    assert chosen == Settings(episodes=7, seed=3, gui=False)


def test_empty_and_false_parameters_are_defaults() -> None:
    assert settings([], {"run_dir": "", "realtime": False, "gui": False}) == Settings()


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
        ["--gui", "--headless"],
        ["--episods", "5", "--x"],
        ["surplus"],
    ],
)
def test_wrong_flags_exit_with_2_and_a_line(flags: list[str], capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        settings(flags, {})
    assert stop.value.code == 2
    assert "error:" in capsys.readouterr().err


def test_wrong_parameter_values_exit_with_2() -> None:
    with pytest.raises(SystemExit) as stop:
        settings([], {"episodes": "many"})
    assert stop.value.code == 2


def test_an_unknown_parameter_is_refused_with_the_nearest() -> None:
    with pytest.raises(CartpoleError, match="did you mean ~episodes"):
        settings([], {"episods": 5})


def test_a_switch_must_be_true_or_false() -> None:
    with pytest.raises(CartpoleError, match="~realtime must be true or false, not 'yes'"):
        settings([], {"realtime": "yes"})
