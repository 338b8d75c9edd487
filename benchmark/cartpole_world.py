"""A running simulator with cart-poles in it, for the benchmarks."""

from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf

CART = "stand_cart_position_controller"
CONTROLLERS = ["joint_state_controller", CART]


def add_cartpole(
    name: str = "cartpole", namespace: str = "/", pos_y: float = 0.0, pos_z: float = 0.0
) -> None:
    """Spawns a cart-pole and starts its two controllers, in the simulator that is active."""
    loaded = ros_urdf.urdf_load_from_pkg(
        "cartpole_gazebo", "cartpole_v1.urdf", "robot_description", folder="/robots", ns=namespace
    ) and ros_params.ros_load_yaml_from_pkg(
        "cartpole_controller", "joint_position_control.yaml", ns=namespace
    )
    spawned, text = ros_gazebo.gazebo_spawn_urdf_param(
        "robot_description", model_name=name, robot_namespace=namespace, pos_y=pos_y, pos_z=pos_z
    )
    if not (loaded and spawned and ros_controllers.spawn_controllers_srv(CONTROLLERS, ns=namespace)):
        raise SystemExit(f"the robot {name} doesn't come up: {text}")
