#!/usr/bin/env python3
"""Says what is read of a robot's file, what is served, and whether it stands and moves; see --help."""

import os
import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c, reader_may_go

    with ended_by_ctrl_c():
        from ros_calls.requirements import SIMULATOR, require

        require(SIMULATOR)
        from package_writing.check_cli import main
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # where engines print
    code = 0  # of pages that no one reads to their end
    with reader_may_go():
        code = main()
        sys.stdout.flush()
    sys.exit(code)
