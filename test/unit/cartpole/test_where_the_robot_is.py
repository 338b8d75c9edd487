"""pg_train.py's robot, where options of the environment say where it is."""

import pytest

from cartpole.pg_train import choose


@pytest.mark.parametrize("flag", ["--env-kwargs", "--train-env-kwargs"])
def test_a_backend_among_the_environments_options_counts(flag: str) -> None:
    options, _ = choose([flag, "backend=bullet", "--start-noise=0.1"], {})
    assert options.run.training_environment == {"backend": "bullet", "noise": 0.1}


def test_a_flag_wins_over_it() -> None:
    options, _ = choose(["--env-kwargs=backend=bullet", "--backend=ros"], {})
    assert options.run.training_environment["backend"] == "ros"
    options, _ = choose(["--env-kwargs=backend=bullet", "--realtime"], {})
    assert options.run.training_environment["backend"] == "ros-realtime"


def test_an_empty_parameter_is_none() -> None:
    """As roslaunch has an argument that nobody gave."""
    options, _ = choose(["--env-kwargs=backend=bullet"], {"backend": "", "realtime": ""})
    assert options.run.training_environment["backend"] == "bullet"


def test_wrong_ones_are_told_with_those_that_there_are(capsys) -> None:
    with pytest.raises(SystemExit):
        choose(["--backend=gazebo"], {})
    told = capsys.readouterr().err
    assert "(choose from 'ros', 'bullet')" in told
    assert told.startswith("usage: pg_train.py [--help] [--OPTION VALUE ...]")
