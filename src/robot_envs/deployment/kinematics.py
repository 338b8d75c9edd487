"""Forward kinematics of a robot's links, with velocities, from its joints alone."""

from collections.abc import Mapping

from file_access.text import did_you_mean
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.world_state import ONLY_REWARDED, JointState, Motion, StateQuery, Twist, link_keys
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import Pose, conjugate, multiply, scale, subtract
from robot_sim.state import SCOPE

INSTANT = 1e-5  # [s] either way, over which poses are differentiated
AT_REST = Motion(Pose())  # the world
_WORLD = ("", "world")


class LinkView:
    """Computes the links of a query, for a robot that is fixed to the world where its description says.

    Poses are the engine's, by forward kinematics; twists are their derivatives. Raises RobotEnvError if the
    query asks for what the joints don't determine.
    """

    def __init__(self, robot: Robot, query: StateQuery) -> None:
        self._links = robot.links
        self._root = robot.pose.compose(robot.links.root_pose)
        _check(robot, query)
        try:
            keys = link_keys(query)
        except ValueError as error:
            raise RobotEnvError(str(error)) from error
        places = [_of_link(robot, each.link) for each in query.links]
        frames = [None if each.frame in _WORLD else _of_link(robot, each.frame) for each in query.links]
        self._wanted = list(zip(keys, places, frames, strict=True))

    def __call__(self, joints: Mapping[str, JointState]) -> dict[str, Motion]:
        """Returns the links that these joints move, each in the frame asked for, by the query's names."""
        if not self._wanted:
            return {}

        def at(time: float) -> dict[str, Pose]:  # [s] from now
            places = {name: each.position + time * each.velocity for name, each in joints.items()}
            return link_poses(self._links, self._root, places)

        now, before, after = map(at, (0.0, -INSTANT, INSTANT))

        def motion(place: tuple[str, Pose]) -> Motion:
            link, offset = place
            poses = [each[link].compose(offset) for each in (now, before, after)]
            return Motion(poses[0], _twist(poses[1], poses[2]))

        motions = {}
        for key, place, frame in self._wanted:
            motions[key] = motion(place).seen_from(AT_REST if frame is None else motion(frame))
        return motions


def _twist(before: Pose, after: Pose) -> Twist:
    """Returns the linear and angular velocity in the world, between two poses 2 * INSTANT apart."""
    rate = 0.5 / INSTANT
    linear = scale(subtract(after.position, before.position), rate)
    x, y, z, w = multiply(after.orientation, conjugate(before.orientation))
    return Twist(linear, scale((x, y, z), 2.0 * rate if w >= 0.0 else -2.0 * rate))


def _check(robot: Robot, query: StateQuery) -> None:
    unknown = {
        "contacts": query.contacts_of or query.all_contacts,
        "models": query.all_models or set(query.models) - ({robot.model} if robot.odometry else set()),
    }
    for what, asked in unknown.items():
        if asked:
            raise RobotEnvError(
                f"the task asks for {what}, which aren't known of a robot that isn't simulated{ONLY_REWARDED}"
            )
    if query.links and not robot.links.fixed_base:
        raise RobotEnvError(
            f"the task asks for links, and '{robot.model}' isn't fixed to the world: its joints "
            f"don't determine where it is{ONLY_REWARDED}"
        )


def _of_link(robot: Robot, name: str) -> tuple[str, Pose]:
    """Returns the link that joints move, and the pose in it of the one named, which may be lumped into it."""
    model, _, plain = name.rpartition(SCOPE)
    links = robot.links
    if model not in ("", robot.model) or not (plain in links.links or plain in links.lumped):
        near = did_you_mean(plain, [*links.links, *links.lumped])
        raise RobotEnvError(f"the robot '{robot.model}' has no link '{name}'{near}")
    whole, place = links.lumped.get(plain, (plain, Pose()))
    parents = {joint.child: joint for joint in links.joints.values()}
    link = whole
    while link in parents:
        joint = parents[link]
        if joint.movable and joint.name not in robot.joints:
            raise RobotEnvError(
                f"the link '{name}' depends on the joint '{joint.name}', which has no transmission: "
                "its position isn't known"
            )
        link = joint.parent
    return whole, place
