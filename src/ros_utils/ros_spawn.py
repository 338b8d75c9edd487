"""A robot in one call: description, state publisher, model, controllers."""

from collections.abc import Sequence

import rosgraph

from ros_calls import master as _master
from ros_utils import ros_controllers, ros_gazebo, ros_node, ros_params, ros_urdf
from ros_utils._internal import log as _log
from ros_utils._internal import params as _params
from ros_utils.readiness import NotReady, Ready


def init_robot_state_pub(
    namespace: str = "/", max_pub_freq: float | None = None, launch_new_term: bool = False
) -> bool:
    """Starts a robot_state_publisher as node ``<namespace>/rob_st_pub``.

    Args:
        namespace: Where `robot_description` and `joint_states` are.
        max_pub_freq: Limit of its publishing rate [Hz]; None for its default.
        launch_new_term: In an xterm, if there is a display and xterm.

    Returns:
        True once it is registered at the master.
    """
    if max_pub_freq is not None:
        name = rosgraph.names.ns_join(namespace or "/", "rob_st_pub/publish_frequency")
        try:
            _params.put(name, float(max_pub_freq))
        except (_master.MasterDown, ValueError) as fault:
            _log.error(f"parameter {name}: {fault}")
            return False
    package = "robot_state_publisher"
    return bool(
        ros_node.ros_node_from_pkg(
            package, package, launch_new_term=launch_new_term, name="rob_st_pub", ns=namespace
        )
    )


def spawn_model_in_gazebo(
    pkg_name: str, model_urdf_file: str,
    controllers_file: str | None, controllers_list: Sequence[str] = (),
    model_urdf_folder: str = "/urdf", ns: str = "/", args_xacro: Sequence[str] | None = None,
    max_pub_freq: float | None = None, rob_st_term: bool = False,
    gazebo_name: str = "robot1", gaz_ref_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_w: float = 0.0, ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0,
    *, controllers_pkg: str | None = None, timeout: float = ros_gazebo.TIMEOUT,
    gazebo_ns: str = ros_gazebo.GAZEBO, verify: bool = False, ready: bool = False,
) -> bool:  # fmt: skip
    """Loads a robot's description, starts its state publisher, spawns it, and starts its controllers.

    Args:
        pkg_name: ROS package of the robot.
        model_urdf_file: URDF or xacro file in it.
        controllers_file: YAML file of the controllers; None for a robot without controllers.
        controllers_list: Controllers to load and start.
        model_urdf_folder: The URDF's folder in the package.
        ns: Namespace of description, state publisher and controller manager.
        args_xacro: Xacro arguments, ``"name:=value"`` each.
        max_pub_freq: Limit of the state publisher's rate [Hz].
        rob_st_term: The state publisher in an xterm.
        gazebo_name: Name of the new model.
        gaz_ref_frame: Model or link that the pose refers to.
        pos_x, pos_y, pos_z: Position [m].
        ori_w, ori_x, ori_y, ori_z: Orientation, a quaternion with w first here; all zeros means no
            rotation.
        controllers_pkg: Package of `controllers_file`; None for `pkg_name`.
        timeout, gazebo_ns: See `ros_gazebo`.
        verify: Return only once the model is in the world's list.
        ready: Return only once the model is there and all listed controllers run, within `timeout`
            after their start.

    Returns:
        True if every stage succeeded. The first failure ends the call; earlier stages aren't undone.
    """
    model = (pkg_name, model_urdf_file, "robot_description", model_urdf_folder)
    if not ros_urdf.urdf_load_from_pkg(*model, ns, args_xacro):
        return False
    if not init_robot_state_pub(ns, max_pub_freq, rob_st_term):
        return False
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    place = ("robot_description", gazebo_name, ns, gaz_ref_frame, *pose)
    at = ros_gazebo.At(timeout=timeout, gazebo_ns=gazebo_ns)
    if not ros_gazebo.gazebo_spawn_urdf_param(*place, verify=verify, **at):
        return False
    running: Sequence[str] = ()
    if controllers_file is not None:
        package = controllers_pkg or pkg_name
        if not ros_params.ros_load_yaml_from_pkg(package, controllers_file, ns):
            return False
        if not ros_controllers.spawn_controllers_srv(controllers_list, ns, service_timeout=timeout):
            return False
        running = controllers_list
    try:
        if ready:
            Ready([gazebo_name], running, ns, gazebo_ns).wait(timeout)
    except NotReady as fault:
        _log.error(f"spawn_model_in_gazebo: {fault}")
        return False
    return True
