"""The cart-pole: its description, its tasks, its environments.

Importing this registers its environments with Gymnasium, which imports their modules when it makes one.
"""

import gymnasium

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["NAMESPACE"]

NAMESPACE = "cartpole"
_ENVIRONMENTS = {  # name: task, and the return at which it counts as solved
    "Balance": ("balance", 1200.0),  # of up to 1500: all 3000 steps, the cart near the middle
    "Classic": ("classic", 475.0),  # of 500 steps, as for CartPole-v1
    "SwingUp": ("swing-up", 1000.0),  # of 1250 steps, of which swinging up takes 200 and more
}

for _name, (_task, _solved) in _ENVIRONMENTS.items():
    if f"{NAMESPACE}/{_name}-v0" not in gymnasium.registry:
        gymnasium.register(
            f"{NAMESPACE}/{_name}-v0",
            entry_point="cartpole.environment:make_environment",
            vector_entry_point="cartpole.environment:make_vector",
            reward_threshold=_solved,
            kwargs={"task": _task},
        )
