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
    "robot_envs/TwoLinkReach-v0",
    "robot_envs.robots.two_link_arm:ROBOT",
    "robot_envs.robots.two_link_arm:Reach",
    reward_threshold=15.0,
)
register(
    "robot_envs/TwoLinkReachGoal-v0",
    "robot_envs.robots.two_link_arm:ROBOT",
    "robot_envs.robots.two_link_arm:ReachGoal",
    reward_threshold=-20.0,
)
register(
    "robot_envs/SixJointReach-v0",
    "robot_envs.robots.six_joint_arm:ROBOT",
    "robot_envs.robots.six_joint_arm:Reach",
    reward_threshold=30.0,
)
register(
    "robot_envs/Furuta-v0",
    "robot_envs.robots.furuta:ROBOT",
    "robot_envs.robots.furuta:SwingUp",
    reward_threshold=240.0,
)
register(
    "robot_envs/DoublePendulum-v0",
    "robot_envs.robots.double_pendulum:ROBOT",
    "robot_envs.robots.double_pendulum:Balance",
    reward_threshold=475.0,
)
register(
    "robot_envs/Hopper-v0",
    "robot_envs.robots.hopper:ROBOT",
    "robot_envs.robots.hopper:HopForward",
    reward_threshold=450.0,
)
