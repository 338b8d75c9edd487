#!/usr/bin/env python3
"""The workspace's nodes and Debian's in one launch: what they import, and where they listen."""

import rospy
import rostest
from listening_cases import Listening
from workspace_cases import Workspace

__all__ = ["Listening", "Workspace"]

if __name__ == "__main__":
    rospy.init_node("listening")
    rostest.rosrun("cartpole", "listening", "__main__")
