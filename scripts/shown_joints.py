#!/usr/bin/env python3
"""Joint states for RViz, from the first moment; see launch/rviz.launch."""

import sys

from ros_calls.requirements import SIMULATOR, require

if __name__ == "__main__":
    require(SIMULATOR)
    from bullet_gazebo.ros.clients.shown_joints import main

    sys.exit(main())
