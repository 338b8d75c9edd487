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
from bullet_gazebo.physics.files.sdf import parse_sdf
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose, from_rpy
from bullet_gazebo.physics.world import World, ground_plane
from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.pictures.renderer import Renderer
from bullet_gazebo.pictures.visuals import visible_shapes
from bullet_gazebo.sensors.laser import Laser
from bullet_gazebo.sensors.rays import RayScene

ROVER = Path(__file__).resolve().parents[2] / "data/robots/rover.urdf"
SHAPES = {
    "box": "<box><size>{} {} {}</size></box>",
    "cylinder": "<cylinder><radius>{}</radius><length>{}</length></cylinder>",
    "sphere": "<sphere><radius>{}</radius></sphere>",
}
MODEL = """<sdf version="1.6"><model name="thing"><static>true</static><link name="link">
<collision name="solid"><geometry>{0}</geometry></collision>
<visual name="seen"><geometry>{0}</geometry>
<material><ambient>{1} 1</ambient><diffuse>{1} 1</diffuse></material></visual></link></model></sdf>"""
COLOURS = [
    "0.8 0.2 0.2",
    "0.2 0.6 0.35",
    "0.15 0.35 0.7",
    "0.93 0.6 0.1",
    "0.5 0.3 0.6",
    "0.2 0.6 0.65",
]
THINGS = [  # shape, its size [m], place [m] and turn [rad], in the colours one after the other
    ("box", (0.3, 0.27, 0.54), (1.41, 0.07, 0.27), 1.19),
    ("box", (0.33, 0.44, 0.5), (1.37, 1.69, 0.25), 2.3),
    ("cylinder", (0.2, 0.68), (0.2, 1.4, 0.34), 0.64),
    ("box", (0.47, 0.51, 0.7), (-0.96, 1.17, 0.35), 0.93),
    ("box", (0.49, 0.43, 0.46), (-1.38, 0.23, 0.23), 1.82),
    ("box", (0.55, 0.44, 0.51), (-1.26, -0.61, 0.255), 2.8),
    ("sphere", (0.3,), (-0.63, -1.82, 0.3), 2.65),
    ("box", (0.36, 0.53, 0.42), (0.52, -1.69, 0.21), 0.48),
    ("box", (0.44, 0.41, 0.52), (1.54, -1.26, 0.26), 0.84),
]
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


def around():
    """The ground, and what stands around the rover, by name; each with its pose."""
    yield "ground_plane", ground_plane(), Pose()
    for number, (kind, size, place, turn) in enumerate(THINGS):
        text = MODEL.format(SHAPES[kind].format(*size), COLOURS[number % len(COLOURS)])
        yield f"thing{number}", parse_sdf(text), Pose(place, from_rpy(0.0, 0.0, turn))


def main():
    args = parse_args()
    width, height = (int(each) for each in args.size.split("x"))
    rover = parse_urdf(xacro.process_file(str(ROVER)).toxml())
    world, drawn, frames = World(make_engine("bullet")), Renderer(), []
    for name, description, pose in around():
        model = world.spawn(name, description, pose)
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
