"""The names under which the robot is known, over ROS and in here."""

MODEL = "cartpole"
DESCRIPTION = "robot_description"
CART_LINK = "cart"
POLE_LINK = "pole"
CART_JOINT = "stand_cart"
POLE_JOINT = "cart_pole"
CONTROLLER = "stand_cart_position_controller"
