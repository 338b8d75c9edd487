"""The cart-pole's description: a cart that is moved along a rail, and a pole that swings on it."""

import contextlib
import importlib.util
from pathlib import Path

from cartpole.tasks import TASKS, CartPoleState
from robot_envs.errors import RobotEnvError
from robot_envs.robot import OverRos, Robot

CONTROL_PERIOD = 0.008  # [s] of simulated time for each action
CART_LINK, POLE_LINK = "cart", "pole"
CART_JOINT, POLE_JOINT = "stand_cart", "cart_pole"
CONTROLLER = "stand_cart_position_controller"
TREE = Path(__file__).resolve().parents[2]  # the source tree
SHARE = Path(__file__).resolve().parent / "share"  # in a wheel (setup.py)


def find_file(package: str, place: str) -> Path:
    """A file of one of the robot's ROS packages, found without a running ROS.

    It lies in the source tree around this module; in a wheel beside this module; in a catkin workspace
    that it was installed in, where rospkg finds the package.

    Args:
        package: the package's name.
        place: the file's path in it.

    Raises:
        RobotEnvError: if it is in none of them.
    """
    source = TREE if package == "cartpole" else TREE / "companions" / package
    for folder in (source, SHARE / package):
        if (folder / place).is_file():
            return folder / place
    if importlib.util.find_spec("rospkg"):
        import rospkg

        with contextlib.suppress(rospkg.ResourceNotFound):
            return Path(rospkg.RosPack().get_path(package)) / place
    raise RobotEnvError(
        f"package '{package}' is neither beside {TREE} nor on ROS_PACKAGE_PATH; "
        "source the workspace that it is installed in"
    )


def _urdf() -> Path:
    return find_file("cartpole", "urdf/cartpole.urdf.xacro")


def _parameters() -> Path:
    return find_file("cartpole_controller", "config/joint_position_control.yaml")


ROBOT = Robot(
    model="cartpole",
    state=CartPoleState,
    joints=(CART_JOINT, POLE_JOINT),
    controllers=(CONTROLLER,),
    commanded=(CONTROLLER,),
    urdf_file=_urdf,
    parameters_file=_parameters,
    ros=OverRos(rviz=("cartpole", "rviz.launch")),
    height=max(task.height for task in TASKS.values()),  # a robot there can do every task
)
