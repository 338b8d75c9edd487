"""A cart-pole without physics: a backend for unit tests of environments."""

from cartpole.robot import CART_JOINT, CONTROLLER, POLE_JOINT, ROBOT
from cartpole.tasks import CartPoleState
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, JointState, StateQuery, WorldState
from robot_sim.physics.pose import Pose

DT = 0.008  # [s]


def cartpole_world(state: CartPoleState, set_point: float | None = None) -> WorldState:
    """A world with a cart-pole in that state, whose cart is held where it stands unless told otherwise."""
    x, v, angle, rate = state
    joints = {CART_JOINT: JointState(x, v, 0.0), POLE_JOINT: JointState(angle, rate, 0.0)}
    return WorldState(0.0, joints, {CONTROLLER: x if set_point is None else set_point})


class FakePlant:
    """A pole on a cart that follows its set-point with a lag; after so many actions the simulator "dies"."""

    scene, deterministic, complete, shared = Scene([ROBOT]), True, True, False

    def __init__(self, fail_after: int | None = None) -> None:
        self.closed = 0
        self.actions = 0
        self.variations: list[Variation] = []
        self._fail_after = fail_after
        self._state = CartPoleState(0.0, 0.0, 0.0, 0.0)

    def look(self, query: StateQuery) -> None:
        assert query == StateQuery()

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        places = self.scene.placed_joints(initial)
        self._state = CartPoleState(places[CART_JOINT][0], 0.0, places[POLE_JOINT][0], 0.0)
        return cartpole_world(self._state)

    def act(self, commands: Commands) -> WorldState:
        set_point = commands[CONTROLLER]
        self.actions += 1
        if self._fail_after is not None and self.actions > self._fail_after:
            raise SimulatorError("the connection broke; the simulator has ended")
        x, v, angle, rate = self._state
        acceleration = 100.0 * (set_point - x) - 14.0 * v
        v += acceleration * DT
        x += v * DT
        rate += (30.0 * angle + 3.0 * acceleration) * DT  # leans towards -x
        angle += rate * DT
        self._state = CartPoleState(x, v, angle, rate)
        return cartpole_world(self._state, set_point)

    def base(self) -> Pose:
        return Pose()

    def vary(self, variation: Variation) -> None:
        self.variations.append(variation)

    def close(self) -> None:
        self.closed += 1
