"""Plugins of a user that take as long to load as a test wants."""

import rospy
from std_srvs.srv import Empty


class Slow:
    """Is loaded once the service `/loading` has answered."""

    def __init__(self, context):
        rospy.ServiceProxy("/loading", Empty)()

    def shutdown(self):
        pass
