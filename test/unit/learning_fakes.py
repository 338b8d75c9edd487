"""Small plants to learn on in unit tests: deterministic, and quick."""

from cartpole.envs.variation import Variation
from cartpole.errors import SimulatorError
from cartpole.task import CartPoleState

DT = 0.008  # [s]


class FakePlant:
    """A pole on a cart that follows its set-point with a lag; semi-implicit Euler.

    Args:
        fail_after: number of actions after which the simulator "dies"; None: never.
    """

    deterministic = True

    def __init__(self, fail_after: int | None = None) -> None:
        self.closed = 0
        self.actions = 0
        self.variations: list[Variation] = []
        self._fail_after = fail_after
        self._state = CartPoleState(0.0, 0.0, 0.0, 0.0)

    def reset(self, state: CartPoleState) -> CartPoleState:
        self._state = state._replace(cart_velocity=0.0, pole_velocity=0.0)
        return self._state

    def act(self, set_point: float) -> CartPoleState:
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
        return self._state

    def vary(self, variation: Variation) -> None:
        self.variations.append(variation)

    def close(self) -> None:
        self.closed += 1
