"""REINFORCE with a learned baseline in one file, to read from top to bottom.

    ./ws python3 examples/reinforce_single_file.py --seed 1

REINFORCE (Williams 1992) plays whole episodes and makes actions more probable that turned out better
than expected. The expected return, the baseline V(s), is fitted to the same episodes. How much
better an action was, its advantage, is estimated by weighted sums of temporal differences
(generalised advantages, Schulman et al. 2016). With --gae-lambda 1 these are whole returns less the
baseline, and with --value-epochs 0 the baseline stays as it was drawn: what is left is REINFORCE.

By default it learns to balance this project's robot, simulated in this process. In other environments
the observations' scale isn't known: --env-id CartPole-v1 --normalize-observations --batch-episodes 4
With the same options the project's own agent gets the same weights; a test checks this.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.utils.tensorboard import SummaryWriter

import cartpole  # noqa: F401  registers the robot's environments

ROBOT = "cartpole/Balance-v0"
SCALE = (0.4, 1.0, 0.2, 2.0)  # [m], [m/s], [rad], [rad/s]: magnitudes of the robot's observations


def option(default: Any, text: str, **how: Any) -> Any:
    """Makes a field of Args, with its arguments for argparse."""
    is_switch = isinstance(default, bool)
    kind = {"action": argparse.BooleanOptionalAction} if is_switch else {"type": type(default)}
    return field(default=default, metadata={**kind, "help": text, **how})


@dataclass
class Args:
    env_id: str = option(ROBOT, "one with vectors to observe and the actions 0, 1, 2, ...")
    seed: int = option(0, "of weights, actions and environment")
    episodes: int = option(600, "the training's length")
    gamma: float = option(0.99, "discount of rewards, for each step that they come later")
    gae_lambda: float = option(0.95, "of the advantages; 1: whole returns, 0: one step")
    policy_learning_rate: float = option(0.03, "of the policy's Adam")
    value_learning_rate: float = option(0.01, "of the baseline's Adam")
    value_epochs: int = option(20, "steps of the baseline for each batch")
    batch_episodes: int = option(1, "episodes for each step of the policy")
    entropy_coefficient: float = option(0.0, "weight of the policy's entropy in its loss")
    policy_hidden: int = option(0, "units in the policy's hidden layer; 0: none, it is linear")
    value_hidden: int = option(32, "units in each of the baseline's two hidden layers")
    normalize_observations: bool = option(False, "by mean and deviation as seen so far")


def parse_args(argv: list[str] | None = None) -> Args:
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    for each in fields(Args):
        flag = "--" + each.name.replace("_", "-")
        parser.add_argument(flag, default=each.default, **each.metadata)
    return Args(**vars(parser.parse_args(argv)))


def policy_network(inputs: int, actions: int, hidden: int) -> nn.Sequential:
    """Maps observations (N, D) to the probabilities of the actions (N, A), which start equal."""
    layers = [nn.Linear(inputs, hidden), nn.Tanh()] if hidden else []
    last = nn.Linear(hidden or inputs, actions)
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
    return nn.Sequential(*layers, last, nn.Softmax(dim=1))


def value_network(inputs: int, hidden: int) -> nn.Sequential:
    """Maps observations (N, D) to the baseline (N, 1), the expected return."""
    return nn.Sequential(
        nn.Linear(inputs, hidden), nn.Tanh(),
        nn.Linear(hidden, hidden), nn.Tanh(),
        nn.Linear(hidden, 1),
    )  # fmt: skip


class Normalizer:
    """Normalises observations to mean 0 and deviation 1 by running statistics (Welford's method)."""

    def __init__(self, size: int) -> None:
        self.count, self.mean, self.squares = 0, np.zeros(size), np.zeros(size)

    def update(self, observation: np.ndarray) -> None:
        self.count += 1
        deviation = observation - self.mean
        self.mean += deviation / self.count
        self.squares += deviation * (observation - self.mean)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        variance = self.squares / self.count if self.count > 1 else np.ones_like(self.squares)
        factor = (1.0 / np.sqrt(variance + 1e-8)).astype(np.float32)
        return np.clip((observations - self.mean.astype(np.float32)) * factor, -10.0, 10.0)


class Episode(NamedTuple):
    """An episode of T steps, with T + 1 observations."""

    observations: list[np.ndarray]
    actions: list[int]
    rewards: list[float]
    terminated: bool  # else it was cut off, and could have continued


def run_episode(env: gymnasium.Env, act: Callable[[np.ndarray], int], **reset: Any) -> Episode:
    """Runs one episode; `reset` may hold a seed."""
    observations, actions, rewards = [np.array(env.reset(**reset)[0], np.float32)], [], []
    terminated = truncated = False
    while not (terminated or truncated):
        actions.append(act(observations[-1]))
        observation, reward, terminated, truncated, _ = env.step(actions[-1])
        observations.append(np.array(observation, np.float32))
        rewards.append(float(reward))
    return Episode(observations, actions, rewards, bool(terminated))


def advantages_of(rewards: list[float], values: np.ndarray, args: Args) -> np.ndarray:
    """Returns how much better each of T actions was than the baseline expected, (T,).

    A step's temporal difference is δ = r + γ V(s') - V(s). An advantage is the sum of the differences
    from its step on, each weighing γλ times as much as the one before.

    Args:
        rewards: of T steps.
        values: the baseline at T + 1 states.
    """
    advantages, following = np.empty(len(rewards)), 0.0
    for t in reversed(range(len(rewards))):
        surprise = rewards[t] + args.gamma * values[t + 1] - values[t]
        advantages[t] = following = surprise + args.gamma * args.gae_lambda * following
    return advantages


def train(args: Args, writer: SummaryWriter) -> tuple[Any, ...]:
    """Returns policy, baseline, the function that acts greedily, and the returns of all episodes."""
    torch.set_num_threads(1)  # networks this small are slower with more
    torch.manual_seed(args.seed)
    rng = np.random.default_rng(args.seed)
    env: Any = gymnasium.make(args.env_id)
    size, actions = env.observation_space.shape[0], int(env.action_space.n)
    policy = policy_network(size, actions, args.policy_hidden)
    value = value_network(size, args.value_hidden)
    policy_optimizer = torch.optim.Adam(policy.parameters(), lr=args.policy_learning_rate)
    value_optimizer = torch.optim.Adam(value.parameters(), lr=args.value_learning_rate)
    factors = 1.0 / np.array(SCALE if args.env_id == ROBOT else (1.0,) * size, np.float32)
    normalizer = Normalizer(size)

    def prepared(observations: list[np.ndarray]) -> torch.Tensor:
        scaled = np.stack(observations) * factors
        return torch.from_numpy(normalizer(scaled) if args.normalize_observations else scaled)

    @torch.no_grad()
    def probabilities(observation: np.ndarray) -> np.ndarray:
        return policy(prepared([observation]))[0].double().numpy()

    def act(observation: np.ndarray) -> int:
        ends = np.cumsum(probabilities(observation))
        return min(int(np.searchsorted(ends, rng.random(), side="right")), actions - 1)

    def act_greedily(observation: np.ndarray) -> int:
        return int(probabilities(observation).argmax())

    returns, steps = [], 0
    batch: list[Episode] = []
    env.reset(seed=args.seed)  # only seeds the environment; every episode has a reset of its own
    for index in range(args.episodes):
        episode = run_episode(env, act)
        batch.append(episode)
        returns.append(sum(episode.rewards))
        steps += len(episode.rewards)
        writer.add_scalar("charts/episodic_return", returns[-1], steps)
        if (index + 1) % 20 == 0:
            print(f"episode {index + 1}: mean return of 20 {np.mean(returns[-20:]):.1f}")
        if len(batch) < args.batch_episodes:
            continue

        # Compare every action with the baseline. An episode that was cut off could have continued, so
        # its last state keeps its value; only a termination makes that 0.
        judged, wanted = [], []
        for episode in batch:
            with torch.no_grad():
                values = value(prepared(episode.observations)).squeeze(1).double().numpy()
            if episode.terminated:
                values[-1] = 0.0
            judged.append(advantages_of(episode.rewards, values, args))
            wanted.append(judged[-1] + values[:-1])
        advantages, targets = (
            torch.from_numpy(np.concatenate(each).astype(np.float32)) for each in (judged, wanted)
        )
        # Actions that did better than average become more probable, all others less.
        spread = float(advantages.std(correction=0))
        advantages = (advantages - advantages.mean()) / (spread + 1e-8)

        # One step of the policy: the gradient of the mean of A log π(a|s).
        seen = torch.cat([prepared(episode.observations[:-1]) for episode in batch])
        taken = torch.tensor([action for episode in batch for action in episode.actions])
        chances = policy(seen)
        chosen = torch.log(chances.gather(1, taken.unsqueeze(1)).squeeze(1))
        policy_loss = -(chosen * advantages).mean()
        if args.entropy_coefficient:  # keeps the policy from becoming deterministic too early
            entropy = torch.special.entr(chances.clamp_min(np.finfo(np.float32).tiny)).sum(1)
            policy_loss = policy_loss - args.entropy_coefficient * entropy.mean()
        policy_optimizer.zero_grad()
        policy_loss.backward()
        policy_optimizer.step()

        # Many steps of the baseline, to fit the returns closely.
        for _ in range(args.value_epochs):
            value_loss = nn.functional.mse_loss(value(seen).squeeze(1), targets)
            value_optimizer.zero_grad()
            value_loss.backward()
            value_optimizer.step()
        writer.add_scalar("losses/policy_loss", policy_loss.item(), steps)
        for observation in (each for episode in batch for each in episode.observations[:-1]):
            normalizer.update(observation * factors)
        batch = []
    env.close()
    return policy, value, act_greedily, returns


if __name__ == "__main__":
    args = parse_args()
    name = f"{args.env_id.replace('/', '_')}__reinforce__{args.seed}__{int(time.time())}"
    with SummaryWriter(f"runs/{name}") as writer:
        *_, act, _ = train(args, writer)
        # Without noise the robot always starts the same, so all greedy episodes would be identical.
        options: dict[str, Any] = {"noise": 0.02} if args.env_id == ROBOT else {}
        env = gymnasium.make(args.env_id, **options)
        greedy = [run_episode(env, act, seed=1_000_000 + args.seed + k) for k in range(20)]
        env.close()
        returns = [sum(episode.rewards) for episode in greedy]
        writer.add_scalar("eval/mean_reward", np.mean(returns), args.episodes)
    print(f"20 greedy episodes: mean return {np.mean(returns):.1f}, least {min(returns):.1f}, "
          f"mean length {np.mean([len(episode.rewards) for episode in greedy]):.1f}")  # fmt: skip
