"""`python3 -m cartpole.workbench`: the same as workbench.py, where there is no rosrun."""

import sys

from cartpole.workbench.cli import main

sys.exit(main())
