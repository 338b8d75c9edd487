"""The cart-pole robot's task, its environments, and the agents that learn it."""

from pkgutil import extend_path

# The generated part of this package, cartpole.srv, lies in another folder of the catkin workspace.
__path__ = extend_path(__path__, __name__)
