"""`python3 -m rl_workbench`: the same as workbench.py, where there is no rosrun."""

import sys

try:
    from rl_workbench.cli import main
except KeyboardInterrupt:  # Ctrl-C while it is still being read; main() sees to the rest
    sys.exit(130)

sys.exit(main())
