#!/usr/bin/env python3
"""A world of 290 models with meshes: until it is up the first time, and the second, from the cache.

    ./ws python3 benchmark/large_world.py [--out FOLDER] [--models 290] [--files 120] [--triangles 20000]

Writes STL, COLLADA and OBJ files of about so many triangles each, and a world of models that have them as
collisions and visuals; five of six are static. Both engines load it with an empty cache, then once more. What
counts is the processor time of the simulator and its child process until the world answers; the time by the
clock holds for an idle machine. Prints a table and writes large_world.json. It starts simulators on masters
of their own.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np
import reporting
from realtime import processor_time, simulator_process

from robot_sim.physics.files.meshes import stl
from ros_utils.simulation import Simulation

ENGINES = {"PyBullet": "ode", "MuJoCo": "mujoco"}
TARGETS = {"first": 20.0, "second": 5.0}  # [s]
STARTING = 600.0  # [s]
APART = 2.5  # [m]
ROW = 17  # models
COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="{0}">{2}</float_array>
<technique_common>
<accessor source="#a" count="{1}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#p"/></vertices><triangles count="{3}">
<input semantic="VERTEX" source="#v" offset="0"/><p>{4}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
MODEL = """<model name="model{0}">{1}<pose>{2} {3} 0.7 0 0 0</pose><link name="link"><inertial><mass>5</mass>
</inertial><collision name="c">{4}</collision><visual name="v">{4}</visual></link></model>"""


def lump(triangles: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a rough ball with dents."""
    rows = round(np.sqrt(triangles / 2))
    around = np.linspace(0.0, 2.0 * np.pi, rows, endpoint=False)[:, None]
    down = np.linspace(0.01, np.pi - 0.01, rows + 1)[None]
    waves, shift = random.integers(2, 6, 2), random.uniform(0.0, 6.0)
    radius = 0.5 + 0.15 * np.sin(waves[0] * around + shift) * np.sin(waves[1] * down)
    radius += 0.02 * random.standard_normal(radius.shape)
    sideways = radius * np.sin(down)
    points = [sideways * np.cos(around), sideways * np.sin(around), radius * np.cos(down)]
    row, column = np.arange(rows)[:, None], np.arange(rows)[None]
    one, other = row * (rows + 1) + column, (row + 1) % rows * (rows + 1) + column
    faces = [(one, other, other + 1), (one, other + 1, one + 1)]
    return (
        np.stack(points, axis=-1).reshape(-1, 3),
        np.concatenate([np.stack(each, axis=-1).reshape(-1, 3) for each in faces]),
    )


def content(suffix: str, points: np.ndarray, faces: np.ndarray) -> bytes:
    """A mesh file."""
    if suffix == "stl":
        return stl(points, faces)
    if suffix == "obj":
        lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in points.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
        return "\n".join(lines).encode()
    numbers = (" ".join(f"{x:.6g}" for x in points.ravel().tolist()), " ".join(map(str, faces.ravel())))
    return COLLADA.format(points.size, len(points), numbers[0], len(faces), numbers[1]).encode()


def write_world(folder: Path, models: int, files: int, triangles: int) -> Path:
    """Writes the meshes and the world, always the same."""
    random = np.random.default_rng(7)
    paths = []
    for number in range(files):
        paths.append(folder / f"mesh{number}.{('stl', 'dae', 'obj')[number % 3]}")
        size = int(triangles * random.uniform(0.3, 1.7))
        paths[-1].write_bytes(content(paths[-1].suffix[1:], *lump(size, random)))
    written = [
        MODEL.format(
            number, "" if number % 6 == 5 else "<static>1</static>",
            number % ROW * APART, number // ROW * APART,
            f"<geometry><mesh><uri>{paths[number % files]}</uri></mesh></geometry>",
        )
        for number in range(models)
    ]  # fmt: skip
    world = folder / "large.world"
    world.write_text(
        '<sdf version="1.6"><world name="large"><include><uri>model://ground_plane</uri></include>'
        f"{''.join(written)}</world></sdf>"
    )
    return world


def start(world: Path, models: int, engine: str) -> tuple[float, float]:
    """Starts a simulator; returns the processor time and the time until the world answers [s]."""
    begin = time.perf_counter()
    with Simulation(
        lockstep=True, timeout=STARTING, custom_world_path=str(world),
        extra_gazebo_args=f"-e {engine}",
    ) as simulation:  # fmt: skip
        took = time.perf_counter() - begin
        process = simulator_process(simulation)
        assert len(simulation.model_names()) == models + 1
        return processor_time(process), took


def main() -> None:
    chosen = reporting.options(__doc__ or "", models=290, files=120, triangles=20_000)
    found: dict[str, dict[str, tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory() as name:
        world = write_world(Path(name), chosen.models, chosen.files, chosen.triangles)
        print(f"{'':20} {'processor [s]':>14} {'clock [s]':>10} {'target':>7}")
        for engine, option in ENGINES.items():
            os.environ["XDG_CACHE_HOME"] = f"{name}/{option}"
            found[engine] = {}
            for which, target in TARGETS.items():
                found[engine][which] = start(world, chosen.models, option)
                used, took = found[engine][which]
                print(f"{engine + ', ' + which:20} {used:14.1f} {took:10.1f} {target:7.0f}", flush=True)
    reporting.write(chosen.out, "large_world", {"settings": vars(chosen) | {"out": ""}, "seconds": found})


if __name__ == "__main__":
    main()
