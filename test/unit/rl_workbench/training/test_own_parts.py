"""What is one algorithm's own in a training: networks, tags, batches; DQN's checkpoint and its episode."""

from pathlib import Path

import pytest
import torch
from support.training import training_runs as runs
from support.training.training_runs import EXACT, checkpoint, points, rows, summary, train
from torch import nn

from rl_workbench.agents.document import PolicyNetwork, ValueNetwork
from rl_workbench.agents.dqn_agent import Epsilon

NAMES = EXACT[1:]
BY_EPISODE = ("Reward", "Value Loss", "Policy Loss")


def load(path: Path) -> dict[str, torch.Tensor]:
    return torch.load(path, weights_only=True)


def networks(run: Path) -> set[str]:
    return {name for name in runs.files(run) if name.endswith(".pth")}


@pytest.mark.parametrize("name", NAMES)
def test_networks_are_saved_every_so_often(tmp_path: Path, name: str) -> None:
    """The first episode is number 0, as in the existing script."""
    run = train(tmp_path / "run", name, episodes=5, save_every=2)
    suffixes = ("", "_episode_0", "_episode_2", "_episode_4")
    assert networks(run) == {
        f"{kind}_network{suffix}.pth" for kind in ("policy", "value") for suffix in suffixes
    }
    agent = checkpoint(run)["agent"]
    for kind in ("policy", "value"):
        found = load(run / f"{kind}_network.pth")
        assert set(found) == set(agent[kind])
        assert all(torch.equal(found[key], agent[kind][key]) for key in found)
    before = load(run / "policy_network_episode_0.pth")
    assert not torch.equal(before["fc.weight"], agent["policy"]["fc.weight"])
    run = train(tmp_path / "few", name, episodes=5, save_every=0)
    assert networks(run) == {"policy_network.pth", "value_network.pth"}


def test_the_documents_networks_load_them(whole) -> None:
    run = whole("reinforce-document")
    PolicyNetwork().load_state_dict(load(run / "policy_network.pth"))
    ValueNetwork().load_state_dict(load(run / "value_network.pth"))


@pytest.mark.parametrize(("name", "updates"), [("reinforce", 4), ("reinforce-document", 13)])
def test_tags_by_episode_and_by_step(whole, name: str, updates: int) -> None:
    result, shown = summary(whole(name)), points(whole(name))
    ends = [sum(result["lengths"][: count + 1]) for count in range(13)]
    assert [step for step, _ in shown["charts/episodic_return"]] == ends
    assert [step for step, _ in shown["Reward"]] == list(range(13))
    assert [value for _, value in shown["Reward"]] == pytest.approx(result["returns"])
    batches = range(2, 12, 3) if name == "reinforce" else range(13)  # of three episodes
    for tag, by_step in (("Value Loss", "value_loss"), ("Policy Loss", "policy_loss")):
        assert [step for step, _ in shown[tag]] == list(batches)
        assert [step for step, _ in shown[f"losses/{by_step}"]] == [ends[i] for i in batches]
        assert [value for _, value in shown[tag]] == [v for _, v in shown[f"losses/{by_step}"]]
        assert len(shown[tag]) == updates
    assert {tag for _, tag, _ in rows(whole(name))} >= set(BY_EPISODE)


def test_the_scale_of_observations_counts(whole, tmp_path: Path) -> None:
    scaled = train(tmp_path / "scaled", "reinforce", observation_scale="1,1,0.1,2")
    assert summary(scaled)["returns"] != summary(whole("reinforce"))["returns"]
    ones = train(tmp_path / "ones", "reinforce", observation_scale="1,1,1,1")
    assert summary(ones)["returns"] == summary(whole("reinforce"))["returns"]
    assert runs.record(scaled)["hyperparameters"]["observation_scale"] == [1.0, 1.0, 0.1, 2.0]


# DQN.


@pytest.mark.slow
def test_a_checkpoint_has_the_documents_keys_and_no_more_than_its_weights(whole) -> None:
    content = checkpoint(whole("dqn"))
    assert {"q_net", "target_net", "epsilon", "optimizer", "replay"} <= set(content)
    theirs = nn.Module()  # the layers of the DQN tutorial's class
    layers = [nn.Linear(4, 16), nn.ReLU(), nn.Linear(16, 16), nn.ReLU(), nn.Linear(16, 2)]
    theirs.net = nn.Sequential(*layers)
    theirs.load_state_dict(content["q_net"])
    assert content["q_net"]["net.0.weight"].untyped_storage().nbytes() == 16 * 4 * 4
    assert content["config"]["hyperparameters"]["hidden_sizes"] == (16, 16)


def test_epsilon_is_logged_at_each_episodes_end(whole) -> None:
    settings, wanted = runs.small("dqn").hyperparameters, []
    for step, _ in points(whole("dqn"))["charts/episodic_length"]:
        epsilon = Epsilon(settings)
        epsilon.step_done(step)
        wanted.append(epsilon.value)
    assert [float(each) for _, tag, each in rows(whole("dqn")) if tag == "charts/epsilon"] == wanted


def test_losses_are_logged_every_so_many_steps_from_the_first_one_on(whole) -> None:
    steps = [step for step, _ in points(whole("dqn"))["losses/td_loss"]]
    assert steps == list(range(60, 401, 20))
    assert steps == [step for step, _ in points(whole("dqn"))["losses/q_values"]]


@pytest.mark.slow
def test_an_environment_that_goes_another_way_costs_its_episode(tmp_path: Path, capsys) -> None:
    run = train(tmp_path / "run", "dqn", runs.InterruptAfter(90))
    content = torch.load(run / "last.pt", weights_only=True)
    assert len(content["environment"]["episode"]["actions"]) > 0
    content["environment"]["episode"]["observation"] += 1
    torch.save(content, run / "last.pt")
    runs.resume(run)
    assert "the current episode is abandoned" in capsys.readouterr().err
    assert summary(run)["complete"]
