"""Deep Q-learning in one file, to read from top to bottom.

    ./ws python3 examples/dqn_single_file.py --seed 1

DQN (Mnih et al. 2015) learns Q(s, a): the discounted sum of rewards that follows when action a is
taken in state s, and the best actions after it. What this file adds can be switched off: n-step
returns, double DQN (van Hasselt et al. 2016), dueling networks (Wang et al. 2016), the Huber loss,
and observations that are normalised by their own statistics. What is left is plain DQN:

    --n-step 1 --no-double --no-dueling --loss mse --reward-scale 1 --no-normalize-observations

On the robot: --env-id cartpole:cartpole/Classic-v0 (Gymnasium imports the module before the colon).
With the same options the project's own agent gets the same weights; a test checks this.
"""

import argparse
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.utils.tensorboard import SummaryWriter


def option(default: Any, text: str, **how: Any) -> Any:
    """Makes a field of Args, with its arguments for argparse."""
    is_switch = isinstance(default, bool)
    kind = {"action": argparse.BooleanOptionalAction} if is_switch else {"type": type(default)}
    return field(default=default, metadata={**kind, "help": text, **how})


@dataclass
class Args:
    env_id: str = option("CartPole-v1", "one with vectors to observe and the actions 0, 1, 2, ...")
    seed: int = option(0, "of weights, exploration, batches and environment")
    total_timesteps: int = option(50_000, "steps of the environment")
    learning_rate: float = option(1e-3, "of Adam")
    buffer_size: int = option(50_000, "transitions that are remembered")
    learning_starts: int = option(500, "steps before the first gradient step")
    train_frequency: int = option(4, "steps between two rounds of learning")
    gradient_steps: int = option(2, "gradient steps in one round")
    batch_size: int = option(64, "transitions in one gradient step")
    target_network_frequency: int = option(100, "gradient steps between two copies")
    gamma: float = option(0.99, "discount factor")
    n_step: int = option(3, "rewards that are summed up before the rest is estimated")
    double: bool = option(True, "the network picks the next action, the target network rates it")
    dueling: bool = option(True, "one output for the state, others for the actions' advantages")
    hidden_sizes: tuple[int, ...] = option((64, 64), "units of hidden layers", type=int, nargs="+")
    loss: str = option("huber", "of the TD error", choices=("huber", "mse"))
    max_grad_norm: float = option(10.0, "a longer gradient is shortened to it")
    reward_scale: float = option(0.1, "factor of all rewards; errors near 1 suit the Huber loss")
    start_e: float = option(1.0, "probability of a random action at the start")
    end_e: float = option(0.02, "and at the end")
    exploration_fraction: float = option(0.05, "of total_timesteps, after which end_e is reached")
    normalize_observations: bool = option(True, "by mean and deviation as seen so far")


def parse_args(argv: list[str] | None = None) -> Args:
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    for each in fields(Args):
        flag = "--" + each.name.replace("_", "-")
        parser.add_argument(flag, default=each.default, **each.metadata)
    return Args(**vars(parser.parse_args(argv)))


class QNetwork(nn.Module):
    """Maps observations (N, D) to the value of each action (N, A)."""

    def __init__(self, inputs: int, actions: int, args: Args) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for units in args.hidden_sizes:
            layers += [nn.Linear(inputs, units), nn.ReLU()]
            inputs = units
        self.features = nn.Sequential(*layers)
        self.state = nn.Linear(inputs, 1) if args.dueling else None
        self.actions = nn.Linear(inputs, actions)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        features = self.features(observations)
        values = self.actions(features)
        if self.state is None:
            return values
        # Dueling: Q = V + A - mean(A). Without the mean, V and A would be ambiguous.
        return self.state(features) + values - values.mean(dim=1, keepdim=True)


class ReplayBuffer:
    """Keeps the newest transitions. The discount is gamma^n, or 0 if the episode terminated."""

    def __init__(self, capacity: int, size: int) -> None:
        self.observations, self.next_observations = np.zeros((2, capacity, size), np.float32)
        self.actions = np.zeros(capacity, np.int64)
        self.rewards, self.discounts = np.zeros((2, capacity), np.float32)
        self.capacity, self.size, self.position = capacity, 0, 0

    def add(self, observation: np.ndarray, action: int, reward: float,
            next_observation: np.ndarray, discount: float) -> None:  # fmt: skip
        index = self.position
        self.observations[index], self.actions[index] = observation, action
        self.rewards[index], self.discounts[index] = reward, discount
        self.next_observations[index] = next_observation
        self.position = (index + 1) % self.capacity  # of the oldest, in a full buffer
        self.size = max(self.size, index + 1)

    def sample(self, batch_size: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
        """Draws a batch without replacement; if there are too few transitions, it holds them all."""
        drawn = np.arange(self.size)
        if self.size > batch_size:
            drawn = rng.choice(self.size, batch_size, replace=False, shuffle=False)
        return (self.observations[drawn], self.actions[drawn], self.rewards[drawn],
                self.next_observations[drawn], self.discounts[drawn])  # fmt: skip


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


def td_loss(q_network: QNetwork, target: QNetwork, batch: Any, args: Args) -> torch.Tensor:
    """Returns the loss between Q(s, a) and r + γ max Q(s', a'), the latter by the target network."""
    observations, actions, rewards, next_observations, discounts = batch
    with torch.no_grad():
        next_values = target(next_observations)
        # The maximum of noisy values is too high on average, so in double DQN another network picks.
        picking = q_network(next_observations) if args.double else next_values
        best = picking.argmax(dim=1, keepdim=True)
        targets = rewards + discounts * next_values.gather(1, best).squeeze(1)
    values = q_network(observations).gather(1, actions.unsqueeze(1)).squeeze(1)
    loss: Any = {"huber": nn.functional.huber_loss, "mse": nn.functional.mse_loss}[args.loss]
    return loss(values, targets)


def train(args: Args, writer: SummaryWriter) -> tuple[Any, ...]:
    """Returns both networks, the function that acts greedily, and the returns of all episodes."""
    torch.set_num_threads(1)  # networks this small are slower with more
    torch.manual_seed(args.seed)
    explore_rng, replay_rng = (np.random.default_rng([args.seed, use]) for use in (0, 1))
    env: Any = gymnasium.make(args.env_id)
    size, actions = env.observation_space.shape[0], int(env.action_space.n)
    q_network, target_network = (QNetwork(size, actions, args) for _ in range(2))
    target_network.load_state_dict(q_network.state_dict())
    # One vector holds all weights, so that Adam and clipping handle one tensor, not eight.
    weights = nn.Parameter(nn.utils.parameters_to_vector(q_network.parameters()).detach())
    nn.utils.vector_to_parameters(weights.data, q_network.parameters())
    optimizer = torch.optim.Adam([weights], lr=args.learning_rate, fused=True)
    buffer, normalizer = ReplayBuffer(args.buffer_size, size), Normalizer(size)
    normalize = normalizer if args.normalize_observations else np.asarray

    @torch.no_grad()
    def act_greedily(observation: np.ndarray) -> int:
        return int(q_network(torch.Tensor(normalize(observation))[None]).argmax())

    exploration = max(args.exploration_fraction * args.total_timesteps, 1e-9)  # [steps]
    window: deque[tuple[np.ndarray, int, float]] = deque()  # steps whose n rewards aren't known yet
    returns, episode_return, updates = [], 0.0, 0
    env.reset(seed=args.seed)  # only seeds the environment; every episode has a reset of its own
    observation = np.array(env.reset()[0], np.float32)
    for step in range(1, args.total_timesteps + 1):
        # Act: randomly with probability epsilon, else greedily.
        share = min(1.0, (step - 1) / exploration)
        epsilon = args.start_e + (args.end_e - args.start_e) * share
        is_random = explore_rng.random() < epsilon
        action = int(explore_rng.integers(actions)) if is_random else act_greedily(observation)
        following, reward, terminated, truncated, _ = env.step(action)
        following = np.array(following, np.float32)
        episode_return += float(reward)

        # Store. An episode that a time limit cut off could have continued, so its last state keeps its
        # value; only a termination makes that 0.
        normalizer.update(observation)
        window.append((observation, action, float(reward) * args.reward_scale))
        while len(window) == args.n_step or (window and (terminated or truncated)):
            total, discount = 0.0, 1.0
            for *_, later in window:
                total, discount = total + discount * later, discount * args.gamma
            buffer.add(*window.popleft()[:2], total, following, 0.0 if terminated else discount)

        # Learn.
        is_due = step >= args.learning_starts and step % args.train_frequency == 0
        if is_due and buffer.size >= min(args.batch_size, args.buffer_size):
            for _ in range(args.gradient_steps):
                seen, *middle, next_seen, discounts = buffer.sample(args.batch_size, replay_rng)
                arrays = (normalize(seen), *middle, normalize(next_seen), discounts)
                batch = [torch.from_numpy(array) for array in arrays]
                loss = td_loss(q_network, target_network, batch, args)
                gradients = torch.autograd.grad(loss, tuple(q_network.parameters()))
                weights.grad = nn.utils.parameters_to_vector(gradients)
                norm = weights.grad.norm().item()
                if norm > args.max_grad_norm:
                    weights.grad.mul_(args.max_grad_norm / norm)
                optimizer.step()
                updates += 1
                if updates % args.target_network_frequency == 0:
                    target_network.load_state_dict(q_network.state_dict())
            if step % 500 == 0:
                writer.add_scalar("losses/td_loss", loss.item(), step)

        observation = following
        if terminated or truncated:
            observation = np.array(env.reset()[0], np.float32)
            returns.append(episode_return)
            writer.add_scalar("charts/episodic_return", episode_return, step)
            episode_return = 0.0
            if len(returns) % 20 == 0:
                print(f"step {step}: mean return of 20 episodes {np.mean(returns[-20:]):.1f}")
    env.close()
    return q_network, target_network, act_greedily, returns


def evaluate(act: Callable[..., int], env_id: str, seed: int, episodes: int) -> list[float]:
    """Plays greedy episodes; returns their returns."""
    env, returns = gymnasium.make(env_id), []
    for episode in range(episodes):
        observation, done, total = env.reset(seed=seed + episode)[0], False, 0.0
        while not done:
            observation, reward, terminated, truncated, _ = env.step(act(observation))
            done, total = terminated or truncated, total + float(reward)
        returns.append(total)
    env.close()
    return returns


if __name__ == "__main__":
    args = parse_args()
    name = f"{args.env_id.replace('/', '_')}__dqn_single_file__{args.seed}__{int(time.time())}"
    with SummaryWriter(f"runs/{name}") as writer:
        *_, act, _ = train(args, writer)
        greedy = evaluate(act, args.env_id, args.seed + 1_000_000, 20)
        writer.add_scalar("eval/mean_reward", np.mean(greedy), args.total_timesteps)
    print(f"20 greedy episodes: mean return {np.mean(greedy):.1f}, least {min(greedy):.1f}")
