"""Runs of the cart-pole that compare physics engines with its equations of motion."""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from support.robots.cartpole import GRAVITY, CartPole, cartpole_urdf
from support.robots.worlds import add_robot, start

from robot_sim.physics.engine import Engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator

PLANT = CartPole()
SAMPLE = 0.02  # [s] between the samples of a trajectory
P, D = 100.0, 10.0  # of the position controller
EFFORT, SPEED, RAIL = 30.0, 7.0, 0.5  # limits of the cart [N], [m/s], [m]
CART = {"type": "effort_controllers/JointPositionController", "joint": "stand_cart",
        "pid": {"p": P, "i": 0.0, "d": D}}  # fmt: skip
FALL = (0.0, 0.0, 0.1, 0.0)  # x [m], x' [m/s], angle [rad], rate [rad/s]
SWING = (-0.1, 0.0, math.pi - 0.3, 0.0)
PUSH = 0.2  # [N]
SET_POINT = 0.05  # [m]


def runge_kutta() -> Engine:
    """MuJoCo that integrates by RK4, for comparisons; its motors have no speed."""
    import mujoco

    from robot_sim.physics.engines.mujoco_engine import MujocoEngine

    class Exact(MujocoEngine):
        def step(self) -> None:
            model, data = self._state.model, self._state.data
            model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
            mujoco.mj_step(model, data)
            data.qfrc_applied[:] = 0.0
            self._state.stale = True

    return Exact()


def rate() -> float:
    """Growth rate of the upright pole [1/s]; of the hanging pole it is the angular frequency [rad/s]."""
    mass, ml = PLANT.cart + PLANT.pole, PLANT.pole * PLANT.length
    return math.sqrt(mass * GRAVITY * ml / (mass * (PLANT.inertia + ml * PLANT.length) - ml**2))


class Run:
    """A cart-pole alone in a world, in the state (x, x', angle, rate)."""

    def __init__(self, engine: Engine, step: float, state: tuple = FALL) -> None:
        self.step = step
        self.world = World(engine, time_step=step)
        self.model = self.world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
        self.model.body.reset_joint(0, state[0], state[1])
        self.model.body.reset_joint(1, state[2], state[3])

    def state(self) -> list[float]:
        return [value for joint in self.model.body.joint_states() for value in joint[:2]]

    def tick(self, force: float = 0.0) -> None:
        if force:
            self.model.body.apply_efforts((force, 0.0))
        self.world.step()

    def track(self, seconds: float, force: float = 0.0) -> np.ndarray:
        """States (n, 4) every SAMPLE under a constant force on the cart; closes the world."""
        states = []
        for _ in range(round(seconds / SAMPLE)):
            for _ in range(round(SAMPLE / self.step)):
                self.tick(force)
            states.append(self.state())
        self.world.close()
        return np.array(states)


def truth(state: tuple, seconds: float, force: float = 0.0) -> np.ndarray:
    """What the equations of motion give for Run.track."""
    times = SAMPLE * np.arange(1, round(seconds / SAMPLE) + 1)
    return solve_ivp(
        lambda _, y: PLANT.derivative(y, force), (0.0, times[-1]), state, t_eval=times,
        method="DOP853", rtol=1e-12, atol=1e-13,
    ).y.T  # fmt: skip


def fall_error(new_engine: Callable[[], Engine], step: float) -> float:
    """Largest error of the angle [rad] in the first second of a fall from 0.1 rad."""
    return _worst(Run(new_engine(), step).track(1.0), truth(FALL, 1.0), 2)


def push_error(new_engine: Callable[[], Engine], step: float) -> float:
    """Largest error of the cart's position [m] in 1 s of a push, the pole swinging below."""
    run = Run(new_engine(), step, SWING)
    return _worst(run.track(1.0, PUSH), truth(SWING, 1.0, PUSH), 0)


def _worst(found: np.ndarray, true: np.ndarray, column: int) -> float:
    return float(np.abs(found - true)[:, column].max())


def loop_error(new_engine: Callable[[], Engine], step: float) -> float:
    """Largest error of the cart's position [m] in 0.5 s under its position controller."""
    sim = Simulator(World(new_engine(), time_step=step), lockstep=True)
    manager, model = control(sim)
    manager.get("cart").command(SET_POINT)
    state, last, worst = np.zeros(4), 0.0, 0.0
    for _ in range(round(0.5 / step)):
        error = SET_POINT - state[0]
        state = _held(state, _limited(P * error + D * (error - last) / step, state), step)
        last = error
        with sim.lock:
            sim.advance(1)
        worst = max(worst, abs(model.joint_state("stand_cart")[0] - state[0]))
    sim.world.close()
    return float(worst)


def control(sim: Simulator) -> tuple:
    """Puts a cart-pole with a running position controller into `sim`; its manager and its model."""
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    start(robot, {"cart": CART})
    return robot.manager, robot.model


def _held(state: np.ndarray, force: float, step: float) -> np.ndarray:
    """The equations of motion over one step, the force held."""
    return solve_ivp(lambda _, y: PLANT.derivative(y, force), (0.0, step), state, rtol=1e-9, atol=1e-12).y[
        :, -1
    ]


def _limited(force: float, state: np.ndarray) -> float:
    """Effort saturation of a joint (docs/contract/ros_control.md 5)."""
    most = 0.0 if state[0] > RAIL or state[1] > SPEED else EFFORT
    least = 0.0 if state[0] < -RAIL or state[1] < -SPEED else -EFFORT
    return min(most, max(least, force))


def growth_rate(new_engine: Callable[[], Engine], step: float) -> float:
    """Growth rate [1/s] of a pole that starts to fall along the unstable mode."""
    mode = np.linalg.eig(linear())
    fastest = int(np.argmax(mode.eigenvalues.real))
    start = mode.eigenvectors[:, fastest].real
    start = 1e-6 * start / start[2]
    run = Run(new_engine(), step, tuple(start))
    for _ in range(round(1.0 / step)):
        run.tick()
    angle = run.state()[2]
    run.world.close()
    return math.log(angle / start[2])


def linear() -> np.ndarray:
    """The equations of motion about the upright pole, linear (4, 4)."""
    small = 1e-6
    return np.array([PLANT.derivative(small * axis) / small for axis in np.eye(4)]).T


def hanging_period(new_engine: Callable[[], Engine], step: float, count: int = 10) -> float:
    """Mean of `count` periods [s] of a pole that swings by 0.001 rad below the cart."""
    run = Run(new_engine(), step, (0.0, 0.0, math.pi + 1e-3, 0.0))
    crossings, ticks, last = [], 0, 1e-3
    while len(crossings) < count + 1:
        run.tick()
        ticks += 1
        angle = run.state()[2] - math.pi
        if last < 0.0 <= angle:
            crossings.append(step * (ticks - angle / (angle - last)))
        last = angle
    run.world.close()
    return (crossings[-1] - crossings[0]) / count


def energy(state: list[float]) -> float:
    """Energy of cart and pole [J]."""
    _, speed, angle, turn = state
    across = speed - PLANT.length * math.cos(angle) * turn
    up = -PLANT.length * math.sin(angle) * turn
    kinetic = PLANT.cart * speed**2 + PLANT.pole * (across**2 + up**2) + PLANT.inertia * turn**2
    return kinetic / 2 + PLANT.pole * GRAVITY * PLANT.length * math.cos(angle)


def energy_error(new_engine: Callable[[], Engine], step: float, seconds: float) -> tuple[float, float]:
    """Of a free swing of cart and pole, from 2 rad: largest change of the energy, and the drift of its
    mean from the first to the last second; both as parts of m g l."""
    run = Run(new_engine(), step, (0.0, 0.0, math.pi - 2.0, 0.0))
    start, scale = energy(run.state()), PLANT.pole * GRAVITY * PLANT.length
    changes = []
    for _ in range(round(seconds / step)):
        run.tick()
        changes.append((energy(run.state()) - start) / scale)
    run.world.close()
    second = round(1.0 / step)
    drift = np.mean(changes[-second:]) - np.mean(changes[:second])
    return float(np.abs(changes).max()), float(drift)
