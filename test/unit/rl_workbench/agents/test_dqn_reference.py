"""The learner against another one, written from the definitions, step by step over an episode."""

import copy
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from rl_workbench.agents.dqn_agent import DQNAgent
from rl_workbench.agents.settings import DQNSettings

STEPS, GAMMA, ALL = 24, 0.9, 1000
ENDS = {7: "truncated", 15: "terminated"}  # after these steps


def episode_steps(seed: int = 0) -> list[tuple]:
    """Observation, action, reward, following observation, how it ended."""
    rng = np.random.default_rng(seed)
    observations = rng.normal(size=(STEPS, 2, 3)).astype(np.float32)
    return [
        (now, int(rng.integers(4)), float(rng.normal()), following, ENDS.get(index, ""))
        for index, (now, following) in enumerate(observations)
    ]


def transitions(steps: list[tuple], n: int, scale: float, bootstrap: bool) -> list[tuple]:
    """What n-step learning may use once the last of the steps was taken, by definition."""
    found = []
    for start, (observation, action, *_) in enumerate(steps):
        total, window = 0.0, steps[start : start + n]
        ends = [index for index, step in enumerate(window) if step[4]]
        window = window[: ends[0] + 1] if ends else window
        if not ends and len(window) < n:
            continue  # it waits for its successors
        for k, step in enumerate(window):
            total += GAMMA**k * step[2] * scale
        how = window[-1][4]
        valued = how == "" or (how == "truncated" and bootstrap)
        found.append((observation, action, total, window[-1][3], valued * GAMMA ** len(window)))
    return found


class Reference:
    """Plain torch: separate parameters, Adam as it comes, every transition in every batch."""

    def __init__(self, net: nn.Module, options: dict[str, Any]) -> None:
        self.net, self.target = copy.deepcopy(net), copy.deepcopy(net)
        self.options = options
        self.adam = torch.optim.Adam(self.net.parameters(), lr=options["learning_rate"])
        self.updates = 0

    def learn(self, batch: list[tuple], steps: int) -> None:
        options = self.options
        s, a, r, s_, discount = (torch.tensor(np.array(each)) for each in zip(*batch, strict=True))
        with torch.no_grad():
            rated = self.target(s_)
            best = (self.net(s_) if options["double"] else rated).argmax(1)
            goal = r.float() + discount.float() * rated[range(len(best)), best]
        error = self.net(s)[range(len(a)), a] - goal
        huber = torch.where(error.abs() < 1, 0.5 * error**2, error.abs() - 0.5)
        loss = (error**2 if options["loss"] == "mse" else huber).mean()
        self.adam.param_groups[0]["lr"] = options["learning_rate"] * (1 - steps / STEPS)
        self.adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.net.parameters(), options["max_grad_norm"])
        self.adam.step()
        self.updates += 1
        if self.updates % options["target_network_frequency"] == 0:
            pairs = zip(self.target.parameters(), self.net.parameters(), strict=True)
            for old, new in pairs:
                old.data += options["tau"] * (new.data - old.data)


@pytest.mark.parametrize(
    ("n_step", "double", "dueling", "loss", "tau", "bootstrap"),
    [(1, False, False, "mse", 1.0, False), (3, True, True, "huber", 0.1, True),
     (3, True, False, "mse", 1.0, True), (30, False, True, "huber", 0.3, False)],
)  # fmt: skip
def test_the_weights_go_the_way_of_the_definitions(
    n_step: int, double: bool, dueling: bool, loss: str, tau: float, bootstrap: bool
) -> None:
    options = {
        "n_step": n_step, "double": double, "dueling": dueling, "loss": loss, "tau": tau,
        "learning_rate": 0.01, "max_grad_norm": 0.5, "target_network_frequency": 2,
    }  # fmt: skip
    settings = DQNSettings(
        **options, gamma=GAMMA, reward_scale=0.5, bootstrap_truncated=bootstrap,
        lr_schedule="linear", total_timesteps=STEPS, hidden_sizes=(8, 8), batch_size=ALL,
    )  # fmt: skip
    learner = DQNAgent(settings, 3, 4, seed=5)
    reference, steps = Reference(learner.q_net, options), episode_steps()
    for index, (observation, action, reward, following, how) in enumerate(steps):
        learner.observe((observation, action, reward), following, how == "terminated", how == "truncated")
        batch = transitions(steps[: index + 1], n_step, 0.5, bootstrap)
        assert len(learner.buffer) == len(batch)
        if batch:
            learner.learn()
            reference.learn(batch, index + 1)
    assert reference.updates > 8
    for mine, theirs in ((learner.q_net, reference.net), (learner.target_net, reference.target)):
        for one, other in zip(mine.parameters(), theirs.parameters(), strict=True):
            assert torch.allclose(one, other, atol=2e-5)
    probe = np.random.default_rng(9).normal(size=(50, 3)).astype(np.float32)
    wanted = reference.net(torch.from_numpy(probe)).argmax(1).tolist()
    assert [learner.act_greedily(each) for each in probe] == wanted
