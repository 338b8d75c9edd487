from robot_envs import register

register("robot_envs/TwoLinkReach-v0", robot="robot_envs.robots.two_link_arm:ARM", task="robot_envs.robots.two_link_arm:Reach")
register("robot_envs/TwoLinkReachGoal-v0", robot="robot_envs.robots.two_link_arm:ARM", task="robot_envs.robots.two_link_arm:ReachGoal")
register("robot_envs/Furuta-v0", robot="robot_envs.robots.furuta:FURUTA", task="robot_envs.robots.furuta:SwingUp")
register("robot_envs/DoublePendulum-v0", robot="robot_envs.robots.double_pendulum:DOUBLE_PENDULUM", task="robot_envs.robots.double_pendulum:Balance")
register("robot_envs/Hopper-v0", robot="robot_envs.robots.hopper:HOPPER", task="robot_envs.robots.hopper:HopForward")
register("robot_envs/SixJointReach-v0", robot="robot_envs.robots.six_joint_arm:ARM", task="robot_envs.robots.six_joint_arm:Reach")
