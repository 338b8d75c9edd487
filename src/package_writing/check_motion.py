"""Trials of a robot in an engine: standing with its joints held, and motion by commands."""

import math
from collections.abc import Iterable, Mapping
from copy import deepcopy

from package_writing.standing import stance, standing_height
from robot_envs.testing.episodes import LOWER, UPRIGHT
from robot_sim.control.hardware import EFFORT
from robot_sim.physics.description import DescriptionError, Joint, ModelDescription
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.world_file import WorldDescription
from robot_sim.physics.loops import in_loops
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose, conjugate, rotate
from robot_sim.physics.world import World, ground_plane
from robot_sim.simulator import Simulator

SECONDS = 2.0  # for which it has to stand
PUSH = 0.2  # [s] for which a joint is commanded
LOOK = 0.05  # [s] between two looks at it
SPEED = 1.0  # [rad/s, m/s], of a command, at most
STRONG = 1e5  # [N m, N], of a joint whose file knows no limit
SHARE = 0.1  # of the way commanded: less is no motion
SLACK = 0.01  # [m], by which a base on the ground may sink
FASTEST, QUICKEST = 100.0, 1000.0  # [m/s] of a base, [rad/s, m/s] of a joint


def observe(
    content: ModelDescription | WorldDescription, interfaces: Mapping[str, str], engine: str
) -> tuple[str, list[str]]:
    """Lets a world run, or a robot stand, and then commands its joints, each alone.

    `interfaces` are hardware interfaces by joint; joints without one take efforts. Returns a line, and the
    faults: why it doesn't stand, or the engine can't take it, and the joints that commands don't move.
    """
    sim = Simulator(World(make_engine(engine)), lockstep=True)
    try:
        if isinstance(content, ModelDescription):
            return _of_robot(sim, content, interfaces)
        sim.set_time_step(content.time_step)
        sim.world.set_gravity(content.gravity)
        for name, each in content.models.items():
            sim.world.spawn(name, deepcopy(each), each.initial_pose)
        return _run(sim, sim.world.models.values())
    except DescriptionError as error:
        return str(error), [str(error)]
    finally:
        sim.world.close()


def _of_robot(
    sim: Simulator, robot: ModelDescription, interfaces: Mapping[str, str]
) -> tuple[str, list[str]]:
    starts, height = stance(robot), 0.0
    if not robot.fixed_base:
        sim.world.spawn("ground_plane", ground_plane(), Pose())
        height = standing_height(robot, starts) or 0.0
    model = sim.world.spawn(robot.name, deepcopy(robot), Pose((0.0, 0.0, height)))
    sim.set_joint_states(model, starts)
    if robot.static:
        return _run(sim, [model])
    driven = [each for each in robot.movable_joints if each.name not in robot.mimics]
    for joint in driven:
        model.set_motor(joint.name, 0.0, _strength(joint, ""))
    begin, (first, _) = sim.save_state(), model.root_state()
    _, faults = _run(sim, [model])
    pose, _ = model.root_state()
    sank, most = first.position[2] - pose.position[2], (1.0 - LOWER) * abs(first.position[2])
    up = rotate(conjugate(first.orientation), (0.0, 0.0, 1.0))
    level = max(-1.0, min(1.0, rotate(pose.orientation, up)[2]))
    if not faults and not (level > UPRIGHT and sank < most + SLACK):
        solid = any(each.collisions for each in robot.links.values())
        faults = ["it falls" if solid else "it has no <collision>, so that it falls through the ground"]
    text = faults[0] if faults else "held by its fixed base" if robot.fixed_base else "stands"
    if not robot.fixed_base:
        tilt = math.degrees(math.acos(level))
        text += f", {1000.0 * sank:.1f} mm lower and tilted by {tilt:.1f}°"
        text += f" after {SECONDS:g} s, joints held"
    still = []
    for joint in driven:
        sim.restore_state(begin)
        if why := _why_still(sim, model, joint, interfaces.get(joint.name, EFFORT)):
            still.append(f"commands don't move '{joint.name}': {why}")
    if driven:
        text += f"; commands move {len(driven) - len(still)} of {len(driven)} joints"
    return text, faults + still


def _why_still(sim: Simulator, model: Model, joint: Joint, interface: str) -> str:
    """Commands a joint both ways; returns why that moves it nowhere, "" if it does."""
    speed = min(joint.velocity, SPEED) if joint.velocity >= 0.0 else SPEED
    room = joint.upper - joint.lower if joint.bounded else math.inf
    strength, begin, ends = _strength(joint, interface), sim.save_state(), []
    for what, limit in (("range", room), ("velocity", speed), ("effort", strength)):
        if limit == 0.0:
            return f"the {what} of its <limit> is 0"
    loops = in_loops(model.description)
    for way in (speed, -speed):
        sim.restore_state(begin)
        for name in loops if joint.name in loops else ():  # one alone can't move
            model.set_motor(name, 0.0, model.description.joints[name].friction)
        model.set_motor(joint.name, way, strength)
        sim.advance(round(PUSH / sim.world.time_step))
        ends.append(model.joint_state(joint.name)[0])
    if abs(ends[0] - ends[1]) > SHARE * min(PUSH * speed, room):
        return ""
    unit = "N" if joint.kind == "prismatic" else "N m"
    return f"{strength:g} {unit} are too little for its load, or links are in the way"


def _run(sim: Simulator, models: Iterable[Model]) -> tuple[str, list[str]]:
    """Lets time pass; returns a line, and which model blew up, if one did."""
    for _ in range(round(SECONDS / LOOK)):
        sim.advance(max(1, round(LOOK / sim.world.time_step)))
        for model in models:
            _, (linear, _) = model.root_state()
            speeds = [abs(speed) for _, speed in model.joint_states()]
            if not (math.hypot(*linear) < FASTEST and all(speed < QUICKEST for speed in speeds)):
                fault = f"'{model.name}' blows up after {sim.sim_time:.2g} s"
                return fault, [fault]
    return f"nothing blows up within {SECONDS:g} s", []


def _strength(joint: Joint, interface: str) -> float:
    """Returns a joint's limit of effort; files say 0 where they know none, which holds effort commands."""
    known = joint.effort > 0.0 or (joint.effort == 0.0 and interface == EFFORT)
    return min(joint.effort, STRONG) if known else STRONG
