"""The cart-pole's environments and their manual page, the docstring of `CartPoleEnv`."""

from cartpole.robot import CONTROL_PERIOD, ROBOT
from cartpole.tasks import BalanceTask, CartPoleState, CartPoleTask
from cartpole.variation import Randomisation
from robot_envs.backends.backend import RobotBackend
from robot_envs.environment import RobotEnv, Viewer
from robot_envs.picture import HEIGHT, WIDTH, Camera
from robot_envs.sensing import Sensor

CAMERA = Camera(target=(0.0, 0.0, 0.19), distance=1.65, yaw=14.0, pitch=-9.0)
WINDOW_CAMERA = (1.3, 0.0, -5.0, (0.0, 0.0, 0.2))  # [m], yaw and pitch [degrees], looks at [m]


class CartPoleEnv(RobotEnv[CartPoleState]):
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
    |                  | `"ros"`    | ... over ROS in lock-step, with the same bits, ...       |
    |                  | `"ros-realtime"` | ... or over ROS in real time, by Gazebo's own services alone |
    | `engine`         | `"bullet"` | physics in this process: PyBullet, or `"mujoco"` (`./ws extras`); |
    |                  |            | over ROS it is the simulator's (`physics:=`)              |
    | `control_period` | 0.008      | simulated time of an action [s], whole physics steps;    |
    |                  |            | None in real time: the newest joint state, without waiting |
    | `noise`          | the task's | of the starting state                                    |
    | `max_steps`      | the task's | length at which an episode is cut off                    |
    | `sensor_noise`   | 0          | standard deviation; one or four numbers, in the state's units |
    | `sensor_delay`   | 0          | age of an observation [control steps]                    |
    | `randomisation`  | none       | a dict of `mass`, `length`, `cart_friction`, `pole_friction`, see |
    |                  |            | `cartpole.variation.Randomisation`; each episode gets its own |
    |                  |            | robot, which stands in the reset's `info["variation"]`   |
    | `render_mode`    | none       | `"rgb_array"`: pictures, (height, width, 3); `"human"`: a window |
    | `width`, `height` | 640, 320  | of the pictures [pixels]                                  |

    Args:
        backend: moves the robot (see `robot_envs.backends`); the environment closes it.
        task: what is to be learned; `BalanceTask()` by default.
        sensor: how the state is measured; exactly and at once by default.
        randomisation: what differs from episode to episode; nothing by default.
        render_mode: see above.
        width: of pictures [pixels].
        height: of pictures [pixels].
        control_period: the backend's [s]; tells how fast pictures follow each other.

    Raises:
        RobotEnvError: for a window where there is no display.
        ValueError: for a render mode that doesn't exist, or pictures of no possible size.
    """

    def __init__(
        self,
        backend: RobotBackend[CartPoleState],
        task: CartPoleTask | None = None,
        *,
        sensor: Sensor[CartPoleState] | None = None,
        randomisation: Randomisation | None = None,
        render_mode: str | None = None,
        width: int = WIDTH,
        height: int = HEIGHT,
        control_period: float = CONTROL_PERIOD,
    ) -> None:
        super().__init__(
            backend,
            task or BalanceTask(),
            control_period=control_period,
            sensor=sensor,
            randomisation=randomisation,
            camera=CAMERA,
            width=width,
            height=height,
            window=_open_window,
            render_mode=render_mode,
        )


def _open_window(period: float) -> Viewer[CartPoleState]:
    from robot_envs.window import Window  # loads PyBullet, which nothing over ROS needs

    return Window(ROBOT, period, WINDOW_CAMERA)
