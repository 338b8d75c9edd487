"""The hopper: one leg with a foot, which hops forward without falling over."""

import math
from typing import Any

import gymnasium
import numpy as np

from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import Task
from robot_envs.world_state import InitialState, StateQuery, WorldState

LEG = ("hip", "knee", "ankle")
STANCE = (-0.45, 0.9, -0.45)  # [rad] of the leg's joints: bent, the foot flat below the hip
SWING = (0.6, 0.7, 0.5)  # [rad] that an action asks for around it, either way
LOW = -0.25  # [m] of the hip, below that of a stretched leg: it counts as fallen
LEAN = 0.6  # [rad] of the torso, the same

ROBOT = own_robot("hopper", "leg_controller", control_period=0.02)


class HopForward(Task):
    """Hop forward as fast as possible without falling.

    ## Action space
    `Box(-1, 1, (3,))`: set-points of hip, knee and ankle, relative to a bent stance [0.6, 0.7, 0.5 rad].
    Position controllers follow them with torques.

    ## Observation space
    `Box((12,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0 | height of the hip over that of the stance | 0.1 m |
    | 1, 2 | its speed forward and up | m/s |
    | 3, 4 | the torso's pitch and its speed | 0.3 rad, 3 rad/s |
    | 5 to 7 | angles of hip, knee, ankle relative to the stance | 0.5 rad |
    | 8 to 10 | their speeds | 10 rad/s |
    | 11 | 1 if the foot touches something, else 0 | 1 |

    ## Rewards
    0.5 + v - 0.02 |action|² for each step, with the speed forward v [m/s], of which at most 2 count.

    ## Start of an episode
    In the stance at rest, leg and torso within 0.02 rad of it, the foot about 1 cm above the ground.

    ## End of an episode
    Terminated when it falls: the hip is 0.25 m below that of a stretched leg, or the torso 0.6 rad from the
    vertical. Truncated after 250 steps of 0.02 s.

    ## Info
    `x`: the distance covered [m].
    """

    max_steps = 250
    query = StateQuery(contacts_of=("foot",))

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(3)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(12)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        off = rng.uniform(-0.02, 0.02, 4).tolist()
        leg = {name: each + move for name, each, move in zip(LEG, STANCE, off, strict=False)}
        bent = 0.3 * (2.0 - math.cos(leg["hip"]) - math.cos(leg["hip"] + leg["knee"]))
        commands = {"leg_controller": STANCE}
        return InitialState(joints={**leg, "pitch": off[3], "up": 0.01 - bent}, commands=commands)

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, tuple[float, ...]]:
        moves = zip(STANCE, SWING, action.tolist(), strict=True)
        return {"leg_controller": tuple(stance + swing * move for stance, swing, move in moves)}

    def observe(self, state: WorldState) -> np.ndarray:
        each = state.joints
        up, pitch = each["up"], each["pitch"]
        seen = [
            (up.position + 0.06) / 0.1,
            each["forward"].velocity,
            up.velocity,
            pitch.position / 0.3,
            pitch.velocity / 3.0,
            *((each[name].position - stance) / 0.5 for name, stance in zip(LEG, STANCE, strict=True)),
            *(each[name].velocity / 10.0 for name in LEG),
            1.0 if state.contacts else 0.0,
        ]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        speed = min(state.joints["forward"].velocity, 2.0)
        return 0.5 + speed - 0.02 * float(np.square(action).sum())

    def is_terminal(self, state: WorldState) -> bool:
        """Returns whether it has fallen."""
        joints = state.joints
        return joints["up"].position < LOW or abs(joints["pitch"].position) > LEAN

    def info(self, state: WorldState) -> dict[str, Any]:
        return {"x": state.joints["forward"].position}
