"""What is the policy gradients' own in a training: networks, tags by episode, batches."""

from pathlib import Path

import pytest
import torch
from support.training.training_runs import (
    EXACT,
    checkpoint,
    files,
    points,
    record,
    rows,
    summary,
    train,
)

from rl_workbench.agents.document import PolicyNetwork, ValueNetwork

NAMES = EXACT[1:]
BY_EPISODE = ("Reward", "Value Loss", "Policy Loss")


def load(path: Path) -> dict[str, torch.Tensor]:
    return torch.load(path, weights_only=True)


def networks(run: Path) -> set[str]:
    return {name for name in files(run) if name.endswith(".pth")}


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
    assert record(scaled)["hyperparameters"]["observation_scale"] == [1.0, 1.0, 0.1, 2.0]
