"""A world in lock-step with a cart-pole whose controllers run, for all cases that share it."""

import rospy
from support.ros.calls import gazebo, model_names, spawn_model, step_world
from support.ros.manager import Manager
from support.ros.world_case import WorldCase

STATES, CART = "joint_state_controller", "stand_cart_position_controller"


def step(ticks, command=None, **fields):
    """Lets time pass, with a command for the cart."""
    if command is not None:
        fields |= {"controllers": [CART], "commands": [command]}
    return step_world(ticks, **fields)


class LockstepCase(WorldCase):
    @classmethod
    def setUpClass(cls):
        if "cartpole" not in model_names():
            assert spawn_model("cartpole", rospy.get_param("/robot_description")).success
            assert Manager().start(STATES, CART)

    def setUp(self):
        gazebo("reset_simulation")
