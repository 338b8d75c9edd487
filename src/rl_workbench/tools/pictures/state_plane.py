"""`policy`: what a policy does over the pole's angle and angular velocity, the rest at 0."""

import math
from collections.abc import Callable
from typing import NamedTuple

import gymnasium
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from cartpole.tasks import ANGLE_LIMIT
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.players import Player
from rl_workbench.tools.runs.runs import Run
from rl_workbench.training.run.results import new_figure

POINTS = 161  # of each axis
LONGEST = 1500  # [steps] of the episode that is drawn over the policy


class Plane(NamedTuple):
    """How an environment's observation holds the pole."""

    angle: float  # [rad], largest that is shown
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


BALANCING = Plane(ANGLE_LIMIT, 3.0, "left (-x)", _four, _in_four)
PLANES = {
    "CartPole-v1": Plane(ANGLE_LIMIT, 3.0, "right (+x)", _four, _in_four),
    "cartpole/Balance-v0": BALANCING,
    "cartpole/Classic-v0": BALANCING,
    "cartpole/SwingUp-v0": Plane(math.pi, 12.0, "left (-x)", _five, _in_five),
}


def plane_of(run: Run) -> Plane:
    """The plane of a run's environment.

    Raises:
        WorkbenchError: if its observation isn't a cart-pole's.
    """
    if run.env_id not in PLANES:
        raise WorkbenchError(
            f"{run.env_id} has no pole's angle and velocity; policy draws {', '.join(PLANES)}"
        )
    return PLANES[run.env_id]


def policy_picture(run: Run, player: Player, seed: int) -> Figure:
    """The policy's preference over the plane, with one greedy episode over it.

    Raises:
        WorkbenchError: if the environment isn't a cart-pole.
    """
    plane = plane_of(run)
    angles = np.linspace(-plane.angle, plane.angle, POINTS)
    velocities = np.linspace(-plane.velocity, plane.velocity, POINTS)
    field = _field(plane, player, angles, velocities)
    figure = new_figure(8, 6)
    axes = figure.subplots()
    _draw_field(axes, player, np.degrees(angles), velocities, field)
    _draw_episode(axes, _trace(plane, player, seed), plane)
    axes.set_xlabel(f"pole angle θ [°], 0 upright; positive leans to the {plane.lean}")
    axes.set_ylabel("angular velocity dθ/dt [rad/s]")
    axes.set_title(f"policy of {run.label}; cart in the middle, at rest")
    axes.legend(loc="upper right", fontsize="small", framealpha=0.9)
    return figure


def _field(plane: Plane, player: Player, angles: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """The preference at every point, (velocities, angles)."""
    across, up = np.meshgrid(angles, velocities)
    values = player.preference(plane.observe(across.ravel(), up.ravel()))
    return values.reshape(across.shape)


def _draw_field(
    axes: Axes, player: Player, angles: np.ndarray, velocities: np.ndarray, field: np.ndarray
) -> None:
    # Rare corners with huge values would leave no colour for the rest.
    strongest = max(float(np.percentile(np.abs(field), 95)), 1e-9)
    mesh = axes.pcolormesh(
        angles, velocities, field, cmap="RdBu_r", vmin=-strongest, vmax=strongest,
        shading="auto", rasterized=True,
    )  # fmt: skip
    axes.figure.colorbar(mesh, ax=axes, label=f"{player.meaning}: red pushes right, blue left")
    if field.min() < 0.0 < field.max():
        axes.contour(angles, velocities, field, levels=[0.0], colors="black", linewidths=1.5)
        axes.plot([], [], color="black", linewidth=1.5, label="the policy changes its mind")


def _trace(plane: Plane, player: Player, seed: int) -> np.ndarray:
    """Angle [°] and velocity [rad/s] along one greedy episode, (T, 2)."""
    env: gymnasium.Env = player.env
    observation, _ = env.reset(seed=seed)
    places, finished = [plane.locate(observation)], False
    while not finished and len(places) < LONGEST:
        action = player.act(np.asarray(observation, np.float32))
        observation, _, terminated, truncated, _ = env.step(action)
        places.append(plane.locate(observation))
        finished = terminated or truncated
    return np.array(places) * (180.0 / math.pi, 1.0)


def _draw_episode(axes: Axes, trace: np.ndarray, plane: Plane) -> None:
    angles, velocities = trace.T.copy()
    # A turn through hanging is one point to the next, not a line across the picture.
    angles[1:][np.abs(np.diff(trace[:, 0])) > 180.0] = np.nan
    seam = [withStroke(linewidth=1.8, foreground="white", alpha=0.6)]  # for dark grounds
    axes.plot(angles, velocities, color="0.1", linewidth=0.8, path_effects=seam,
              label="a greedy episode")  # fmt: skip
    axes.plot(*trace[0], "o", color="black", markersize=5, label="its start")
    limit = math.degrees(plane.angle)
    axes.set_xlim(-limit, limit)
    axes.set_ylim(-plane.velocity, plane.velocity)
