"""The cart-pole robot's tasks, its environments, and the agents that learn them.

Importing this registers the environments `cartpole/Balance-v0`, `cartpole/Classic-v0` and
`cartpole/SwingUp-v0` with Gymnasium; what they are made of is loaded when one is made.
"""

from importlib.util import find_spec
from pkgutil import extend_path

# The generated part of this package, cartpole.srv, lies in another folder of the catkin workspace.
__path__ = extend_path(__path__, __name__)

if find_spec("gymnasium"):  # the simulator, which needs our messages, runs without it
    from cartpole.registration import register_environments

    register_environments()
