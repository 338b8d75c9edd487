"""The cart-pole's environments and their manual page, the docstring of `CartPoleEnv`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cartpole.robot import CART_JOINT, POLE_JOINT, ROBOT
from cartpole.tasks import CartPoleTask
from robot_envs.backends.backend import RobotBackend
from robot_envs.environment import RobotEnv
from robot_envs.pictures.drawn import Viewer
from robot_envs.pictures.picture import Camera

CAMERA = Camera(target=(0.0, 0.0, 0.19), distance=1.65, yaw=14.0, pitch=-9.0)
WINDOW_CAMERA = (1.3, 0.0, -5.0, (0.0, 0.0, 0.2))  # [m], yaw and pitch [degrees], looks at [m]


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
    | `backend`        | `"bullet"` | the robot: in this process, ...                          |
    |                  | `"mujoco"` | ... on MuJoCo instead of PyBullet (`./ws extras`), ...     |
    |                  | `"ros"`    | ... over ROS in lock-step, with the bits of `"bullet"`, ... |
    |                  | `"ros-own"` | ... the same in a simulator of its own, ...               |
    |                  | `"ros-realtime"` | ... or over ROS in real time, by Gazebo's own services alone |
    | `control_period` | 0.008      | simulated time of an action [s], whole physics steps;    |
    |                  |            | 0 in real time: the newest joint state, without waiting  |
    | `deadline`       | 5, 30      | wall time of a simulator's answer over ROS in lock-step [s] |
    | `noise`          | the task's | of the starting state                                    |
    | `max_steps`      | the task's | length at which an episode is cut off                    |
    | `sensor_noise`   | 0          | standard deviation; one or four numbers, in the state's units |
    | `sensor_delay`   | 0          | age of an observation [control steps]                    |
    | `encoder_step`, `action_delay`, `actuator_limit`, `actuator_lag` | none | see docs/sim_to_real.md |
    | `randomisation`  | none       | a dict of `mass`, `length`, `cart_friction`, `pole_friction`, see |
    |                  |            | `cartpole.variation.Randomisation`; each episode gets its own |
    |                  |            | robot, which stands in the reset's `info["variation"]`;  |
    |                  |            | or of the options in docs/sim_to_real.md                 |
    | `render_mode`    | none       | `"rgb_array"`: pictures, (height, width, 3); `"human"`: a window |
    | `width`, `height` | 640, 320  | of the pictures [pixels]                                  |

    Args:
        task: what is to be learned.
        backend: see above, or one that is made already; the environment closes it.
        sensor_noise: see above.
        options: the others of the table, as `RobotEnv` has them.

    Raises:
        RobotEnvError: if the robot can't be brought up; for a window where there is no display.
        ValueError: for an option that makes no sense.
    """

    def __init__(
        self,
        task: CartPoleTask,
        backend: str | RobotBackend | None = None,
        *,
        sensor_noise: float | Sequence[float] | np.ndarray | Mapping[str, Any] = 0.0,
        **options: Any,
    ) -> None:
        super().__init__(
            ROBOT,
            task,
            backend,
            sensor_noise=_by_joint(sensor_noise),
            camera=CAMERA,
            window=_open_window,
            **options,
        )


def _by_joint(noise: float | Sequence[float] | np.ndarray | Mapping[str, Any]) -> Any:
    """Noise as `CartPoleState` has its numbers, by the name of the joint."""
    if isinstance(noise, Mapping):
        return noise
    sizes = np.ravel(noise).tolist() * (1 if np.ndim(noise) else 4)
    if len(sizes) != 4:
        raise ValueError(f"sensor noise must be one or 4 numbers >= 0, not {noise}")
    return {CART_JOINT: tuple(sizes[:2]), POLE_JOINT: tuple(sizes[2:])}


def _open_window(period: float) -> Viewer:
    from robot_envs.pictures.window import Window  # loads PyBullet, which nothing over ROS needs

    return Window(ROBOT, period, WINDOW_CAMERA)
