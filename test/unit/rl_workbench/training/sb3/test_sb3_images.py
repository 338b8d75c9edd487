"""Images: the CNN that learns from them, what is refused, and the policies of one's own."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from support.training import training_runs, workbench_runs
from support.training.learning_fakes import register_with
from support.training.training_runs import InterruptAfter, assert_same_run, options_of, run, summary

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options
from rl_workbench.tools.policies import load_learned
from rl_workbench.tools.runs import open_run
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import RunOptions

pytestmark = pytest.mark.extras("stable_baselines3")

SIZE = 36  # [pixels]
SMALL = {"n_steps": 32, "batch_size": 32, "n_epochs": 1, "net_arch": "8", "total_timesteps": 64,
         "eval_frequency": 0, "eval_episodes": 1, "checkpoint_frequency": 32}  # fmt: skip


class Dot(gymnasium.Env):
    """A bright bar on the left or the right; the action is to name the side."""

    dtype, brightest = np.uint8, 255
    action_space = spaces.Discrete(2)

    def __init__(self) -> None:
        self.observation_space = spaces.Box(0, self.brightest, (SIZE, SIZE, 3), self.dtype)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._steps = 0
        return self._look(), {}

    def _look(self):
        self._side = int(self.np_random.integers(2))
        image = np.zeros((SIZE, SIZE, 3), self.dtype)
        image[:, 20 * self._side : 20 * self._side + 10, 1] = self.brightest
        return image

    def step(self, action):
        reward, self._steps = float(action == self._side), self._steps + 1
        info = {"side": self._side, "steps, so far": np.float32(self._steps), "named": True}
        return self._look(), reward, False, self._steps == 8, info


class Floats(Dot):
    dtype, brightest = np.float32, 1.0


class Labelled(Dot):
    """The image, and a number beside it."""

    def __init__(self) -> None:
        super().__init__()
        parts = {"image": self.observation_space, "number": spaces.Box(-1, 1, (1,))}
        self.observation_space = spaces.Dict(parts)

    def _look(self):
        return {"image": super()._look(), "number": np.zeros(1, np.float32)}


def brighten(env: gymnasium.Env) -> gymnasium.Env:
    """From floats to what a CNN takes."""
    space = spaces.Box(0, 255, (SIZE, SIZE, 3), np.uint8)
    return gymnasium.wrappers.TransformObservation(env, lambda image: (255 * image).astype(np.uint8), space)


WRAPPER = f"{__name__}:brighten"


def policy_of(monkeypatch: pytest.MonkeyPatch, kind: type[Dot], **changed: object):
    from rl_workbench.training.sb3.models import make_learning_model

    options = options_of("ppo", SMALL | {"env_id": register_with(monkeypatch, kind)} | changed)
    env = make_environment(options.run.env_id, keep_dict=True, wrapper=options.run.wrapper)
    return make_learning_model(options, [env]).policy


@pytest.mark.slow
def test_a_cnn_learns_from_images_and_resumes(tmp_path: Path, monkeypatch, capsys) -> None:
    env_id = register_with(monkeypatch, Dot)
    whole = run(options_of("ppo", SMALL | {"env_id": env_id}), tmp_path / "whole")
    interrupt = InterruptAfter(40)
    part = run(options_of("ppo", SMALL | {"env_id": env_id}), tmp_path / "part", interrupt)
    assert summary(part)["steps"] == 32
    assert_same_run(whole, training_runs.resume(part))
    learned, out = load_learned(open_run(whole)), tmp_path / "policy.pt"
    assert type(learned.env.observation_space) is spaces.Box
    assert cli.main(["eval", str(whole), "--episodes=2"]) == 0
    assert cli.main(["export", str(whole), f"--out={out}"]) == 1
    told = capsys.readouterr().err
    assert "can't be exported: only Stable-Baselines3 computes it (images" in told


def test_the_policy_is_chosen_by_the_observations(monkeypatch: pytest.MonkeyPatch) -> None:
    extractor = type(policy_of(monkeypatch, Dot).features_extractor).__name__
    assert extractor == "NatureCNN"
    parts = policy_of(monkeypatch, Labelled).features_extractor.extractors
    assert type(parts["image"]).__name__ == "NatureCNN"
    asked = policy_of(monkeypatch, Dot, policy="MlpPolicy").features_extractor
    assert type(asked).__name__ == "FlattenExtractor"


def test_arguments_of_the_policy_may_be_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "activation_fn=torch.nn:ELU, ortho_init=false"
    given = Options(RunOptions).read({"env_kwargs": text}, "")["env_kwargs"]
    policy = policy_of(monkeypatch, Dot, policy_kwargs=given)
    assert policy.activation_fn.__name__ == "ELU" and policy.ortho_init is False
    with pytest.raises(WorkbenchError, match="--policy-kwargs activation_fn= torch.nn:Elu: "):
        policy_of(monkeypatch, Dot, policy_kwargs={"activation_fn": "torch.nn:Elu"})
    with pytest.raises(WorkbenchError, match="it is neither a torch Module nor an Optimizer"):
        policy_of(monkeypatch, Dot, policy_kwargs={"activation_fn": "os:getcwd"})
    with pytest.raises(WorkbenchError, match="ppo can't be made: Policy CnnPolice unknown"):
        policy_of(monkeypatch, Dot, policy="CnnPolice")
    theirs = "stable_baselines3.common.policies:ActorCriticCnnPolicy"
    own = policy_of(monkeypatch, Dot, policy=theirs)
    assert type(own).__name__ == "ActorCriticCnnPolicy"


@pytest.mark.parametrize("algorithm", ["dqn", "reinforce"])
def test_our_own_refuse_images_and_say_what_takes_them(algorithm, tmp_path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, Dot)
    words = rf"{env_id} observes images, uint8 of \(36, 36, 3\): .* --algo ppo, a2c or dqn-sb3"
    with pytest.raises(WorkbenchError, match=words):
        run(options_of(algorithm, {"env_id": env_id, "episodes": 1}), tmp_path / "run")


def test_images_of_another_form_are_refused_unless_a_wrapper_mends_them(monkeypatch) -> None:
    env_id = register_with(monkeypatch, Floats)
    with pytest.raises(WorkbenchError, match=r"float32 of .*: a CNN takes uint8 from 0 to 255"):
        make_environment(env_id, keep_dict=True)
    env = make_environment(env_id, keep_dict=True, wrapper=WRAPPER)
    assert env.reset(seed=0)[0].max() == 255
    with pytest.raises(WorkbenchError, match="^--wrapper no_module:f: No module named"):
        make_environment(env_id, wrapper="no_module:f")


@pytest.mark.slow
def test_the_wrapper_belongs_to_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = SMALL | {"env_id": register_with(monkeypatch, Floats), "wrapper": WRAPPER}
    folder = run(options_of("ppo", given), tmp_path / "run")
    assert load_learned(open_run(folder)).env.observation_space.dtype == np.uint8
    assert summary(folder)["run"]["wrapper"] == WRAPPER


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["dqn", "reinforce", "ppo"])
def test_numbers_in_info_become_curves(algorithm: str, tmp_path: Path, monkeypatch) -> None:
    class Telling(Dot):
        def __init__(self) -> None:
            self.observation_space = spaces.Box(0, 1, (2,))

        def _look(self):
            self._side = 1
            return np.zeros(2, np.float32)

    make = {"dqn": workbench_runs.dqn, "ppo": workbench_runs.sb3}.get(algorithm)
    given = {"env_id": register_with(monkeypatch, Telling), "eval_frequency": 0}
    if make:
        folder = make(tmp_path / "run", total_timesteps=64, **given)
    else:
        folder = workbench_runs.policy_gradient(tmp_path / "run", "reinforce", episodes=2, **given)
    found = [row for row in training_runs.rows(folder) if row[1].startswith("info/")]
    assert found[:2] == [("8", "info/side", "1.0"), ("8", "info/steps_so_far", "4.5")]
