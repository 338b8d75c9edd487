"""`python3 -m rl_workbench`: the same as workbench.py, where there is no rosrun."""

import sys

from rl_workbench.cli import main

sys.exit(main())
