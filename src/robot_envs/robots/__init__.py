"""Robots that come along; importing this registers them with Gymnasium. docs/robots.md tells about them.

| id | what is to be learned |
|---|---|
| `robot_envs/TwoLinkReach-v0` | the tip of a two-link arm goes to a point |
| `robot_envs/TwoLinkReachGoal-v0` | the same with goals and a sparse reward, for hindsight replay |
| `robot_envs/SixJointReach-v0` | the tip of a six-joint arm goes to a point in space |
| `robot_envs/Furuta-v0` | a Furuta pendulum swings up and stays up |
| `robot_envs/DoublePendulum-v0` | a cart keeps two rods upright, one on top of the other |
| `robot_envs/Hopper-v0` | a one-legged robot hops forward |
"""

from robot_envs.making import register

register(
    "robot_envs/TwoLinkReach-v0", f"{__name__}.two_link_arm:ROBOT", f"{__name__}.two_link_arm:Reach"
)
register(
    "robot_envs/TwoLinkReachGoal-v0",
    f"{__name__}.two_link_arm:ROBOT",
    f"{__name__}.two_link_arm:ReachGoal",
)
register(
    "robot_envs/SixJointReach-v0",
    f"{__name__}.six_joint_arm:ROBOT",
    f"{__name__}.six_joint_arm:Reach",
)
register("robot_envs/Furuta-v0", f"{__name__}.furuta:ROBOT", f"{__name__}.furuta:SwingUp")
register(
    "robot_envs/DoublePendulum-v0",
    f"{__name__}.double_pendulum:ROBOT",
    f"{__name__}.double_pendulum:Balance",
)
register("robot_envs/Hopper-v0", f"{__name__}.hopper:ROBOT", f"{__name__}.hopper:HopForward")
