"""A rover with two driven wheels and a castor on a ground plane."""

import numpy as np
from gymnasium.spaces import Box
from support.scenes.parts import joint, link, plugin, transmission

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

WHEEL = '<cylinder radius="0.1" length="0.04"/>'
PARTS = [
    link("hull", '<box size="0.4 0.2 0.08"/>', 3.0),
    link("left_wheel", WHEEL, 0.3, turned="1.5708 0 0"),
    link("right_wheel", WHEEL, 0.3, turned="1.5708 0 0"),
    link("castor", '<sphere radius="0.05"/>', 0.2),
    joint("left_axle", "continuous", "hull", "left_wheel", "0.1 0.13 0"),
    joint("right_axle", "continuous", "hull", "right_wheel", "0.1 -0.13 0"),
    joint("pivot", "continuous", "hull", "castor", "-0.15 0 -0.05"),
    transmission("left_axle", "Velocity"),
    transmission("right_axle", "Velocity"),
    plugin(),
]
ROVER = Robot(
    urdf=f'<robot name="rover">{"".join(PARTS)}</robot>',
    controllers={"wheels": {"type": "velocity_controllers/JointGroupVelocityController",
                            "joints": ["right_axle", "left_axle"]}},
    run=("wheels",),
    pose=Pose((0.0, 0.0, 0.1)),
    control_period=0.02,
)  # fmt: skip
CRATE = """<robot name="crate"><link name="crate">
  <inertial><mass value="0.5"/>
    <inertia ixx="0.003" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.003"/></inertial>
  <visual><geometry><box size="0.2 0.2 0.2"/></geometry>
    <material name="yellow"><color rgba="1 0.8 0 1"/></material></visual>
  <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <gazebo reference="crate"><mu1>0.5</mu1></gazebo></robot>"""


class Wheels(Task):
    """The action is how fast the wheels turn."""

    max_steps = 50

    def action_space(self) -> Box:
        return Box(-1.0, 1.0, (2,), np.float32)

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        right, left = (10.0 * action).tolist()
        return {"wheels": (right, left)}


class Roll(Wheels):
    """Roll forward: the reward sees the hull, the policy the wheels alone."""

    reward_query = StateQuery(models=("rover",), links=(LinkQuery("hull"),), all_contacts=True)

    def observation_space(self) -> Box:
        return Box(-np.inf, np.inf, (2,), np.float64)

    def observe(self, state: WorldState) -> np.ndarray:
        return np.array([state.joints[name].velocity for name in ("right_axle", "left_axle")])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return state.links["hull"].twist.linear[0]

    def is_terminal(self, state: WorldState) -> bool:
        return state.models["rover"].pose.position[2] < 0.05

    def info(self, state: WorldState) -> dict[str, float]:
        return {"contacts": float(len(state.contacts))}


class Push(Wheels):
    """The rover, put somewhere else in each episode, pushes a crate forward; none of its joints is named."""

    objects = (Object("crate", CRATE, Pose((3.0, 0.0, 0.1))),)
    query = StateQuery(
        all_models=True, links=(LinkQuery("crate::crate", "hull"),), contacts_of=("rover::hull",)
    )

    def observation_space(self) -> Box:
        return Box(-np.inf, np.inf, (10,), np.float64)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        x, y = rng.uniform(-0.2, 0.2, 2)
        return InitialState(
            models={
                "rover": Motion(Pose((x, y, 0.1)), ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))),
                "crate": Pose((x + 0.4, y, 0.1)),
            }
        )

    def observe(self, state: WorldState) -> np.ndarray:
        crate = state.links["crate::crate"].pose
        here = state.models["rover"]
        return np.array([*crate.position, *here.pose.position, *here.twist[0], len(state.contacts)])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return state.models["crate"].pose.position[0]
