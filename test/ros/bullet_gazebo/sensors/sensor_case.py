"""A world in lock-step with the model of all sensors, whose topics tests listen to."""

import rospy
from gazebo_msgs.msg import ModelState
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from support.ros.calls import delete_model, gazebo, spawn_model, step_world
from support.ros.subscribed import Listener
from support.ros.world_case import WorldCase

SHAPE = "<geometry><box><size>1 1 1</size></box></geometry>"
RED = "<material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material>"
WALL = (
    f'<sdf version="1.6"><model name="w"><static>1</static><link name="l"><collision name="c">{SHAPE}'
    f'<laser_retro>5</laser_retro></collision><visual name="v">{SHAPE}{RED}</visual></link></model></sdf>'
)
MS = 1_000_000
UPRIGHT = Quaternion(0.0, 0.0, 0.0, 1.0)


class Heard(Listener):
    """The messages of a topic."""

    def after(self, count):
        """Returns the messages when there are as many."""
        assert self.wait_for(lambda messages: len(messages) >= count), self.messages
        return self.messages

    def stamps(self, count):
        return [message.header.stamp.to_nsec() for message in self.after(count)]

    def from_time(self, time):
        """Returns the newest message when one isn't older than `time` [ns]."""
        assert self.wait_for(lambda messages: messages[-1].header.stamp.to_nsec() >= time), time
        return self.messages[-1]


class SensorCase(WorldCase):
    """Each test begins with the bot at the origin, a red wall 1.5 m before it, and time 0."""

    @classmethod
    def setUpClass(cls):
        bot = rospy.get_param("~model")
        for name, xml, place in (("wall", WALL, {"x": 2.0, "z": 0.5}), ("bot", bot, {})):
            assert spawn_model(name, xml, kind="sdf", **place).success
            cls.addClassCleanup(delete_model, name)

    def setUp(self):
        gazebo("reset_simulation")

    def put(self, x=0.0, y=0.0, z=0.0, turning=0.0, name="bot"):
        """Puts a model somewhere, turning about z at a speed [rad/s]."""
        state = ModelState(model_name=name, reference_frame="world")
        state.pose = Pose(Point(x, y, z), UPRIGHT)
        state.twist = Twist(Vector3(), Vector3(0.0, 0.0, turning))
        self.assertTrue(gazebo("set_model_state", state).success)

    def hear(self, name, kind, **options):
        heard = Heard(name, kind, **options)
        self.addCleanup(heard.close)
        return heard

    def step(self, ticks):
        return round(1000 * step_world(ticks).sim_time) * MS

    def newest(self, name, kind, ticks=300):
        heard = self.hear(name, kind)
        return heard.from_time(self.step(ticks) - 250 * MS)  # the slowest one has 4 Hz
