"""The cart-pole's description: a cart that moves along a rail, and a pole that swings on it."""

from functools import partial

from robot_envs.files import own_file
from robot_envs.robot import Robot

CONTROL_PERIOD = 0.008  # [s] of simulated time for each action
MODEL = "cartpole"
CART_LINK, POLE_LINK = "cart", "pole"
CART_JOINT, POLE_JOINT = "stand_cart", "cart_pole"
CONTROLLER = "stand_cart_position_controller"


ROBOT = Robot(
    urdf=partial(own_file, "cartpole", "urdf/cartpole.urdf.xacro"),
    controllers=partial(own_file, "cartpole_controller", "config/joint_position_control.yaml"),
    run=(CONTROLLER,),
    name=MODEL,
    world=None,  # it never touches the ground
    control_period=CONTROL_PERIOD,
    rviz=("cartpole", "rviz.launch"),
)
