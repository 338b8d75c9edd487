"""Calls of ROS services, nodes and masters that end within a time limit.

A leaf: it imports nothing of this repository, and works wherever ROS is installed. Importing it needs neither
master nor node: `commands`, `master` and `absence` don't import rospy, and `requirements`, which programs
import first, needs only Python.

- `master`: calls of the master and of nodes; another master for a block of code.
- `service`: `ServiceClient`, a client with a time limit, and its errors.
- `waiting`: bounded waits for services and anything else.
- `commands`: which messages command controllers, and the fields of their numbers.
- `absence`: why no node offers a service, and what to start.
- `requirements`: which Python packages are missing, and the command that installs them.
"""

__all__ = ["absence", "commands", "master", "requirements", "service", "waiting"]
