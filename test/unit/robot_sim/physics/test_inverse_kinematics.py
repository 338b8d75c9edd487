"""Steps of an arm's tip."""

from itertools import accumulate

import numpy as np

from robot_sim.physics.description import Joint
from robot_sim.physics.dynamics import child_pose
from robot_sim.physics.inverse_kinematics import step_tip
from robot_sim.physics.pose import Pose, rotation

LINK, AXES = Pose((0.0, 0.0, 0.2)), np.eye(3)[[2, 1, 1, 2, 1, 2]].tolist()
ARM = [Joint("", "revolute", "", "", LINK, axis=axis, lower=-2.0, upper=2.0) for axis in AXES]


def test_a_tip_moves_straight_and_turns_about_z_alone_as_far_as_joints_allow():
    for step in np.concatenate([np.eye(4), -np.eye(4)]) / 100:
        start = np.array([0.3, 0.6, 0.9, 0.4, 0.7, -0.5])
        ends = start, step_tip(ARM, LINK, start, step)
        links = [list(accumulate(map(child_pose, ARM, end), Pose.compose)) for end in ends]
        before, after = (each[-1].compose(LINK) for each in links)
        assert np.allclose(np.subtract(after.position, before.position), step[:3], atol=1e-4)
        assert np.allclose(rotation(before, after), (0.0, 0.0, step[3]), atol=1e-3)
        moved = step_tip(ARM, LINK, np.array([0.0, 0.5, 2.0, 0.0, 0.5, 0.0]), step)
        assert moved is None or np.abs(moved).max() <= 2.0
    assert step_tip(ARM, LINK, np.zeros(6), np.array([0.0, 0.0, 0.01, 0.0])) is None  # it is stretched
