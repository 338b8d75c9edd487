"""The cart-pole robot's tasks, its environments, and the agents that learn them.

Importing this registers the environments `cartpole/Balance-v0`, `cartpole/Classic-v0` and
`cartpole/SwingUp-v0` with Gymnasium; what they are made of is loaded when one is made.
"""

from cartpole.registration import register_environments

register_environments()
