"""`policy`: what a cart-pole's policy prefers over the pole's angle and velocity, the rest at 0."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from rl_workbench.env_ids import without_module
from rl_workbench.errors import WorkbenchError
from rl_workbench.plotting.figure import new_figure
from rl_workbench.tools.runs.episodes import episode_steps
from rl_workbench.tools.runs.policies import LearnedPolicy

POINTS = 161  # of each axis
LONGEST = 1500  # [steps] of the episode that is drawn over the policy


class StatePlane(NamedTuple):
    """How an environment's observation holds the pole."""

    angle: float  # [rad], the largest that is shown
    velocity: float  # [rad/s]
    lean: str  # where the pole leans at a positive angle
    observe: Callable[[np.ndarray, np.ndarray], np.ndarray]  # (N,), (N,) to (N, D)
    locate: Callable[[np.ndarray], tuple[float, float]]  # (D,) to angle and velocity


def _four(angles: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    zeros = np.zeros_like(angles)
    return np.stack([zeros, zeros, angles, velocities], axis=1).astype(np.float32)


def _five(angles: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    zeros = np.zeros_like(angles)
    columns = [zeros, zeros, np.sin(angles), np.cos(angles), velocities]
    return np.stack(columns, axis=1).astype(np.float32)


def _in_four(observation: np.ndarray) -> tuple[float, float]:
    return float(observation[2]), float(observation[3])


def _in_five(observation: np.ndarray) -> tuple[float, float]:
    return math.atan2(observation[2], observation[3]), float(observation[4])


FALLEN = math.radians(12.0)  # from which the balancing ones end an episode
BALANCING = StatePlane(FALLEN, 3.0, "left (-x)", _four, _in_four)
PLANES = {
    "CartPole-v1": StatePlane(FALLEN, 3.0, "right (+x)", _four, _in_four),
    "cartpole/Balance-v0": BALANCING,
    "cartpole/Classic-v0": BALANCING,
    "cartpole/SwingUp-v0": StatePlane(math.pi, 12.0, "left (-x)", _five, _in_five),
}


def state_plane(env_id: str) -> StatePlane:
    """The plane of an environment.

    Raises:
        WorkbenchError: if its observation isn't a cart-pole's.
    """
    name = without_module(env_id)
    if name not in PLANES:
        raise WorkbenchError(
            f"{env_id} has no pole's angle and velocity; policy draws {', '.join(PLANES)}"
        )
    return PLANES[name]


def policy_map(plane: StatePlane, policy: LearnedPolicy, seed: int, title: str) -> Figure:
    """The policy's preference over the plane, with one greedy episode over it."""
    angles = np.linspace(-plane.angle, plane.angle, POINTS)
    velocities = np.linspace(-plane.velocity, plane.velocity, POINTS)
    preferences = _preferences(plane, policy, angles, velocities)
    figure = new_figure(8, 6)
    axes = figure.subplots()
    _draw_preferences(axes, policy, np.degrees(angles), velocities, preferences)
    _draw_episode(axes, _trajectory(plane, policy, seed), plane)
    axes.set_xlabel(f"pole angle θ [°], 0 upright; positive leans to the {plane.lean}")
    axes.set_ylabel("angular velocity dθ/dt [rad/s]")
    axes.set_title(title)
    axes.legend(loc="upper right", fontsize="small", framealpha=0.9)
    return figure


def _preferences(
    plane: StatePlane, policy: LearnedPolicy, angles: np.ndarray, velocities: np.ndarray
) -> np.ndarray:
    """The preference at every point, (velocities, angles)."""
    across, up = np.meshgrid(angles, velocities)
    values = policy.preference(plane.observe(across.ravel(), up.ravel()))
    return values.reshape(across.shape)


def _draw_preferences(
    axes: Axes,
    policy: LearnedPolicy,
    angles: np.ndarray,
    velocities: np.ndarray,
    values: np.ndarray,
) -> None:
    # Rare corners with huge values would leave no colour for the rest.
    strongest = max(float(np.percentile(np.abs(values), 95)), 1e-9)
    mesh = axes.pcolormesh(
        angles, velocities, values, cmap="RdBu_r", vmin=-strongest, vmax=strongest,
        shading="auto", rasterized=True,
    )  # fmt: skip
    axes.figure.colorbar(mesh, ax=axes, label=f"{policy.meaning}: red pushes right, blue left")
    if values.min() < 0.0 < values.max():
        axes.contour(angles, velocities, values, levels=[0.0], colors="black", linewidths=1.5)
        axes.plot([], [], color="black", linewidth=1.5, label="the policy changes its mind")


def _trajectory(plane: StatePlane, policy: LearnedPolicy, seed: int) -> np.ndarray:
    """Angle [°] and velocity [rad/s] along one greedy episode, (T, 2)."""
    steps = episode_steps(policy.env, policy.act, seed, LONGEST)
    places = [plane.locate(observation) for observation, *_ in steps]
    return np.array(places) * (180.0 / math.pi, 1.0)


def _draw_episode(axes: Axes, trajectory: np.ndarray, plane: StatePlane) -> None:
    angles, velocities = trajectory.T.copy()
    # A turn through hanging is one point to the next, not a line across the picture.
    angles[1:][np.abs(np.diff(trajectory[:, 0])) > 180.0] = np.nan
    seam = [withStroke(linewidth=1.8, foreground="white", alpha=0.6)]  # for dark grounds
    axes.plot(angles, velocities, color="0.1", linewidth=0.8, path_effects=seam,
              label="a greedy episode")  # fmt: skip
    axes.plot(*trajectory[0], "o", color="black", markersize=5, label="its start")
    limit = math.degrees(plane.angle)
    axes.set_xlim(-limit, limit)
    axes.set_ylim(-plane.velocity, plane.velocity)
