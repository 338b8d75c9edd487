#!/usr/bin/env python3
"""What sensors cost: a scan against PyBullet's rays, messages over ROS, a robot with a laser, ticks.

    ./ws python3 benchmark/sensors.py [--out FOLDER] [--rounds 9] [--scans 300]

The world has 40 boxes and a mesh of 45,000 triangles around the sensors; none of them moves, or, in one
row, all boxes do. Costs are processor time, the least of the rounds; over ROS that of the simulator with a
listener in a process of its own, less that of the same ticks unheard. Prints a table and writes
sensors.json. It starts simulators on masters of their own.
"""

import contextlib
import math
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pybullet
import reporting
import trimesh
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from realtime import listening, processor_time, simulator_process

from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.world import World, ground_plane
from robot_sim.sensors.laser import Laser
from robot_sim.sensors.rays import RayScene
from robot_sim.sensors.sensing import Sensing, sensor_pose
from robot_sim.simulator import Simulator
from ros_calls.service import ServiceClient
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.simulation import Simulation

ROBOTS = Path(__file__).resolve().parents[1] / "test/data/robots"
BOXES, TRIANGLES = 40, 45_000
RAYS, FAR = 360, 30.0  # FAR in m
UNHEARD, TICKS = 16, 2000
MODEL = """<sdf version="1.6"><model name="m"><static>{static}</static><link name="l">
<inertial><mass>1</mass></inertial>
<collision name="c"><geometry>{shape}</geometry></collision>
<visual name="v"><geometry>{shape}</geometry>
<material><diffuse>0.8 0.5 0.2 1</diffuse></material></visual>
{sensor}</link></model></sdf>"""
SHELL = "<box><size>0.1 0.1 0.1</size></box>"
SCAN = f"""<ray><scan>
<horizontal><samples>{RAYS}</samples><min_angle>-3.14159</min_angle><max_angle>3.12414</max_angle></horizontal>
<vertical><samples>{{rows}}</samples><min_angle>-0.26</min_angle><max_angle>0.26</max_angle></vertical>
</scan><range><min>0.1</min><max>{FAR:g}</max></range></ray>"""
CAMERA = "<camera><image><width>320</width><height>240</height></image></camera>"
PLUGIN = """<sensor name="s" type="{kind}"><pose>0 0 0.3 0 0 0</pose>{what}
<plugin name="p" filename="libgazebo_ros_{library}.so">
<topicName>/seen</topicName><cameraName>/eye</cameraName></plugin></sensor>"""
LASER = PLUGIN.format(kind="ray", what=SCAN.format(rows=1), library="laser")
OVER_ROS = {  # sensor, topic, its type
    "laser of 360 rays": (LASER, "/seen", "sensor_msgs/LaserScan"),
    "Velodyne of 16 x 360 rays": (
        PLUGIN.format(kind="ray", what=SCAN.format(rows=16), library="velodyne_laser"),
        "/seen", "sensor_msgs/PointCloud2",
    ),
    "depths of 320 x 240 with colours and cloud": (
        PLUGIN.format(kind="depth", what=CAMERA, library="openni_kinect"),
        "/eye/points", "sensor_msgs/PointCloud2",
    ),
    "depths of 320 x 240": (
        PLUGIN.format(kind="depth", what=CAMERA, library="openni_kinect"),
        "/eye/depth/image_raw", "sensor_msgs/Image",
    ),
    "colours of 320 x 240": (
        PLUGIN.format(kind="camera", what=CAMERA, library="camera"),
        "/eye/image_raw", "sensor_msgs/Image",
    ),
}  # fmt: skip
TARGETS = {
    "a scan of 360 rays [ms]": "<= 0.25",
    "rayTestBatch over it": ">= 6",
    "Velodyne of 16 x 360 rays, message included [ms]": "<= 2.5",
    "depths of 320 x 240 with colours and cloud, message included [ms]": "<= 20",
    "colours of 320 x 240, message included [ms]": "<= 27",
    "rover with a 5 Hz laser, times real time": ">= 30",
    "16 unheard sensors, share of a tick": "<= 0.01",
}


def surroundings(folder: Path, static: bool = True) -> Iterator[tuple[str, str, Pose]]:
    """Name, SDF and pose of the boxes and the mesh."""
    random, box = np.random.default_rng(0), "<box><size>0.5 0.4 0.6</size></box>"
    for index in range(BOXES):
        angle, radius = random.uniform(0.0, 2.0 * math.pi), random.uniform(2.0, 8.0)
        place = radius * math.cos(angle), radius * math.sin(angle), 0.3
        yield (
            f"box{index}",
            MODEL.format(static=int(static), shape=box, sensor=""),
            Pose(place, from_rpy(*random.uniform(-1.0, 1.0, 3))),
        )
    ball = trimesh.creation.icosphere(6, 1.0)
    file = folder / "mesh.stl"
    trimesh.Trimesh(ball.vertices, ball.faces[:TRIANGLES]).export(file)
    mesh = f"<mesh><uri>file://{file}</uri></mesh>"
    yield "mesh", MODEL.format(static=1, shape=mesh, sensor=""), Pose((4.0, 4.0, 0.0))


def least(action: Callable[[], object], rounds: int, count: int = 50) -> float:
    """The least processor time of an action [ms]."""
    taken = []
    for _ in range(rounds):
        begin = time.thread_time()
        for _ in range(count):
            action()
        taken.append(1e3 * (time.thread_time() - begin) / count)
    return min(taken)


def scans(results: dict[str, float], folder: Path, rounds: int, static: bool) -> None:
    """A scan in-process, by Embree and by PyBullet's own rays."""
    engine = BulletEngine()
    world = World(engine)
    world.spawn("ground", ground_plane(), Pose())
    for name, text, pose in surroundings(folder, static):
        world.spawn(name, parse_sdf(text), pose)
    sdf = MODEL.format(static=1, shape=SHELL, sensor=LASER)
    model = world.spawn("robot", parse_sdf(sdf), Pose())
    sensor = model.description.sensors[0]
    laser, scene, random = Laser(sensor), RayScene(world), np.random.default_rng(0)
    client = engine._client

    def scan() -> np.ndarray:
        scene.expire()
        return laser.measure(scene, sensor_pose(model, sensor), 0.0, random).ranges

    assert np.isfinite(scan()).sum() > RAYS // 4
    angles = np.linspace(-3.14159, 3.12414, RAYS)
    ways = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(RAYS)])
    start = np.array([0.0, 0.0, 0.3])
    starts, ends = (start + 0.1 * ways).tolist(), (start + FAR * ways).tolist()
    where = "" if static else ", all boxes move"
    own = least(scan, rounds)
    theirs = least(lambda: pybullet.rayTestBatch(starts, ends, physicsClientId=client), rounds)
    results[f"a scan of 360 rays{where} [ms]"] = own
    results[f"rayTestBatch over it{where}"] = theirs / own
    engine.close()


def stepper() -> Callable[..., None]:
    """Takes so many ticks of the active simulator."""
    step = ServiceClient("/gazebo/step_world", StepWorld, persistent=True, timeout=120.0)

    def take(ticks: int, controllers: tuple[str, ...] = (), commands: tuple[float, ...] = ()) -> None:
        for _ in range(0, ticks, 50):
            answer = step(StepWorldRequest(ticks=50, controllers=controllers, commands=commands))
            assert answer.success, answer.status_message

    return take


def over_ros(results: dict[str, float], folder: Path, rounds: int, count: int) -> None:
    """What a measurement of each tick costs the simulator, its message included."""
    with Simulation(lockstep=True) as simulation, simulation.active():
        process, take = simulator_process(simulation), stepper()
        for name, text, pose in surroundings(folder):
            put(name, text, pose)

        def cost() -> float:
            begin = processor_time(process)
            take(count)
            return 1e3 * (processor_time(process) - begin) / count

        for name, (sensor, topic, kind) in OVER_ROS.items():
            put("robot", MODEL.format(static=1, shape=SHELL, sensor=sensor), Pose())
            take(50)
            unheard = min(cost() for _ in range(3))
            with listening(simulation, {topic: kind}):
                taken = min(cost() for _ in range(max(2, rounds // 3)))
            results[f"{name}, message included [ms]"] = taken - unheard
            assert ros_gazebo.gazebo_delete_model("robot")


def put(name: str, sdf: str, pose: Pose) -> None:
    x, y, z = pose.position
    assert ros_gazebo.gazebo_spawn_sdf_string(sdf, model_name=name, pos_x=x, pos_y=y, pos_z=z)


def rover(results: dict[str, float], seconds: int = 20) -> None:
    """A two-wheeled robot that drives, its laser heard; simulated time by that of all processes."""
    with Simulation(lockstep=True) as simulation, simulation.active():
        assert ros_params.ros_load_yaml_from_path(str(ROBOTS / "rover.yaml"))
        assert ros_urdf.urdf_load_from_path(str(ROBOTS / "rover.urdf"), "/robot_description")
        assert ros_gazebo.gazebo_spawn_urdf_param("/robot_description", "rover", pos_z=0.08)[0]
        assert ros_controllers.spawn_controllers_srv(["joints", "wheels"])
        process, take = simulator_process(simulation), stepper()
        with listening(simulation, {"/scan": "sensor_msgs/LaserScan"}):
            begin, own = processor_time(process), time.process_time()
            take(1000 * seconds, ("wheels",), (3.0, 2.0))
            used = processor_time(process) - begin + time.process_time() - own
            results["rover with a 5 Hz laser, times real time"] = seconds / used


def unheard(results: dict[str, float], rounds: int) -> None:
    """Ticks of a world with sensors that nobody hears against those of one without; in turns."""
    sims = [Simulator(World(BulletEngine()), lockstep=True) for _ in range(2)]
    sensing = Sensing(sims[1])
    for sim in sims:
        sim.world.spawn("ground", ground_plane(), Pose())
        text = MODEL.format(static=0, shape=SHELL, sensor="")
        robot = sim.world.spawn("robot", parse_sdf(text), Pose((0.0, 0.0, 0.05)))
    with sims[1].lock:
        for _ in range(UNHEARD):
            sensing.schedule.begin(robot, 10.0, lambda _: None, lambda: False)

    def ticks(sim: Simulator) -> float:
        with sim.lock:
            return least(lambda: sim.advance(TICKS), 1, 1) / TICKS

    taken = [[ticks(sim) for sim in sims] for _ in range(10 * rounds)]
    without, alongside = (min(each) for each in zip(*taken, strict=True))
    results["tick of a body without sensors [us]"] = 1e3 * without
    results["16 unheard sensors, share of a tick"] = alongside / without - 1.0


def measure(rounds: int, count: int) -> Mapping[str, float]:
    results: dict[str, float] = {}
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for static in (True, False):
            scans(results, folder, rounds, static)
        unheard(results, rounds)
        over_ros(results, folder, rounds, count)
    rover(results)
    return results


def main() -> None:
    options = reporting.options(__doc__ or "", rounds=9, scans=300)
    results = measure(options.rounds, options.scans)
    print(f"{'':66} {'':>9} {'target':>8}")
    for name, value in results.items():
        print(f"{name:66} {value:9.3f} {TARGETS.get(name, ''):>8}")
    reporting.write(options.out, "sensors", dict(results))


if __name__ == "__main__":
    main()
