#!/usr/bin/env python3
"""Draws docs/images/laser.gif: the scan of a rover that turns among boxes. It takes some seconds.

./ws python3 test/support/pages/laser_gif.py docs/images/laser.gif
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import xacro
from PIL import Image

from bullet_gazebo.physics.description import Mesh, Shape
from bullet_gazebo.physics.engines import make_engine
from bullet_gazebo.physics.files.reading import Resources
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.files.world_file import load_world
from bullet_gazebo.physics.pose import Pose, from_rpy
from bullet_gazebo.physics.world import World
from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.pictures.renderer import Renderer
from bullet_gazebo.pictures.visuals import visible_shapes
from bullet_gazebo.sensors.laser import Laser
from bullet_gazebo.sensors.rays import RayScene

DATA = Path(__file__).resolve().parents[2] / "data"
RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.2, 0.4, 0.95, 0.3)
POINT = Shape("box", (0.045, 0.045, 0.045), rgba=RED)
CAMERA = Camera((0.1, -0.15, 0.0), 4.7, yaw=30.0, pitch=-42.0, view=45.0)
WHEELS = {"left_wheel": 0.18, "right_wheel": -0.18}  # [m] to the left
SECONDS = 4.0  # of the GIF


def parse_args():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--size", default="480x300", help="[pixels]")
    parser.add_argument("--colours", type=int, default=200)
    return parser.parse_args()


def scan_shapes(points):
    """The area before the points (n, 3) of neighbouring rays, None where nothing is met, and each point."""
    pairs = zip(points, [*points[1:], points[0]], strict=True)
    corners = [(np.zeros(3), a, b) for a, b in pairs if a is not None and b is not None]
    vertices = np.array(corners).reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    mesh = Mesh(vertices, faces, (), str(hash(vertices.tobytes())))
    yield "scan", Shape("mesh", (1.0, 1.0, 1.0), solid=mesh, rgba=BLUE)
    for point in points:
        if point is not None:
            yield "scan", replace(POINT, pose=Pose(tuple(point)))


def main():
    args = parse_args()
    width, height = (int(each) for each in args.size.split("x"))
    around = load_world(DATA / "worlds/around.world", Resources())
    rover = parse_urdf(xacro.process_file(str(DATA / "robots/rover.urdf")).toxml())
    world, drawn, frames = World(make_engine("bullet")), Renderer(), []
    for name, description in around.models.items():
        model = world.spawn(name, description, description.initial_pose)
        drawn.add(name, visible_shapes(description))
        drawn.place(name, model.body.link_poses())
    drawn.add("rover", visible_shapes(rover))
    sensor = next(each for each in rover.sensors if each.name == "scanner")
    laser, scene, random = Laser(sensor), RayScene(world), np.random.default_rng(0)
    for turn in np.linspace(0.0, 2.0 * math.pi, args.frames, endpoint=False):
        base = Pose((0.0, 0.0, 0.08), from_rpy(0.0, 0.0, float(turn)))
        wheels = {name: base.compose(Pose((0.0, left, 0.0))) for name, left in WHEELS.items()}
        drawn.place("rover", {"base_link": base, **wheels})
        at = base.compose(sensor.pose)
        ranges = laser.measure(scene, at, 0.0, random).ranges.ravel()
        rays = laser.directions.reshape(-1, 3)
        points = [
            r * way if math.isfinite(r) else None for r, way in zip(ranges, rays, strict=True)
        ]
        drawn.add("scan", scan_shapes(points))
        drawn.place("scan", {"scan": at})
        frames.append(Image.fromarray(drawn.picture(CAMERA, width, height)))
    palette = frames[0].quantize(args.colours, Image.Quantize.MAXCOVERAGE)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]
    step = round(1000 * SECONDS / args.frames)
    frames[0].save(
        args.out, save_all=True, append_images=frames[1:], duration=step, loop=0, optimize=True
    )
    print(f"{args.out}: {args.out.stat().st_size} bytes, {width} x {height}")


if __name__ == "__main__":
    main()
