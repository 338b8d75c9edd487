"""The cart-pole: its description, its tasks, its environments.

Importing this registers the environments `cartpole/Balance-v0`, `cartpole/Classic-v0` and
`cartpole/SwingUp-v0` with Gymnasium; what they are made of is loaded when one is made.
"""

from cartpole.registration import register_environments

register_environments()
