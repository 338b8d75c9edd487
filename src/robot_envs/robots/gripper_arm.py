"""The arm with a gripper: it picks a cube from a table and lifts it, with a dense reward or to a goal."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.errors import TaskError
from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import GoalTask, Object, Task
from robot_envs.world_state import InitialState, LinkQuery, Pose, StateQuery, WorldState

ARM = ("waist", "shoulder", "elbow", "wrist")
SHOULDER = 0.25  # [m] of its height
UPPER, FORE, HAND = 0.28, 0.26, 0.148  # [m] of lengths, the last to the tip
OPEN, SHUT = 0.04, 0.01  # [m] that fingers are asked to be from the middle
TABLE = 0.3  # [m] of its top above the ground; all other heights are from there
SIZE, MASS = 0.04, 0.05  # [m], [kg] of the cube
ON_TABLE = 0.5 * SIZE  # [m] of the cube's middle; of fingers that hold it, from the middle
MIDDLE = np.array([0.36, 0.0, 0.10])  # [m] of where the tip works, from the arm's foot
REACH = np.array([0.12, 0.18, 0.15])  # [m] that the tip may be away from there, either way
LOWEST = 0.015  # [m] of the tip
SPREAD = (0.07, 0.12)  # [m] of cubes and goals around it, along x and y, either way
TURNED = 0.25  # [rad] of a cube from facing the arm, either way
STEP, CLOSING = 0.025, 0.01  # [m] that an action moves the tip along an axis, and a finger, at most
UNIT = 0.1  # [m]: numbers of order 1, which networks tell apart
OWN = [0, 1, 2, 9, 10]  # numbers that tell of the arm alone
NEAR = 0.02  # [m] of the way to the cube, which is seen better from there on
LIFTED = 0.10  # [m]: the cube is up
CLOSE = 0.05  # [m]: it is at its goal

ROBOT = own_robot(
    "gripper_arm",
    "arm_controller",
    "gripper_controller",
    pose=Pose((0.0, 0.0, TABLE)),
    control_period=0.05,
    physics_step=0.002,
)

_BOX = """<sdf version="1.6"><model name="box"><static>{static}</static><link name="link">
<inertial><mass>{mass}</mass><inertia><ixx>{i}</ixx><iyy>{i}</iyy><izz>{i}</izz></inertia></inertial>
<collision name="collision"><geometry><box><size>{size}</size></box></geometry></collision>
<visual name="visual"><geometry><box><size>{size}</size></box></geometry>
<material><ambient>{colour}</ambient><diffuse>{colour}</diffuse></material></visual>
</link></model></sdf>"""
OBJECTS = (
    Object(
        "table",
        _BOX.format(static=1, mass=1, i=1, size=f"0.9 0.8 {TABLE}", colour="0.62 0.58 0.52 1"),
        Pose((0.25, 0.0, 0.5 * TABLE)),
    ),
    Object(
        "cube",
        _BOX.format(static=0, mass=MASS, i=MASS * SIZE**2 / 6, size=f"{SIZE} {SIZE} {SIZE}",
                    colour="0.10 0.60 0.20 1"),
        Pose((float(MIDDLE[0]), 0.0, TABLE + ON_TABLE)),
    ),
)  # fmt: skip


class Picking(Task):
    """What tasks of the gripper arm have in common: arm, cube and table, actions, and how episodes begin."""

    max_steps = 60
    action_names = ("x", "y", "z", "grip")
    query = StateQuery(links=(LinkQuery("tip"),), models=("cube",))
    objects = OBJECTS

    def __init__(self, helped: float = 0.0) -> None:
        if not 0.0 <= helped <= 1.0:
            raise TaskError(f"helped is a share from 0 to 1, not {helped}")
        self.helped = helped

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(4)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """Draws how an episode begins; see `PickCube`."""
        tip, cube = MIDDLE + rng.uniform(-0.05, 0.05, 3), draw_cube(rng)
        turned = float(rng.uniform(-TURNED, TURNED))
        yaw, drawn = math.atan2(cube[1], cube[0]) + turned, rng.random()
        if drawn < 0.5 * self.helped:
            return placed(tip, tip, math.atan2(tip[1], tip[0]), in_hand=True)
        if drawn < self.helped:
            tip = cube + (0.0, 0.0, rng.uniform(0.0, 0.1))
        return placed(tip, cube, yaw)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        tip = np.clip(aim(state) + STEP * action[:3], MIDDLE - REACH, MIDDLE + REACH)
        tip[2] = max(tip[2], LOWEST)
        finger = state.commands["gripper_controller"][0] - CLOSING * float(action[3])
        finger = min(max(finger, SHUT), OPEN)
        return {"arm_controller": angles(tip), "gripper_controller": (finger, finger)}


class PickCube(Picking):
    """The gripper grasps the cube and lifts it.

    ## Action space
    `Box(-1, 1, (4,))`: by how much the set-point of the tip moves along x, y and z [0.025 m], and
    those of the fingers towards each other [0.01 m]. The hand always points down.

    ## Observation space
    `Box((12,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0 to 2 | position of the tip, from 0.36 m ahead of the arm and 0.1 m above the table | 0.1 m |
    | 3 to 5 | from the tip to the cube | 0.1 m |
    | 6 to 8 | the same, clipped at 1 | 0.02 m |
    | 9 | how far the fingers are from each other, less the cube's 0.04 m | 0.02 m |
    | 10 | the same of their set-points | 0.02 m |
    | 11 | the height of the cube above where it lies on the table | 0.1 m |

    ## Rewards
    0.5 exp(-w / 0.1) + 0.5 g + min(h / 0.1, 1.2) for each step: w is how far the tip is from a funnel over
    the cube [m], which leads down to it from above, so that fingers don't push it; g is how far the fingers'
    set-points are closed, from 0 to 1, if the tip is within 0.02 m of the cube, and otherwise 0; h is the
    cube's height over the table [m].

    ## Start of an episode
    The cube lies within 0.07 m (x) and 0.12 m (y) of the middle, turned by up to 0.25 rad from facing the
    arm. The open gripper is within 0.05 m of the point 0.1 m above the middle, along each axis.

    ## End of an episode
    Truncated after 60 steps of 0.05 s; never terminated.

    ## Info
    `height`: h [m]. `is_success`: whether it is at least 0.1 m.

    Args:
        helped: Share of episodes that begin with the cube in the hand, or with the open gripper up to 0.1 m
            above it, each as likely: so a training soon meets what it is about.
    """

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(12)

    def observe(self, state: WorldState) -> np.ndarray:
        height = min(places(state)[1][2] - ON_TABLE, 1.0)
        return np.array([*seen(state), height / UNIT], np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        tip, cube = places(state)
        way = cube - tip
        wanted = state.commands["gripper_controller"][0]
        closed = (OPEN - wanted) / (OPEN - SHUT) if float(np.linalg.norm(way)) < NEAR else 0.0
        height = float(cube[2] - ON_TABLE)
        return 0.5 * math.exp(-funnel(way) / 0.1) + 0.5 * closed + min(max(height / LIFTED, 0.0), 1.2)

    def info(self, state: WorldState) -> dict[str, Any]:
        height = float(places(state)[1][2] - ON_TABLE)
        return {"height": height, "is_success": height >= LIFTED}


class PickCubeGoal(Picking, GoalTask):
    """The gripper takes the cube to a goal; the reward only says whether it is there. For hindsight replay.

    ## Action space
    As in `PickCube`.

    ## Observation space
    `Dict`

    | key | space | what it is | unit |
    |---|---|---|---|
    | `observation` | `Box((11,))` | the first eleven numbers of `PickCube` | |
    | `achieved_goal` | `Box(-10, 10, (6,))` | places of cube and tip, from the same point | 0.1 m |
    | `desired_goal` | `Box(-10, 10, (6,))` | where they should be: the goal, twice | 0.1 m |

    ## Rewards
    0 if both cube and tip are within 0.05 m of the goal when the step is over, else -1.

    ## Start of an episode
    As in `PickCube`. The goal is over the same part of the table, up to 0.2 m high.

    ## End of an episode
    Truncated after 60 steps of 0.05 s; never terminated.

    ## Info
    `is_success`: whether the cube is there, and the tip.

    Args:
        helped: As in `PickCube`; without it hindsight learns little, since most goals achieved are the same.
    """

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(11)

    def goals(self) -> gymnasium.spaces.Box:
        """Returns points over the table for cube and tip (x, y, z each) [0.1 m]."""
        return gymnasium.spaces.Box(-10.0, 10.0, (6,), np.float32)

    def goal(self, rng: np.random.Generator, state: WorldState) -> np.ndarray:
        """Draws a point over the table [0.1 m], and returns it for the cube and for the tip."""
        goal = draw_cube(rng) + (0.0, 0.0, rng.uniform(0.0, 0.2 - ON_TABLE))
        return np.tile((goal - MIDDLE) / UNIT, 2).astype(np.float32)

    def observe(self, state: WorldState) -> np.ndarray:
        return np.array(seen(state), np.float32)

    def achieved(self, state: WorldState) -> np.ndarray:
        tip, cube = places(state)
        return np.clip(np.concatenate([cube - MIDDLE, tip - MIDDLE]) / UNIT, -10.0, 10.0)

    def is_success(self, achieved: np.ndarray, desired: np.ndarray) -> np.ndarray:
        """Returns whether cube and tip are there; vectorised."""
        off = np.subtract(achieved, desired)
        away = np.linalg.norm(off.reshape(*off.shape[:-1], 2, 3), axis=-1)
        return away.max(axis=-1) <= CLOSE / UNIT


def pick(observation: Any, env: Any = None) -> np.ndarray:
    """Returns a demonstrator's action in `PickCube` and `PickCubeGoal`: over the cube, down, grasp, lift."""
    goal = None
    if isinstance(observation, dict):
        goal = (observation["desired_goal"] - observation["achieved_goal"])[:3].astype(float)
        observation = observation["observation"]
    seen = np.asarray(observation, float)
    way, wanted = UNIT * seen[3:6], SIZE + 0.02 * seen[10]  # [m]
    holds = wanted < SIZE  # closed, once it was there
    move, is_near = np.zeros(3), float(np.linalg.norm(way)) < (NEAR if holds else 0.3 * NEAR)
    if is_near and holds:
        up = 1.5 * LIFTED + ON_TABLE - MIDDLE[2] - UNIT * seen[2]
        move = np.array([0.0, 0.0, up]) if goal is None else UNIT * goal
    elif not is_near:
        above = min(2.0 * max(math.hypot(way[0], way[1]) - 0.006, 0.0), 0.06)
        move = way + (0.0, 0.0, above)
    closing = 1.0 if is_near else -1.0
    return np.clip([*(move / STEP), closing], -1.0, 1.0).astype(np.float32)


def by_camera(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    """Wraps `PickCube` for policies that see the cube in a picture alone; the environment has its camera.

    Observed are "state" (5,), numbers 0 to 2, 9 and 10 of the task's, which tell of the arm, and "pixels".
    """
    own = gymnasium.wrappers.TransformObservation(env, lambda seen: seen[OWN], numbers(len(OWN)))
    return gymnasium.wrappers.AddRenderObservation(own, render_only=False)


def draw_cube(rng: np.random.Generator) -> np.ndarray:
    """Returns a place of the cube on the table [m]."""
    x, y = rng.uniform(np.negative(SPREAD), SPREAD)
    return np.array([MIDDLE[0] + x, MIDDLE[1] + y, ON_TABLE])


def placed(tip: np.ndarray, cube: np.ndarray, yaw: float, in_hand: bool = False) -> InitialState:
    """Returns the state with tip and cube at these places [m], the cube turned by `yaw` [rad]."""
    arm = angles(tip)
    finger, command = (ON_TABLE, SHUT) if in_hand else (OPEN, OPEN)
    x, y, z = cube.tolist()
    turned = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    return InitialState(
        joints=dict(zip(ARM, arm, strict=True)) | {"left_finger": finger, "right_finger": finger},
        models={"cube": Pose((x, y, TABLE + z), turned)},
        commands={"arm_controller": arm, "gripper_controller": (command, command)},
    )


def angles(tip: np.ndarray) -> tuple[float, float, float, float]:
    """Returns the arm's joints [rad] that put the tip there, pointing down: the law of cosines."""
    x, y, z = tip.tolist()
    away, up = math.hypot(x, y), z + HAND - SHOULDER  # of the wrist, from the shoulder
    square = away * away + up * up
    inner = math.acos((UPPER**2 + square - FORE**2) / (2.0 * UPPER * math.sqrt(square)))
    shoulder = math.atan2(away, up) - inner
    elbow = 0.5 * math.pi - math.acos((UPPER**2 + FORE**2 - square) / (2.0 * UPPER * FORE))
    return math.atan2(y, x), shoulder, elbow, 0.5 * math.pi - shoulder - elbow


def funnel(way: np.ndarray) -> float:
    """Returns how far the tip is from a funnel over the cube [m]; `way` leads from tip to cube [m].

    Its rim is 0.06 m above the cube, and its mouth 0.01 m wide. What the tip is too low counts twice.
    """
    flat = float(np.hypot(way[0], way[1]))
    low = float(way[2]) + min(2.0 * max(flat - 0.01, 0.0), 0.06)  # [m] that the tip is too low by
    return math.hypot(flat, low if low < 0.0 else 2.0 * low)


def aim(state: WorldState) -> np.ndarray:
    """Returns where the arm's set-points put the tip [m]."""
    waist, shoulder, elbow, _ = state.commands["arm_controller"]
    away = UPPER * math.sin(shoulder) + FORE * math.cos(shoulder + elbow)
    up = UPPER * math.cos(shoulder) - FORE * math.sin(shoulder + elbow)
    return np.array([away * math.cos(waist), away * math.sin(waist), SHOULDER - HAND + up])


def places(state: WorldState) -> tuple[np.ndarray, np.ndarray]:
    """Returns where tip and cube are, from the arm's foot [m]."""
    foot = (0.0, 0.0, TABLE)
    tip = np.subtract(state.links["tip"].pose.position, foot)
    return tip, np.subtract(state.models["cube"].pose.position, foot)


def seen(state: WorldState) -> list[float]:
    """Returns what both tasks observe of arm and cube; see `PickCube`."""
    tip, cube = places(state)
    way = np.clip(cube - tip, -1.0, 1.0)
    gap = state.joints["left_finger"].position + state.joints["right_finger"].position
    wanted = 2.0 * state.commands["gripper_controller"][0]
    return [
        *((tip - MIDDLE) / UNIT),
        *(way / UNIT),
        *np.clip(way / NEAR, -1.0, 1.0),
        (gap - SIZE) / 0.02,
        (wanted - SIZE) / 0.02,
    ]
