#!/usr/bin/env python3
"""Draws docs/images/laser.gif: the rover drives to goals between swinging gates, by a policy that learned.

./ws python3 tools/laser_gif.py runs/navigate docs/images/laser.gif
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from rl_workbench.tools.policies import load_learned
from rl_workbench.tools.runs import open_run
from robot_envs.robots.rover import ROBOT
from robot_sim.physics.description import Mesh, Shape
from robot_sim.physics.pose import Pose
from robot_sim.pictures.camera import Camera
from robot_sim.pictures.renderer import Renderer
from robot_sim.pictures.visuals import visible_shapes
from robot_sim.sensors.laser import Laser

RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.2, 0.4, 0.95, 0.3)
POINT = Shape("box", (0.06, 0.06, 0.06), rgba=RED)
GOAL = Shape("cylinder", (0.3, 0.01), rgba=(0.1, 0.7, 0.2, 1.0))
CAMERA = Camera((0.0, -0.6, 0.0), 11.0, yaw=0.0, pitch=-58.0, view=45.0)
PACE = 100  # [ms of the GIF] for a step of 0.2 s


def parse_args() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--world", default="gates")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3])
    parser.add_argument("--size", default="400x330", help="[pixels]")
    parser.add_argument("--colours", type=int, default=64)
    return parser.parse_args()


def scan_shapes(points: list[np.ndarray | None]) -> Iterator[tuple[str, Shape]]:
    """The area before the points (3,) of neighbouring rays, None where nothing is met, and each point."""
    pairs = zip(points, [*points[1:], points[0]], strict=True)
    corners = [(np.zeros(3), a, b) for a, b in pairs if a is not None and b is not None]
    vertices = np.array(corners).reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    mesh = Mesh(vertices, faces, (), str(hash(vertices.tobytes())))
    yield "scan", Shape("mesh", (1.0, 1.0, 1.0), solid=mesh, rgba=BLUE)
    for point in points[::2]:
        if point is not None:
            yield "scan", replace(POINT, pose=Pose(tuple(point)))


class Drawing:
    """The world of an environment, with the goal and what the laser meets."""

    def __init__(self, env: Any, size: tuple[int, int]) -> None:
        self._env, self._size, self._drawn = env, size, Renderer()
        self._models = env.backend._sim.world.models
        for name, model in self._models.items():
            self._drawn.add(name, visible_shapes(model.description))
        self._sensor = next(each for each in ROBOT.links.sensors if each.name == "laser")
        self._rays = Laser(self._sensor).directions.reshape(-1, 3)

    def picture(self) -> Image.Image:
        drawn, state = self._drawn, self._env.state
        for name, model in self._models.items():
            drawn.place(name, dict(zip(model.link_names, model.link_poses(), strict=True)))
        ranges = state.sensors["laser"].ranges
        points = [r * way if math.isfinite(r) else None for r, way in zip(ranges, self._rays, strict=True)]
        drawn.add("scan", scan_shapes(points))
        base = dict(zip(self._models["rover"].link_names, self._models["rover"].link_poses(), strict=True))
        drawn.place("scan", {"scan": base[self._sensor.link].compose(self._sensor.pose)})
        drawn.add("goal", [("goal", GOAL)])
        drawn.place("goal", {"goal": Pose((*self._env.task.goal, 0.01))})
        return Image.fromarray(drawn.picture(CAMERA, *self._size))


def main() -> None:
    args = parse_args()
    width, height = map(int, args.size.split("x"))
    learned = load_learned(open_run(args.run), "best", {"world": args.world})
    env, frames = learned.env, []
    drawing = Drawing(env.unwrapped, (width, height))
    for seed in args.seeds:
        (seen, info), ends = env.reset(seed=seed), False
        while not ends:
            frames.append(drawing.picture())
            seen, _, terminated, truncated, info = env.step(learned.act(seen))
            ends = terminated or truncated
        frames += [drawing.picture()] * 3
        print(f"seed {seed}: {info}, {len(frames)} frames")
    palette = frames[0].quantize(args.colours, Image.Quantize.MAXCOVERAGE)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]
    frames[0].save(args.out, save_all=True, append_images=frames[1:], duration=PACE, loop=0, optimize=True)
    print(f"{args.out}: {args.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
