"""The hopper: one leg with a foot, which hops forward without falling over."""

import math
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from robot_envs.files import own_file
from robot_envs.robot import Robot
from robot_envs.robots import spaces
from robot_envs.task import Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

LEG = ("hip", "knee", "ankle")
STANCE = (-0.45, 0.9, -0.45)  # [rad] of the leg's joints: bent, the foot flat below the hip
SWING = (0.6, 0.7, 0.5)  # [rad] that an action asks for beside it, either way
LOW = 0.16  # [m] that the hip may sink below that of a stretched leg
LEAN = 0.6  # [rad] of the torso

HOPPER = Robot(
    urdf=partial(own_file, "cartpole", "urdf/hopper.urdf.xacro"),
    controllers=partial(own_file, "cartpole", "config/robots/hopper.yaml"),
    run=("joint_state_controller", "leg_controller"),
    commanded=("leg_controller",),
    name="hopper",
    control_period=0.02,
)


class HopForward(Task):
    """The hopper goes forward as fast as it can, and doesn't fall.

    | | |
    |---|---|
    | actions | Box(-1, 1, (3,)): angles asked of hip, knee and ankle, beside a bent stance, in units of 0.6, 0.7 and 0.5 rad |
    | observations | Box(12): height of the hip below that of a stretched leg [0.1 m], its speeds forward and up [m/s]; the torso's pitch [0.3 rad] and its speed [3 rad/s]; angles of hip, knee, ankle beside the stance [0.5 rad] and their speeds [10 rad/s]; 1 if the foot touches the ground |
    | reward | 0.5 for each step, and the speed forward [m/s], at most 2; less 0.02 \\|action\\|² |
    | start | in the stance, all joints within 0.02 rad, the foot just above the ground |
    | end | terminated when it falls: the hip 0.25 m below that of a stretched leg, or the torso 0.6 rad from the vertical; truncated after 250 steps (5 s) |
    | info | `x`: how far it has come [m] |
    """

    max_steps = 250
    query = StateQuery(contacts_of=("foot",))

    def action_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.actions(3)

    def observation_space(self) -> gymnasium.spaces.Box:
        """See the class."""
        return spaces.numbers(12)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        """The stance, a little off it."""
        off = rng.uniform(-0.02, 0.02, 4).tolist()
        leg = {name: each + move for name, each, move in zip(LEG, STANCE, off, strict=False)}
        bent = 0.3 * (2.0 - math.cos(leg["hip"]) - math.cos(leg["hip"] + leg["knee"]))
        commands = {"leg_controller": STANCE}
        return InitialState(joints={**leg, "pitch": off[3], "up": 0.01 - bent}, commands=commands)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        """Angles of the leg."""
        moves = action.tolist()
        return {
            "leg_controller": tuple(
                stance + swing * move
                for stance, swing, move in zip(STANCE, SWING, moves, strict=True)
            )
        }

    def observe(self, state: WorldState) -> np.ndarray:
        """See the class."""
        each = state.joints
        up, pitch = each["up"], each["pitch"]
        seen = [
            (up.position + 0.06) / 0.1,
            each["forward"].velocity,
            up.velocity,
            pitch.position / 0.3,
            pitch.velocity / 3.0,
            *(
                (each[name].position - stance) / 0.5
                for name, stance in zip(LEG, STANCE, strict=True)
            ),
            *(each[name].velocity / 10.0 for name in LEG),
            1.0 if state.contacts else 0.0,
        ]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        """See the class."""
        speed = min(state.joints["forward"].velocity, 2.0)
        return 0.5 + speed - 0.02 * float(np.square(action).sum())

    def is_terminal(self, state: WorldState) -> bool:
        """Whether it has fallen."""
        joints = state.joints
        return joints["up"].position < -0.25 or abs(joints["pitch"].position) > LEAN

    def info(self, state: WorldState) -> dict[str, Any]:
        """See the class."""
        return {"x": state.joints["forward"].position}
