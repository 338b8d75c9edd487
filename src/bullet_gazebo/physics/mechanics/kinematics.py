"""Where the links are when the joints are known."""

import math
from collections import defaultdict
from collections.abc import Mapping

from bullet_gazebo.physics.description import Joint, ModelDescription
from bullet_gazebo.physics.pose import Pose, scale


def link_poses(
    model: ModelDescription, root: Pose, positions: Mapping[str, float]
) -> dict[str, Pose]:
    """Returns the frame of every link, in the frame that `root`, the root link's, is given in.

    `positions` are those of the movable joints [rad, m]; one that isn't named is at zero.
    """
    poses = {model.root: root}
    poses.update({name: root.compose(pose) for name, pose in model.islands.items()})
    below: dict[str, list[Joint]] = defaultdict(list)
    for joint in model.joints.values():
        below[joint.parent].append(joint)
    order = list(poses)
    for parent in order:
        for joint in below[parent]:
            motion = _motion(joint, 0.0 if model.static else positions.get(joint.name, 0.0))
            moved = joint.pose.compose(joint.anchor).compose(motion)
            poses[joint.child] = poses[parent].compose(moved.compose(joint.anchor.inverse()))
            order.append(joint.child)  # the list grows while it is walked
    return poses


def _motion(joint: Joint, position: float) -> Pose:
    if not joint.movable or position == 0.0:
        return Pose()
    if joint.kind == "prismatic":
        return Pose(scale(joint.axis, position))
    x, y, z = scale(joint.axis, math.sin(position / 2.0))
    return Pose(orientation=(x, y, z, math.cos(position / 2.0)))
