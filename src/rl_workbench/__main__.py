"""`python3 -m rl_workbench`: the same as workbench.py, where there is no rosrun."""

import sys

from rl_workbench.starting import ended_by_ctrl_c

with ended_by_ctrl_c():  # main() handles signals from then on
    from rl_workbench.cli import main

sys.exit(main())
