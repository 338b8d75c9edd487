#!/usr/bin/env python3
"""Joint states for RViz, from the first moment; see launch/rviz.launch."""

import argparse
import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        # Others are roslaunch's remappings.
        argparse.ArgumentParser(description=__doc__).parse_known_args()
        from ros_calls.requirements import SIMULATOR, require

        require(SIMULATOR)
        from bullet_gazebo.clients.shown_joints import main
    sys.exit(main())
