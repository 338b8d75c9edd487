"""What is DQN's own in a training: its checkpoint, its line, and the episode under way."""

from pathlib import Path

import numpy as np
import pytest
import torch
from support.training.training_runs import (
    InterruptAfter,
    checkpoint,
    points,
    resume,
    rows,
    small,
    summary,
    train,
)
from torch import nn

from rl_workbench.agents.dqn_agent import DQNAgent, Epsilon


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


def test_a_policy_moves_to_another_agent(whole) -> None:
    agent = DQNAgent(small("dqn").hyperparameters, 4, 2)
    agent.load_policy_state(checkpoint(whole("dqn"), "best.pt"))
    observation = np.ones(4, np.float32)
    assert agent.act_greedily(observation) == int(agent.q_values(observation[None]).argmax())


def test_epsilon_is_logged_at_each_episodes_end(whole) -> None:
    settings, wanted = small("dqn").hyperparameters, []
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
    run = train(tmp_path / "run", "dqn", InterruptAfter(90))
    content = torch.load(run / "last.pt", weights_only=True)
    assert len(content["environment"]["episode"]["actions"]) > 0
    content["environment"]["episode"]["observation"] += 1
    torch.save(content, run / "last.pt")
    resume(run)
    assert "the current episode is abandoned" in capsys.readouterr().err
    assert summary(run)["complete"]
