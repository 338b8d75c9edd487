"""Robots that show each sim-to-real option alone: a rig of slides and a servo, and a sledge."""

from typing import Any

import gymnasium
import numpy as np

from robot_envs import InitialState, Motion, Pose, Robot, RobotEnv, StateQuery, Task, WorldState

MASS, HEIGHT, PERIOD = 2.0, 0.05, 0.01  # [kg], [m], [s]
INERTIA = 0.5  # [kg m²] of the servo's wheel
STANDING = Pose((3.0, 0.0, HEIGHT - 0.2))  # of the sledge on the ground


def _link(name: str, mass: float, inertia: float, more: str = "") -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 0.2"/><mass value="{mass}"/><inertia '
        f'ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial>{more}</link>'
    )


def _joint(name: str, kind: str, child: str, axis: str, parent: str = "world") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 5"/><axis xyz="{axis}"/>'
        '<limit lower="-100" upper="100" effort="1000" velocity="1000"/></joint>'
        f'<transmission name="{name}_transmission"><type>transmission_interface/SimpleTransmission</type>'
        f'<joint name="{name}"><hardwareInterface>hardware_interface/EffortJointInterface'
        f'</hardwareInterface></joint><actuator name="{name}_motor"/></transmission>'
    )


PLUGIN = (
    '<gazebo><plugin name="gazebo_ros_control" filename="libgazebo_ros_control.so">'
    "<robotNamespace>{}</robotNamespace></plugin></gazebo>"
)
RIG = Robot(
    urdf="".join(
        [
            '<robot name="rig"><link name="world"/>',
            _link("cart", MASS, 0.1), _joint("rail", "prismatic", "cart", "1 0 0"),
            _link("weight", MASS, 0.1), _joint("drop", "prismatic", "weight", "0 0 1"),
            _link("wheel", 1.0, INERTIA), _joint("servo", "continuous", "wheel", "0 0 1"),
            PLUGIN.format("/rig"), "</robot>",
        ]
    ),
    controllers={
        "motors": {"type": "effort_controllers/JointGroupEffortController", "joints": ["rail", "drop"]},
        "servo_position": {
            "type": "effort_controllers/JointPositionController",
            "joint": "servo",
            "pid": {"p": 20.1, "i": 0.5, "d": 2.3, "i_clamp": 1.0},
        },
        "joint_state_controller": {
            "type": "joint_state_controller/JointStateController", "publish_rate": 100,
        },
    },
    run=("motors", "servo_position"),
    namespace="rig",
    control_period=PERIOD,
)  # fmt: skip
SLEDGE = Robot(
    urdf="".join(
        [
            '<robot name="sledge">',
            _link("body", 1.0, 0.02, '<collision><origin xyz="0 0 0.2"/><geometry>'
                  '<box size="0.4 0.4 0.1"/></geometry></collision>'),
            _link("mast", 0.01, 1e-4), _joint("turn", "continuous", "mast", "0 0 1", "body"),
            '<gazebo reference="body"><mu1>0.2</mu1></gazebo>',
            PLUGIN.format("/sledge"), "</robot>",
        ]
    ),
    controllers={
        "mast_effort": {"type": "effort_controllers/JointEffortController", "joint": "turn"},
        "joint_state_controller": {
            "type": "joint_state_controller/JointStateController", "publish_rate": 100,
        },
    },
    run=("mast_effort",),
    namespace="sledge",
    pose=STANDING,
)  # fmt: skip


class Watch(Task):
    """Actions are the efforts on rail and drop, and the servo's set-point; every joint is seen.

    The rig's joints begin at `joints`, or at 0; a `sledge` beside it begins at 1 m/s.
    """

    max_steps = 200

    def __init__(self, sledge: bool = False, joints: dict[str, Any] | None = None) -> None:
        self._of = "rig::" if sledge else ""
        self._to = "/rig/" if sledge else ""
        self._sledge = sledge
        self._start = {f"{self._of}{name}": at for name, at in (joints or {}).items()}
        self.query = StateQuery(models=("sledge",)) if sledge else StateQuery()

    def action_space(self) -> gymnasium.Space[Any]:
        return gymnasium.spaces.Box(-1000.0, 1000.0, (3,), np.float64)

    def observation_space(self) -> gymnasium.Space[Any]:
        return gymnasium.spaces.Box(-np.inf, np.inf, (11,) if self._sledge else (6,), np.float64)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        moving = Motion(STANDING, ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        return InitialState(self._start, {"sledge": moving} if self._sledge else {})

    def apply(self, action: Any, state: WorldState) -> dict[str, Any]:
        rail, drop, servo = action.tolist()
        return {f"{self._to}motors": (rail, drop), f"{self._to}servo_position": servo}

    def observe(self, state: WorldState) -> np.ndarray:
        seen = [number for joint in state.joints.values() for number in joint[:2]]
        for motion in state.models.values():
            seen += [motion.pose.position[0], motion.twist[0][0], motion.pose.position[2]]
        return np.array(seen)

    def reward(self, state: WorldState, action: Any) -> float:
        return 0.0


def make_rig(backend: str = "bullet", joints: dict[str, Any] | None = None, **options: Any) -> RobotEnv:
    """The rig alone."""
    return RobotEnv(RIG, Watch(joints=joints), backend, **options)


def make_both(backend: str = "bullet", **options: Any) -> RobotEnv:
    """The rig with the sledge beside it."""
    return RobotEnv([RIG, SLEDGE], Watch(sledge=True), backend, **options)
