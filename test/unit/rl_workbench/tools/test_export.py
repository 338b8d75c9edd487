"""Policies as TorchScript: what the file does without this package, and what is refused."""

import json
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces
from support.training import workbench_runs
from support.training.workbench_runs import work

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools import torchscript
from rl_workbench.tools.policies import Player, load_learned
from rl_workbench.tools.runs import Run, open_run
from rl_workbench.tools.torchscript import open_exported
from rl_workbench.training.algorithms import ALGORITHMS

REACH = "robot_envs.robots:robot_envs/TwoLinkReachGoal-v0"
KINDS = {
    "plain": ("dqn", {"normalize_observations": "false"}),
    "dueling": ("dqn", {"dueling": "true"}),
    "robot": ("dqn", {"env_id": "cartpole:cartpole/Classic-v0"}),
    "pair": ("reinforce", {"observation_scale": "0.4,1,0.2,3"}),
    "hidden": ("reinforce", {"policy_hidden": 8, "normalize_observations": "true",
                             "observation_scale": "0.4,1,0.2,3"}),
    "three": ("reinforce", {"env_id": "Acrobot-v1", "episodes": 6, "eval_frequency": 0,
                            "env_kwargs": {"max_episode_steps": 30}}),
    "gaussian": ("reinforce", {"env_id": "Pendulum-v1", "episodes": 6, "eval_frequency": 0,
                               "env_kwargs": {"max_episode_steps": 30}}),
    "goals": ("reinforce", {"env_id": REACH, "episodes": 2, "batch_episodes": 1, "eval_frequency": 0,
                            "env_kwargs": {"max_steps": 20}, "normalize_observations": "true"}),
    "document": ("reinforce-document", {}),
}  # fmt: skip
CONTINUOUS = {"env_id": "Pendulum-v1", "eval_frequency": 0, "eval_episodes": 1}
OFF_POLICY = {"total_timesteps": 90, "learning_starts": 50, "buffer_size": 500, "n_steps": None,
              "batch_size": 16, "eval_frequency": 0, "eval_episodes": 1}  # fmt: skip
SB3 = {
    "ppo": ("ppo", {}),
    "ppo-box": ("ppo", CONTINUOUS),
    "ppo-sde": ("ppo", CONTINUOUS | {"use_sde": True}),
    "a2c": ("a2c", {"n_steps": 16, "batch_size": None, "net_arch": "[]"}),
    "sac": ("sac", CONTINUOUS | OFF_POLICY),
    "sac-sde": ("sac", CONTINUOUS | OFF_POLICY | {"use_sde": True}),
    "td3": ("td3", CONTINUOUS | OFF_POLICY),
    "ddpg": ("ddpg", CONTINUOUS | OFF_POLICY),
    "sac-her": ("sac", OFF_POLICY | {"env_id": REACH, "env_kwargs": {"max_steps": 20}, "her": True}),
    "dqn-sb3": ("dqn-sb3", OFF_POLICY | {"learning_rate": 0.01, "target_update_interval": 20, "seed": 2}),
}  # fmt: skip
ALONE = """
import json, sys
import torch
extra = {"metadata.json": ""}
policy = torch.jit.load(sys.argv[1], _extra_files=extra)
observations = torch.tensor(json.loads(sys.argv[2]), dtype=torch.float64)
strange = [name for name in sys.modules if name.split(".")[0] in ("rl_workbench", "gymnasium", "cartpole")]
print(json.dumps([policy(observations).tolist(), json.loads(extra["metadata.json"]), strange]))
"""


def train(folder: Path, name: str) -> Path:
    algorithm, options = (KINDS | SB3)[name]
    if name in SB3:
        return workbench_runs.sb3(folder, algorithm, **options)
    if algorithm == "dqn":
        return workbench_runs.dqn(folder, **{"total_timesteps": 200, **options})
    return workbench_runs.policy_gradient(folder, algorithm, **options)


def seen_by(space: spaces.Space) -> list:
    """Observations as a space of vectors, or of a dict of them, has them."""
    draw = np.random.default_rng(1).normal
    if isinstance(space, spaces.Dict):
        parts = {name: draw(size=(200, *each.shape)) for name, each in space.items()}
        single = [{name: part[n] for name, part in parts.items()} for n in range(200)]
        return [{name: part.astype(np.float32) for name, part in each.items()} for each in single]
    return list(draw(size=(200, *space.shape)).astype(np.float32))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("runs") / "dueling", "dueling")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [*KINDS, *(pytest.param(name, marks=pytest.mark.extras("stable_baselines3")) for name in SB3)]
)  # fmt: skip
def test_the_file_acts_as_the_policy(tmp_path: Path, name: str, capsys) -> None:
    run, out = train(tmp_path / "run", name), tmp_path / "folder" / "policy.pt"
    capsys.readouterr()
    assert work("export", run, "--out", out) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"{out}: the policy of {run.resolve()}/")
    policy, file = load_learned(open_run(run)), open_exported(out)
    observations = seen_by(policy.env.observation_space)
    wanted = np.array([policy.act(each) for each in observations])
    assert len(np.unique(wanted)) > 1, "there is something to choose"
    found = [file.act(each) for each in observations]
    assert all(policy.env.action_space.contains(each) for each in found)
    if isinstance(policy.env.action_space, spaces.Box):
        assert np.array(found) == pytest.approx(wanted, abs=1e-5)
    else:
        assert np.array(found).tolist() == wanted.tolist()
    assert file.metadata["algorithm"] == (KINDS | SB3)[name][0]
    policy.env.close()


@pytest.mark.slow
def test_torch_alone_runs_it(run: Path, tmp_path: Path) -> None:
    """Without our package, from double precision, and many observations at once."""
    out = tmp_path / "policy.pt"
    assert work("export", run, "--out", out, "--checkpoint", "last") == 0
    observations = np.random.default_rng(1).normal(size=(50, 4)).round(3)
    done = subprocess.run(
        [sys.executable, "-I", "-c", ALONE, out, json.dumps(observations.tolist())],
        capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    actions, metadata, strange = json.loads(done.stdout)
    policy = load_learned(open_run(run), "last")
    assert actions == [policy.act(each.astype(np.float32)) for each in observations]
    assert not strange
    assert metadata["env_id"] == "CartPole-v1" and metadata["checkpoint"] == "last.pt"
    assert metadata["observation_space"]["shape"] == [4]
    assert metadata["observation_space"]["low"][1] is None, "infinite"
    assert metadata["action_space"] == {"kind": "Discrete", "n": 2, "start": 0}
    assert metadata["versions"]["torch"] == torch.__version__
    policy.env.close()


class Reach(gymnasium.Env):
    """A goal to reach in a plane, observed in parts."""

    observation_space = spaces.Dict(
        desired_goal=spaces.Box(-1, 1, (2,), np.float64),
        achieved_goal=spaces.Box(-1, 1, (2,), np.float64),
        observation=spaces.Box(-9, 9, (3,), np.float32),
    )

    def __init__(self, actions: spaces.Space) -> None:
        self.action_space = actions

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation(), {}

    def step(self, action):
        return self._observation(), 0.0, bool(self.np_random.random() < 0.1), False, {}

    def _observation(self) -> dict[str, np.ndarray]:
        sizes = {"observation": 3, "achieved_goal": 2, "desired_goal": 2}
        return {name: self.np_random.normal(size=size) for name, size in sizes.items()}


FAR = spaces.Box(np.array([-2.0, 1.0]), np.array([3.0, 1.5]), dtype=np.float32)


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize(
    ("algorithm", "actions"),
    [("ppo", FAR), ("ppo", spaces.MultiDiscrete([3, 2])), ("ppo", spaces.MultiBinary(3)),
     ("a2c", spaces.Discrete(3)), ("sac", FAR), ("td3", FAR), ("dqn-sb3", spaces.Discrete(3))],
)  # fmt: skip
def test_observations_in_parts(algorithm: str, actions: spaces.Space) -> None:
    """As of environments with a goal; and every kind of action."""
    import stable_baselines3

    from rl_workbench.training.sb3.models import greedy_network

    env = Reach(actions)
    own = getattr(stable_baselines3, ALGORITHMS[algorithm].hyperparameters().library_class)
    model = own("MultiInputPolicy", env, seed=1)
    policy = Player(
        lambda seen: model.policy.predict(seen, deterministic=True)[0],
        env, greedy_network(model, algorithm), Path("best.pt"), 10,
    )  # fmt: skip
    run = Run(Path(), algorithm, "a test", "Reach-v0", {}, 0, {})
    module, metadata = torchscript.read(torchscript.export(run, policy))
    seen = seen_by(env.observation_space)
    found = module(torchscript.batch(seen)).numpy()
    assert found == pytest.approx(np.array([policy.act(each) for each in seen]), abs=1e-4)
    assert len(np.unique(found)) > 1 and actions.contains(found[0].astype(actions.dtype))
    assert sorted(metadata["observation_space"]["spaces"]) == sorted(env.observation_space)


def test_parts_that_are_no_vectors_of_numbers() -> None:
    env = Reach(FAR)
    env.observation_space = spaces.Dict(camera=spaces.Box(0, 255, (9, 9, 3), np.uint8))
    network = torch.nn.Linear(1, 1)
    policy = Player(lambda _: 0, env, network, Path("best.pt"), 10)
    run = Run(Path(), "ppo", "a test", "Reach-v0", {}, 0, {})
    with pytest.raises(WorkbenchError, match=r"Reach-v0 can't be exported: part camera of its"):
        torchscript.export(run, policy)


def test_files_that_are_no_exported_policies(run: Path, tmp_path: Path) -> None:
    good, bad = tmp_path / "policy.pt", tmp_path / "bad.pt"
    assert work("export", run, "--out", good) == 0
    content = good.read_bytes()
    with pytest.raises(WorkbenchError, match="No such file"):
        open_exported(tmp_path / "none.pt")
    for damaged in (b"", b"PK", content[: len(content) // 2], content.replace(b"format", b"fOrmat"),
                    (run / "best.pt").read_bytes()):  # fmt: skip
        bad.write_bytes(damaged)
        with pytest.raises(WorkbenchError, match="is damaged"):
            open_exported(bad)
    module = torch.nn.Linear(4, 2)
    bad.write_bytes(torchscript.written(module, {"format": "another's"}))
    with pytest.raises(WorkbenchError, match="of this version"):
        open_exported(bad)
    metadata = open_exported(good).metadata
    for name, wrong in (("env_id", None), ("env_kwargs", []), ("observation_space", "Box")):
        bad.write_bytes(torchscript.written(module, {**metadata, name: wrong}))
        with pytest.raises(WorkbenchError, match=f"has no {name} that can be read"):
            open_exported(bad)
