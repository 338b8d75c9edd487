#!/usr/bin/env python3
"""Pictures: of environments without a display, and of cameras by rays and by OpenGL.

    ./ws extras python3 benchmark/pictures.py [--out FOLDER] [--frames 60] [--rounds 5] [--seconds 20]

First the cart-pole's pictures, and the steps of examples/ppo_from_pictures.py, by processor time on one core;
then a camera before 40 boxes on the ground, colours without noise, by the processor time of all threads. Last
a rover in real time whose camera (640 x 480, 30 Hz) and laser (360 rays, 10 Hz) are heard: its real-time
factor, and how long /gazebo/get_model_state waits, also without the camera. Prints a table and writes
pictures.json. It starts simulators on masters of their own.
"""

import contextvars
import math
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import reporting
from gazebo_msgs.srv import GetModelState, GetModelStateRequest
from realtime import factor, listening, simulator_process
from sensors import put, surroundings

from cartpole.environment import CAMERA
from cartpole.robot import CART_JOINT, POLE_JOINT, ROBOT
from robot_envs import RobotEnv
from robot_envs.pictures.drawn import RobotPicture
from robot_envs.robots.rover import ROBOT as ROVER
from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.sensors.pinhole import PinholeCamera, Shot
from robot_sim.sensors.renderers import make_renderer
from robot_sim.sensors.scene import WorldScene
from ros_calls.service import ServiceClient
from ros_utils import ros_gazebo
from ros_utils.simulation import Simulation

sys.path.append(str(Path(__file__).resolve().parents[1] / "examples"))
SIZES = ((320, 240), (640, 320), (640, 480))
SHOTS = ((320, 240), (640, 480), (1920, 1080))
IMAGE = "<camera><image><width>{}</width><height>{}</height></image></camera>"
EYE = Pose((0.0, 0.0, 0.4))
SEEING = f"""<gazebo reference="base_scan"><sensor name="eye" type="camera"><update_rate>30</update_rate>
{IMAGE.format(640, 480)}<plugin name="e" filename="libgazebo_ros_camera.so"><cameraName>eye</cameraName>
</plugin></sensor></gazebo></robot>"""
RENDERERS = ("rays", "gl")
TARGETS = {
    "rays, 640 x 480 [ms]": "<= 60", "gl, 640 x 480 [ms]": "<= 30", "gl, 1920 x 1080 [ms]": "<= 100",
    "gl, steps with 64 x 64 pictures over those by rays": ">= 2",
    "rays, real-time factor": "1", "gl, real-time factor": "1",
    "rays, longest wait [ms]": "<= 20", "gl, longest wait [ms]": "<= 20",
}  # fmt: skip


def rate(width: int, height: int, frames: int) -> float:
    """Pictures a second of the process's own time, the pole going round."""
    picture = RobotPicture(ROBOT, width, height, camera=CAMERA)
    picture({CART_JOINT: 0.0, POLE_JOINT: 0.0})  # loads
    begin = time.process_time()
    for frame in range(frames):
        picture({CART_JOINT: 0.3 * math.sin(0.1 * frame), POLE_JOINT: 0.1 * frame})
    spent = time.process_time() - begin
    picture.close()
    return frames / spent


def least(rounds: int, action: Callable[[], object]) -> float:
    """The least processor time of an action [ms]."""
    taken = []
    for _ in range(rounds):
        begin = time.process_time()
        action()
        taken.append(1e3 * (time.process_time() - begin))
    return min(taken)


def shots(results: dict[str, float], rounds: int) -> None:
    """Pictures of a camera, in this process."""
    world = World(BulletEngine())
    world.spawn("ground", ground_plane(), Pose())
    with tempfile.TemporaryDirectory() as folder:
        for name, text, pose in surroundings(Path(folder)):
            if name != "mesh":
                world.spawn(name, parse_sdf(text), pose)
    scene = WorldScene(world, visuals=True)
    for name in RENDERERS:
        renderer = make_renderer(name)
        for size in SHOTS:
            camera = PinholeCamera(fromstring(IMAGE.format(*size)), Pose(), "camera", "link")
            shot = Shot(camera, EYE, scene.state(), image=True)
            renderer.picture(shot)
            found = least(rounds, partial(renderer.picture, shot))
            results[f"{name}, {size[0]} x {size[1]} [ms]"] = found
        renderer.close()
    world.close()


def steps(results: dict[str, float], rounds: int, count: int = 200) -> None:
    """Steps a second of the cart-pole that observes pictures of 64 x 64."""
    from ppo_from_pictures import WITH_CAMERA, BalanceFromPictures

    def play(env: RobotEnv) -> None:
        for number in range(count):
            if env.step(number % 2)[2]:
                env.reset()

    for name in RENDERERS:
        env = RobotEnv(WITH_CAMERA, BalanceFromPictures(), renderer=name, max_steps=10**6)
        env.reset(seed=0)
        play(env)
        spent = least(rounds, partial(play, env))
        results[f"{name}, steps a second with 64 x 64 pictures"] = 1e3 * count / spent
        env.close()
    by_rays, by_gl = (results[f"{each}, steps a second with 64 x 64 pictures"] for each in RENDERERS)
    results["gl, steps with 64 x 64 pictures over those by rays"] = by_gl / by_rays


def vehicle(results: dict[str, float], seconds: int, renderer: str = "") -> None:
    """A rover in real time; without a renderer its camera isn't heard."""
    stop, waits = threading.Event(), []

    def look() -> None:
        get = ServiceClient("/gazebo/get_model_state", GetModelState, persistent=True)
        while not stop.wait(0.01):
            begin = time.perf_counter()
            get(GetModelStateRequest("rover", "world"))
            waits.append(1e3 * (time.perf_counter() - begin))

    arguments = f"--renderer {renderer or 'rays'}"
    with (
        tempfile.TemporaryDirectory() as folder,
        Simulation(extra_gazebo_args=arguments) as simulation,
        simulation.active(),
    ):
        for name, text, pose in surroundings(Path(folder)):
            put(name, text, pose)
        xml = ROVER.xml.replace("<update_rate>5</update_rate>", "<update_rate>10</update_rate>")
        xml = xml.replace("</robot>", SEEING)
        assert ros_gazebo.gazebo_spawn_urdf_string(xml, model_name="rover", pos_z=0.1)[0]
        topics = {"/scan": "sensor_msgs/LaserScan"}
        if renderer:
            topics["/eye/image_raw"] = "sensor_msgs/Image"
        process = simulator_process(simulation)
        looking = threading.Thread(target=contextvars.copy_context().run, args=(look,))
        with listening(simulation, topics):
            factor(2, process)  # everything has begun then
            looking.start()
            what = renderer or "unheard camera"
            results[f"{what}, real-time factor"], _ = factor(seconds, process)
            stop.set()
            looking.join()
    results[f"{what}, longest wait [ms]"] = max(waits)
    results[f"{what}, 99 % of the waits [ms]"] = float(np.percentile(waits, 99))


def main() -> None:
    args = reporting.options(__doc__ or "", frames=60, rounds=5, seconds=20)
    results = {}
    for width, height in SIZES:
        rates = sorted(rate(width, height, args.frames) for _ in range(args.rounds))
        results[f"{width}x{height}"] = {"rates": rates, "median": statistics.median(rates)}
        print(f"{width} x {height}: {statistics.median(rates):6.1f} pictures/s of {rates}")
    of_cameras: dict[str, float] = {}
    shots(of_cameras, args.rounds)
    steps(of_cameras, args.rounds)
    for renderer in ("", *RENDERERS):
        vehicle(of_cameras, args.seconds, renderer)
    for name, value in of_cameras.items():
        print(f"{name:52} {value:9.3f} {TARGETS.get(name, ''):>8}")
    reporting.write(args.out, "pictures", {**results, **of_cameras})


if __name__ == "__main__":
    main()
