"""Draws a cart-pole policy's preference over the pole's angle and velocity, with an episode on top.

    ./ws python3 examples/plot_policy.py runs/CartPole-v1__dqn__0__1700000000 policy.png

The cart is in the middle, at rest. Other environments need their own `observe` and `locate`.
"""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from rl_workbench.agents.greedy import Choice
from rl_workbench.plotting import as_png, new_figure
from rl_workbench.tools.policies import TEST_SEED, episode_steps, load_learned
from rl_workbench.tools.runs import open_run

POINTS = 161  # of each axis
MAX_STEPS = 1500  # of the episode


class StatePlane(NamedTuple):
    """How an environment observes the pole."""

    angle: float  # [rad], the largest shown
    velocity: float  # [rad/s]
    observe: Callable[[np.ndarray, np.ndarray], np.ndarray]  # (N,), (N,) to (N, D)
    locate: Callable[[np.ndarray], tuple[float, float]]  # (D,) to angle and velocity


def four_numbers(angles: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    zeros = np.zeros_like(angles)
    return np.stack([zeros, zeros, angles, velocities], axis=1).astype(np.float32)


def five_numbers(angles: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    zeros = np.zeros_like(angles)
    columns = [zeros, zeros, np.sin(angles), np.cos(angles), velocities]
    return np.stack(columns, axis=1).astype(np.float32)


BALANCE = StatePlane(math.radians(12.0), 3.0, four_numbers, lambda seen: (seen[2], seen[3]))
PLANES = {
    "CartPole-v1": BALANCE,
    "cartpole/Balance-v0": BALANCE,
    "cartpole/Classic-v0": BALANCE,
    "cartpole/SwingUp-v0": StatePlane(
        math.pi, 12.0, five_numbers, lambda seen: (math.atan2(seen[2], seen[3]), seen[4])
    ),
}


@torch.no_grad()
def preference(network: torch.nn.Module, observations: np.ndarray) -> np.ndarray:
    """Returns the action, or how much the score of the last one is above that of the first: (N,)."""
    seen = torch.from_numpy(observations)
    if not isinstance(network, Choice):
        return network(seen)[:, 0].numpy()
    scores = network.scores(seen)
    return (scores[:, -1] - scores[:, 0]).numpy()


def main(folder: Path, out: Path) -> None:
    run = open_run(folder)
    plane = PLANES[run.env_id.rpartition(":")[2]]
    policy = load_learned(run)
    if policy.network is None:
        sys.exit(f"{folder}: a policy of its kind can't be plotted")

    angles = np.linspace(-plane.angle, plane.angle, POINTS)
    velocities = np.linspace(-plane.velocity, plane.velocity, POINTS)
    across, up = np.meshgrid(angles, velocities)
    values = preference(policy.network, plane.observe(across.ravel(), up.ravel()))
    values = values.reshape(across.shape)
    steps = episode_steps(policy.env, policy.act, TEST_SEED, MAX_STEPS)
    visited = np.array([plane.locate(step.observation) for step in steps]) * (180 / math.pi, 1.0)
    policy.env.close()

    figure = new_figure(8, 6)
    axes = figure.subplots()
    # Otherwise rare corners with huge values would use up the colour range.
    strongest = max(float(np.percentile(np.abs(values), 95)), 1e-9)
    mesh = axes.pcolormesh(np.degrees(angles), velocities, values, cmap="RdBu_r", vmin=-strongest,
                           vmax=strongest, shading="auto", rasterized=True)  # fmt: skip
    figure.colorbar(mesh, ax=axes, label="red pushes right, blue left")
    if values.min() < 0.0 < values.max():
        axes.contour(np.degrees(angles), velocities, values, levels=[0.0], colors="black")
    # When the pole swings through the bottom, its angle jumps between the edges; NaN breaks the line.
    line = visited.copy()
    line[1:][np.abs(np.diff(visited[:, 0])) > 180.0] = np.nan
    axes.plot(*line.T, color="0.1", linewidth=0.8, label="a greedy episode")
    axes.plot(*visited[0], "o", color="black", markersize=5, label="its start")
    axes.set_xlim(-math.degrees(plane.angle), math.degrees(plane.angle))
    axes.set_ylim(-plane.velocity, plane.velocity)
    axes.set_xlabel("pole angle [°], 0 upright")
    axes.set_ylabel("angular velocity [rad/s]")
    axes.set_title(f"{run.experiment}, {run.env_id}, seed {run.seed}")
    axes.legend(loc="upper right", fontsize="small")
    with out.open("wb") as stream:
        as_png(figure)(stream)


if __name__ == "__main__":
    import cartpole  # noqa: F401 - registers its environments

    main(Path(sys.argv[1]), Path(sys.argv[2]))
