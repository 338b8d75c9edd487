"""Two arms with different drives, a wall, and a ball that one of them hits.

The left one has a group of positions; the right one a position with a PID, and a velocity with one of
gazebo_ros_control's. A tassel hangs at each, which nobody drives or measures. The ball, and a plinth from
a file, are the task's.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from support.scenes.parts import INERTIA, joint, link, plugin, transmission

from robot_envs import (
    Commands,
    InitialState,
    LinkQuery,
    Motion,
    Object,
    Pose,
    Robot,
    StateQuery,
    Task,
    WorldState,
)

WORLD = """<sdf version="1.6"><world name="hall">
  <include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>
  <model name="wall"><static>true</static><pose>0 0.6 0.5 0 0 0</pose><link name="link">
    <collision name="stone"><geometry><box><size>3 0.1 1</size></box></geometry></collision>
    <visual name="stone"><geometry><box><size>3 0.1 1</size></box></geometry>
      <material><diffuse>0.6 0.3 0.2 1</diffuse></material></visual>
  </link></model></world></sdf>"""
SHAPE = "<geometry><sphere><radius>0.08</radius></sphere></geometry>"
BALL = f"""<sdf version="1.6"><model name="anything"><link name="rubber">
  <inertial><mass>0.2</mass><inertia><ixx>0.0005</ixx><iyy>0.0005</iyy><izz>0.0005</izz>
    <ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
  <collision name="skin">{SHAPE}</collision>
  <visual name="skin">{SHAPE}<material><diffuse>0 0.8 0 1</diffuse></material></visual>
</link></model></sdf>"""
INERTIAL = f'<inertial><mass value="1"/>{INERTIA.format(0.01)}</inertial>'
PLINTH = f"""<robot name="plinth"><link name="world"/><joint name="fixed" type="fixed">
  <parent link="world"/><child link="block"/></joint>
  <link name="block">{INERTIAL}
  <collision name="top"><geometry><box size="0.2 0.2 0.25"/></geometry></collision>
  <visual><geometry><box size="0.2 0.2 0.25"/></geometry>
    <material name="blue"><color rgba="0 0 1 1"/></material></visual></link></robot>"""
PID = {"p": 40.0, "i": 1.0, "d": 2.0}
LEFT_CONTROLLERS = {
    "pair": {"type": "position_controllers/JointGroupPositionController", "joints": ["elbow", "shoulder"]},
    "joint_state_controller": {"type": "joint_state_controller/JointStateController", "publish_rate": 100},
}  # fmt: skip
RIGHT_CONTROLLERS = {
    "lift": {"type": "effort_controllers/JointPositionController", "joint": "shoulder", "pid": PID},
    "swing": {"type": "velocity_controllers/JointVelocityController", "joint": "elbow"},
    "gazebo_ros_control": {"pid_gains": {"elbow": {"p": 2.0, "i": 0.1, "d": 0.0}}},
    "joint_limits": {"elbow": {"has_effort_limits": True, "max_effort": 1.5}},
}
SKIN = "ball::rubber::skin"


def arm(namespace: str, shoulder: str, elbow: str) -> str:
    """An arm that hangs from a gantry at its origin, 1.2 m above the ground, with a tassel at its elbow."""
    rod = '<cylinder radius="0.03" length="0.4"/>'
    parts = [
        '<link name="world"/>',
        link("base", '<box size="0.1 0.1 0.1"/>', 2.0),
        '<joint name="mount" type="fixed"><parent link="world"/><child link="base"/>'
        '<origin xyz="0 0 1.2"/></joint>',
        link("upper", rod, 1.0, "0 0 -0.25"),
        link("fore", rod, 0.6, "0 0 -0.25"),
        link("tip", '<sphere radius="0.04"/>', 0.1),
        link("tassel", '<box size="0.02 0.02 0.1"/>', 0.05, "0 0.06 -0.05"),
        joint("shoulder", "revolute", "base", "upper", "0 0 -0.05"),
        joint("elbow", "revolute", "upper", "fore", "0 0 -0.45"),
        joint("wrist", "fixed", "fore", "tip", "0 0 -0.47"),
        joint("thread", "revolute", "fore", "tassel", "0 0.04 -0.1", "1 0 0"),
        transmission("shoulder", shoulder),
        transmission("elbow", elbow),
        plugin(namespace),
    ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


LEFT = Robot(
    urdf=arm("/left", "Position", "Position"),
    controllers=LEFT_CONTROLLERS,
    run=("pair",),
    name="left",
    pose=Pose((-0.5, 0.0, 0.0)),
    world=WORLD,
    namespace="left",
)
RIGHT = Robot(
    urdf=arm("right", "Effort", "Velocity"),
    controllers={"right": RIGHT_CONTROLLERS},  # as a file for several robots has it
    run=("lift", "swing"),
    name="right",
    pose=Pose((0.5, 0.0, 0.0)),
    world=WORLD,
    namespace="/right",
)


class Volley(Task):
    """The ball, dropped on the plinth, is to go to the left; the action bends all four joints."""

    max_steps = 60
    query = StateQuery(
        models=("ball", "plinth", "left"),
        links=(LinkQuery("left::tip"), LinkQuery("right::tip", "left::tip"), LinkQuery("ball::rubber")),
        contacts_of=("ball",),
    )

    def __init__(self, folder: Path) -> None:
        """The plinth's file is written to the folder."""
        plinth = folder / "plinth.urdf"
        plinth.write_text(PLINTH)
        self.objects = (
            Object("ball", BALL, Pose((0.0, 0.0, 2.0))),
            Object("plinth", plinth, Pose((0.0, 0.0, 0.125))),
        )

    def action_space(self) -> Box:
        return Box(-1.0, 1.0, (4,), np.float64)

    def observation_space(self) -> Box:
        return Box(-np.inf, np.inf, (26,), np.float64)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        x, spin = rng.uniform(-0.02, 0.02), rng.uniform(-1.0, 1.0)
        turn = rng.uniform(0.2, 0.4)
        return InitialState(
            joints={
                "left::shoulder": 0.3, "right::shoulder": (-turn, 0.5), "right::elbow": 0.1,
                "left::thread": (0.5, 1.0),
            },
            models={"ball": Motion(Pose((x, 0.0, 0.36)), ((0.0, 0.0, 0.0), (0.0, spin, 0.0)))},
        )  # fmt: skip

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        elbow, shoulder, lift, swing = action.tolist()
        return {"/left/pair": (elbow, shoulder), "/right/lift": 1.5 * lift, "/right/swing": 3.0 * swing}

    def observe(self, state: WorldState) -> np.ndarray:
        joints = [number for each in state.joints.values() for number in each]
        tips = [*state.links["left::tip"].pose.position, *state.links["right::tip"].twist[0]]
        force = [0.0, 0.0, 0.0]
        for each in state.contacts:
            force = [a + b for a, b in zip(force, each.total[0], strict=True)]
        ball = state.models["ball"]
        return np.array([*joints, *tips, *force, *ball.pose.position, state.time, len(state.contacts)])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return -state.models["ball"].pose.position[0]

    def info(self, state: WorldState) -> dict[str, Any]:
        return {"touched": touched(state)}


def touched(state: WorldState) -> list[str]:
    """The models that touch the ball."""
    others: Mapping[str, None] = {each.second.partition("::")[0]: None for each in state.contacts}
    return sorted(others)
