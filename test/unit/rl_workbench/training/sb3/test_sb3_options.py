"""Options of Stable-Baselines3's algorithms, their limits, and the models made of them."""

import inspect

import pytest
from support.training.training_runs import failure

from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.train import choose

pytestmark = pytest.mark.extras("stable_baselines3")


def chosen(algorithm: str, *flags: str) -> TrainingOptions:
    return choose(ALGORITHMS[algorithm], ["--env-id=CartPole-v1", *flags])


def model(algorithm: str, *flags: str):
    from rl_workbench.training.environments import training_environments
    from rl_workbench.training.sb3.models import make_learning_model

    options = chosen(algorithm, *flags)
    made = make_learning_model(options, training_environments(options))
    made.get_env().close()
    return made


def test_options_are_flags_and_a_small_number_may_be_written_as_people_do() -> None:
    flags = ["--learning-rate=1e-3", "--use-sde", "--no-normalize-advantage", "--n-epochs", "2"]
    own = chosen("ppo", *flags, "--params", "gamma=9e-1", "batch_size=5e1").record()
    own = own["hyperparameters"]
    assert (own["learning_rate"], own["gamma"], own["n_epochs"]) == (1e-3, 0.9, 2)
    assert own["batch_size"] == 50 and isinstance(own["batch_size"], int)
    assert own["use_sde"] is True and own["normalize_advantage"] is False
    assert (own["gae_lambda"], own["clip_range"]) == (0.95, 0.2), "what nobody gave is there, too"


def test_networks() -> None:
    for text in ("--net-arch=8,9", "--net-arch=[8, 9]"):
        layers = model("ppo", text).policy.mlp_extractor.policy_net
        assert [each.out_features for each in layers if hasattr(each, "out_features")] == [8, 9]
    continuous = ["--env-id=Pendulum-v1", "--log-std-init=-1.5"]
    assert model("ppo", *continuous).policy.log_std.item() == -1.5


def test_a_linear_rate_falls_from_the_algorithms_own() -> None:
    made = model("a2c", "--lr-schedule=linear")
    assert made.lr_schedule(1.0) == pytest.approx(7e-4) and made.lr_schedule(0.0) == 0.0


def test_how_often_it_learns_may_be_told_in_episodes() -> None:
    made = model("sac", "--env-id=Pendulum-v1", "--params", "train_freq=[1, episode]")
    assert (made.train_freq.frequency, made.train_freq.unit.value) == (1, "episode")


def test_noise_of_actions_is_a_standard_deviation() -> None:
    made = model("td3", "--env-id=Pendulum-v1", "--action-noise=0.2")
    assert made.action_noise._sigma.tolist() == [0.2]


CHOICES = "can't choose from Discrete(2), the actions of CartPole-v1; ppo, a2c, dqn-sb3, dqn, reinforce"


@pytest.mark.parametrize(
    ("algorithm", "flags", "told"),
    [
        ("ppo", "--n-epochs=0", "n_epochs must be at least 1, not 0"),
        ("ppo", "--params net_arch=[", "--params: net_arch must be a YAML value, not '['"),
        ("ppo", "--num-envs=0", "num_envs must be between 1 and 1024, not 0"),
        ("ppo", "--net-arch=64,wide", "net_arch must be whole numbers, as in 64,64, not '64,wide'"),
        *((name, "", f"{name} {CHOICES} fit it") for name in ("sac", "td3", "ddpg")),
        ("dqn-sb3", "--env-id=Pendulum-v1", "Pendulum-v1; ppo, a2c, sac, td3, ddpg fit it"),
    ],
)
def test_options_that_do_not_fit_are_one_line(algorithm: str, flags: str, told: str) -> None:
    assert told in failure(lambda: model(algorithm, *flags.split()))


@pytest.mark.parametrize("algorithm", ["ppo", "a2c", "sac", "td3", "ddpg", "dqn-sb3"])
def test_options_and_defaults_are_the_librarys(algorithm: str) -> None:
    """They are written out, since importing the library takes seconds of every --help."""
    import stable_baselines3

    settings = ALGORITHMS[algorithm].hyperparameters()
    ours = {
        "self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "_init_setup_model",
        "stats_window_size", "policy_kwargs", "replay_buffer_class", "replay_buffer_kwargs",
        "rollout_buffer_class", "rollout_buffer_kwargs",
    }  # fmt: skip
    made = getattr(stable_baselines3, settings.library_class)
    parameters = inspect.signature(made.__init__).parameters
    wanted = {name: each.default for name, each in parameters.items() if name not in ours}
    own = settings().own
    assert own.pop("net_arch") is own.pop("log_std_init") is None
    assert own == wanted
