"""`python3 -m rl_workbench`: the command line in any Gymnasium environment; it registers none itself."""

import sys

from rl_workbench.starting import ended_by_ctrl_c

with ended_by_ctrl_c():  # main() handles signals from then on
    from rl_workbench.cli import main

sys.exit(main())
