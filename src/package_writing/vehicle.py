"""Bases on wheels: drive wheels, dimensions, speeds and laser."""

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from package_writing.standing import DOWN, reach
from package_writing.survey import SHARE, VELOCITY, Motor, Survey
from robot_sim.physics.description import DescriptionError, Sensor
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.engines import make_engine
from robot_sim.physics.pose import Pose, rotate
from robot_sim.physics.world import World
from robot_sim.sensors.laser import KINDS, Laser
from robot_sim.sensors.rays import RayScene

DRIVE = "diff_drive_controller"
ASKEW = 0.02  # of a wheel's axis, at most, off the base's y
ALIKE = 1.01  # largest ratio of radii
MIDDLE = 1e-3  # [m] off the base's middle, at most, of a wheel that is on neither side
FASTEST = 0.6  # [m/s]
QUICKEST = 2.0  # [rad/s]
MARGIN = 0.03  # [m] between the base and what it touches
ROOM = 0.1  # [m] around the base where it starts
LARGEST_CLEARANCE = 0.65  # [m], clearance of a base for which the room that comes along has space
WAYS = 64  # directions in which an outline is measured


@dataclass(frozen=True)
class Base:
    """What a diff_drive_controller drives."""

    left: tuple[str, ...]  # joints of the wheels on the left
    right: tuple[str, ...]  # on the right, as many
    radius: float  # of the wheels [m]
    separation: float  # of the left ones from the right ones [m]
    speed: float  # the highest ahead [m/s]
    frame: str  # the root link
    laser: Sensor | None = None  # one that sees its surroundings alone; None: there is none
    touch: float = 0.0  # range of the laser at which the base touches what it sees [m]
    clearance: float = 0.0  # free space about the middle of the base where it starts [m]
    note: str = ""  # why there is no laser, although the file has one

    @property
    def turn(self) -> float:
        """The highest angular speed [rad/s]."""
        return rounded(min(QUICKEST, 2.0 * self.speed / self.separation))

    @property
    def world(self) -> str:
        """The file of a world in which it drives, in the package cartpole; "" for an empty one."""
        return "worlds/room.world" if self.laser and self.clearance <= LARGEST_CLEARANCE else ""


def find_base(survey: Survey) -> Base | None:
    """Returns the base that wheels on its left and right drive, about its y, by velocity; None for others."""
    wheels = survey.wheels
    measured = [_wheel(survey, motor) for motor in wheels]
    rims = [each for each in measured if each is not None]
    if not rims or len(rims) < len(measured):
        return None
    left, right = (
        tuple(each.joint for each, (_, y) in zip(wheels, rims, strict=True) if sign * y > MIDDLE)
        for sign in (1.0, -1.0)
    )
    radii, places = zip(*rims, strict=True)
    if not 2 * len(left) == 2 * len(right) == len(wheels) or max(radii) > ALIKE * min(radii):
        return None
    speed = min(SHARE * min(each.fastest for each in wheels) * radii[0], FASTEST)
    separation = 2.0 * float(np.mean(np.abs(places)))
    base = Base(left, right, rounded(radii[0]), rounded(separation), rounded(speed), survey.model.root)
    laser, note = _laser(survey)
    touch, clearance = _outline(survey, laser)
    return replace(base, laser=laser, touch=touch, clearance=clearance, note=note)


def _wheel(survey: Survey, motor: Motor) -> tuple[float, float] | None:
    """Returns radius and y of a wheel [m]; None if it isn't one of a base that drives ahead."""
    model, poses = survey.model, link_poses(survey.model, Pose(), {})
    joint = model.joints[motor.joint]
    frame = poses[joint.child].compose(joint.anchor)
    shapes = [(each, poses[joint.child].compose(each.pose)) for each in model.links[joint.child].collisions]
    movers = [each for each in model.carriers(joint.child) if each.movable]
    axis = rotate(frame.orientation, joint.axis)
    along = math.dist(axis, (0.0, 1.0, 0.0)) <= ASKEW
    if motor.interface != VELOCITY or len(movers) > 1 or not shapes or not along:
        return None
    low = max(reach(*each, DOWN) for each in shapes)
    return low + frame.position[2], float(np.mean([pose.position[1] for _, pose in shapes]))


def rounded(number: float) -> float:
    return float(f"{number:.4g}")


def _laser(survey: Survey) -> tuple[Sensor | None, str]:
    """Returns the first laser that sees its surroundings and not the robot itself; or None, and why."""
    note = ""
    for sensor in (each for each in survey.model.sensors if each.kind in KINDS):
        world = World(make_engine())
        try:
            laser, model = Laser(sensor), world.spawn("robot", survey.model, Pose())
            pose = model.link_state(sensor.link)[0].compose(sensor.pose)
            scene = RayScene(world, visuals=laser.sees_visuals)
            seen = laser.measure(scene, pose, 0.0, np.random.default_rng(0)).ranges
        except DescriptionError as error:
            note = str(error)
            continue
        finally:
            world.engine.close()
        if seen.min() == math.inf:
            return sensor, ""
        note = f"its laser '{sensor.name}' sees the robot itself"
    return None, note


def _outline(survey: Survey, laser: Sensor | None) -> tuple[float, float]:
    """Returns how near what a laser sees may come, and the free space of starts [m]."""
    poses = link_poses(survey.model, Pose(), {})
    shapes = [
        (shape, pose.compose(shape.pose))
        for name, pose in poses.items()
        for shape in survey.model.links[name].collisions
    ]

    def widest(centre: Pose, angles: np.ndarray) -> float:
        reaches = [0.0]
        for angle in angles.tolist():
            way = rotate(centre.orientation, (math.cos(angle), math.sin(angle), 0.0))
            reaches += [reach(*each, way) - float(np.dot(centre.position, way)) for each in shapes]
        return max(reaches)

    middle = widest(Pose(), np.linspace(-math.pi, math.pi, WAYS))
    if laser is None:
        return 0.0, rounded(middle + ROOM)
    eye = poses[laser.link].compose(laser.pose)
    touch = max(widest(eye, Laser(laser).horizontal.angles(WAYS)), Laser(laser).low) + MARGIN
    away = math.hypot(*eye.position[:2])
    return rounded(touch), rounded(max(middle, touch + away) + ROOM)


def scan_topic(laser: Sensor, namespace: str, name: str) -> str:
    """Returns the topic of a laser (docs/contract/sensors.md 0.2) of a model spawned in a namespace."""
    element = next((each.element for each in laser.plugins), laser.element)
    own = element.findtext("robotNamespace")
    given = namespace if own is None else own.strip() or name
    topic = (element.findtext("topicName") or "scan").strip()
    parts = (topic if topic[:1] == "/" else f"{given}/{topic}").split("/")
    resolved = "/" + "/".join(filter(None, parts))
    return resolved if re.fullmatch(r"[\w/]+", resolved) else "/scan"  # it stands in launch files
