"""The cart-pole's environments: their manual page, the docstring of `CartPoleEnv`, and how they are made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from cartpole.robot import CART_JOINT, CART_LINK, POLE_JOINT, POLE_LINK, ROBOT
from cartpole.tasks import TASKS, CartPoleTask
from robot_envs.backends.backend import RobotBackend
from robot_envs.environment import RobotEnv
from robot_envs.making import check_options, rendering
from robot_envs.pictures.drawn import Camera, CameraLike
from robot_envs.variation import LinkScale, Variation
from robot_envs.vector import RobotVectorEnv

CAMERA = Camera(target=(0.0, 0.0, 0.19), distance=1.65, yaw=14.0, pitch=-9.0)
MOST_CHANGE = 0.9  # of a mass or length, either way
MOST_CART_FRICTION = 20.0  # [N s/m]; far more would be too stiff for the physics step
MOST_POLE_FRICTION = 0.5  # [N m s/rad]


class CartPoleEnv(RobotEnv):
    """The cart-pole robot, whose cart has a position controller that follows a set-point.

    | id                    | task          | episode ends beyond        | cut off after |
    |-----------------------|---------------|----------------------------|---------------|
    | `cartpole/Balance-v0` | `BalanceTask` | +-0.4 m, +-0.20943951 rad  | 3000 steps    |
    | `cartpole/Classic-v0` | `ClassicTask` | +-0.4 m, +-0.20943951 rad  | 500 steps     |
    | `cartpole/SwingUp-v0` | `SwingUpTask` | +-0.4 m                    | 1250 steps    |

    ## Action space
    Set-points add up over an episode, starting where the cart stands.

    | task              | space              | meaning                                      |
    |-------------------|--------------------|----------------------------------------------|
    | balance, classic  | `Discrete(2)`      | 0: set-point -0.02 m, 1: set-point +0.02 m   |
    | swing-up          | `Box(-1, 1, (1,))` | set-point + 0.02 m times the action          |

    ## Observation space
    `Box`, float32.

    | balance, classic | swing-up | quantity                                      | unit  |
    |------------------|----------|-----------------------------------------------|-------|
    | 0                | 0        | cart position                                 | m     |
    | 1                | 1        | cart velocity                                 | m/s   |
    | 2                |          | pole angle, 0 upright, positive towards -x    | rad   |
    |                  | 2, 3     | sine and cosine of the pole angle             |       |
    | 3                | 4        | pole angular velocity                         | rad/s |

    ## Rewards
    | task     | for each step                                                             |
    |----------|---------------------------------------------------------------------------|
    | balance  | 0.5 + abs(pole angle) - abs(cart position); 10 less when it ends         |
    | classic  | 1                                                                         |
    | swing-up | upright x centred x slow, within 0 and 1: `cartpole.tasks.SwingUpTask`    |

    ## Starting state
    | task     | start            | `noise`, uniform, either way                              |
    |----------|------------------|-----------------------------------------------------------|
    | balance  | upright, at rest | 0 by default; of position [m] and angle [rad]             |
    | classic  | upright          | 0.05 by default; of both positions and both velocities    |
    | swing-up | hanging          | 0.05 by default; of both positions and both velocities    |

    ## Arguments of `gymnasium.make`
    | name             | default    | meaning                                                  |
    |------------------|------------|----------------------------------------------------------|
    | `backend`        | `"bullet"` | in this process, ...                                     |
    |                  | `"mujoco"` | ... on MuJoCo instead of PyBullet (`./ws extras`), ...     |
    |                  | `"ros"`    | ... over ROS in lock-step, bit-identical to `"bullet"`, ... |
    |                  | `"ros-own"` | ... the same in a simulator of its own, ...               |
    |                  | `"ros-realtime"` | ... or over ROS in real time, by Gazebo's own services alone |
    | `control_period` | 0.008      | simulated time of an action [s], whole physics steps;    |
    |                  |            | 0 in real time: the newest joint state, without waiting  |
    | `deadline`       | 5, 30      | wall time for a simulator's answer over ROS in lock-step [s] |
    | `noise`          | the task's | of the starting state                                    |
    | `max_steps`      | the task's | length at which an episode is cut off                    |
    | `sensor_noise`   | 0          | standard deviation; one or four numbers, in the state's units |
    | `sensor_delay`   | 0          | age of an observation [control steps]                    |
    | `encoder_step`, `action_delay`, `actuator_limit`, `actuator_lag` | none | see docs/sim_to_real.md |
    | `randomisation`  | none       | a dict of `mass`, `length`, `cart_friction`, `pole_friction`, see |
    |                  |            | `CartPoleRandomisation`; each episode gets its own robot, |
    |                  |            | which the reset's `info["variation"]` reports;           |
    |                  |            | or of the options in docs/sim_to_real.md                 |
    | `render_mode`    | none       | `"rgb_array"`: pictures, (height, width, 3); `"human"`: a page |
    | `width`, `height` | 640, 320  | of the pictures [pixels]                                  |

    Args:
        task: What is to be learned.
        backend: See above, or a backend, which the environment closes.
        sensor_noise: See above.
        camera: Of pictures, or some of its fields.
        options: The others of the table, as `RobotEnv` has them.

    Raises:
        RobotEnvError: If the robot can't be brought up.
        ValueError: For an option that makes no sense.
    """

    def __init__(
        self,
        task: CartPoleTask,
        backend: str | RobotBackend | None = None,
        *,
        sensor_noise: float | Sequence[float] | np.ndarray | Mapping[str, Any] = 0.0,
        camera: CameraLike = None,
        **options: Any,
    ) -> None:
        noise = _by_joint(sensor_noise)
        if camera is None or isinstance(camera, Mapping):
            camera = CAMERA.changed(camera or {})
        super().__init__(ROBOT, task, backend, sensor_noise=noise, camera=camera, **options)


def _by_joint(noise: float | Sequence[float] | np.ndarray | Mapping[str, Any]) -> Any:
    """Converts noise in the order of `CartPoleState` to noise by joint name."""
    if isinstance(noise, Mapping):
        return noise
    sizes = np.ravel(noise).tolist() * (1 if np.ndim(noise) else 4)
    if len(sizes) != 4:
        raise ValueError(f"sensor noise must be one or 4 numbers >= 0, not {noise}")
    return {CART_JOINT: tuple(sizes[:2]), POLE_JOINT: tuple(sizes[2:])}


class CartPoleVariation(NamedTuple):
    """Factors of the nominal robot's properties, and viscous friction of its joints."""

    cart_mass: float = 1.0
    pole_mass: float = 1.0
    pole_length: float = 1.0  # along z of its link, from the hinge
    cart_friction: float = 0.0  # [N s/m]
    pole_friction: float = 0.0  # [N m s/rad]

    def of_robot(self) -> Variation:
        """Returns the same variation by names of links and joints."""
        return Variation(
            {CART_LINK: LinkScale(self.cart_mass), POLE_LINK: LinkScale(self.pole_mass, self.pole_length)},
            damping={CART_JOINT: self.cart_friction, POLE_JOINT: self.pole_friction},
        )


@dataclass(frozen=True)
class CartPoleRandomisation:
    """The ranges from which a `CartPoleVariation` is drawn for each episode, uniformly; or ValueError."""

    mass: float = 0.0  # half-width of the factor on each mass, e.g. 0.2 for 0.8 to 1.2
    length: float = 0.0  # half-width of the factor on the pole's length
    cart_friction: float = 0.0  # largest viscous friction between cart and rail [N s/m]
    pole_friction: float = 0.0  # largest viscous friction in the hinge [N m s/rad]

    def __post_init__(self) -> None:
        for name, most in (
            ("mass", MOST_CHANGE),
            ("length", MOST_CHANGE),
            ("cart_friction", MOST_CART_FRICTION),
            ("pole_friction", MOST_POLE_FRICTION),
        ):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ValueError(f"randomisation of {name} must lie in [0, {most}], not {value}")

    def draw(self, rng: np.random.Generator) -> tuple[Variation, np.ndarray]:
        """Draws one robot by five numbers; returns it also as a `CartPoleVariation` in an array, (5,)."""
        cart, pole, length, rail, hinge = (float(value) for value in rng.random(5))
        drawn = CartPoleVariation(
            1.0 + self.mass * (2.0 * cart - 1.0),
            1.0 + self.mass * (2.0 * pole - 1.0),
            1.0 + self.length * (2.0 * length - 1.0),
            self.cart_friction * rail,
            self.pole_friction * hinge,
        )
        return drawn.of_robot(), np.array(drawn)


@rendering
def make_environment(
    task: str,
    backend: str | None = None,
    *,
    noise: float | None = None,
    randomisation: Mapping[str, Any] | None = None,
    **options: Any,
) -> CartPoleEnv:
    """Makes an environment for Gymnasium; `CartPoleEnv` explains the options and errors."""
    check_options(options, ("noise",))
    varied: CartPoleRandomisation | Mapping[str, Any] | None = randomisation
    own = {each.name for each in fields(CartPoleRandomisation)}
    if randomisation and set(randomisation) <= own:
        varied = CartPoleRandomisation(**randomisation)
    return CartPoleEnv(make_task(task, noise), backend, randomisation=varied, **options)


def make_vector(num_envs: int, **options: Any) -> RobotVectorEnv:
    """Makes a vector of environments for Gymnasium; see `RobotVectorEnv`."""
    return RobotVectorEnv(num_envs, make_environment, **options)


def make_task(name: str, noise: float | None = None) -> CartPoleTask:
    """Makes a task; None stands for its default noise. Raises ValueError for another name or noise."""
    if name not in TASKS:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}")
    return TASKS[name]() if noise is None else TASKS[name](noise=noise)  # type: ignore[call-arg]
