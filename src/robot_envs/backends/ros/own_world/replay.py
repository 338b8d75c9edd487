"""An episode once more, in another simulator."""

from robot_envs.backends.ros.lockstep import LockstepWorld
from robot_envs.backends.ros.own_world.health import checked
from robot_envs.backends.ros.own_world.journal import Journal
from robot_envs.errors import SimulatorFault
from robot_envs.world_state import WorldState


def repeat(world: LockstepWorld, journal: Journal, step: int) -> None:
    """Brings a simulator to the state in which the one before was last.

    Args:
        world: what it moves; of the same variation.
        journal: of an episode that has begun.
        step: simulated time of one action [ns].

    Raises:
        SimulatorFault: if it fails, or comes to another state.
    """
    assert journal.initial is not None
    state = checked(world.reset(journal.initial), 0)
    for count, commands in enumerate(journal.commands(), 1):
        state = checked(world.act(commands), count * step)
    if repr(state) != repr(journal.last):  # tells all bits of a number, and -0.0 from 0.0
        raise SimulatorFault(
            f"the same reset and {journal.steps} steps lead to another state, as where a plugin draws random "
            f"numbers: {_first_difference(state, journal.last)}"
        )


def _first_difference(state: WorldState, last: WorldState | None) -> str:
    for name, here, there in zip(WorldState._fields, state, last or (), strict=False):
        if repr(here) != repr(there):
            return f"{name} {here!r}, and not {there!r}"
    return "nothing"
