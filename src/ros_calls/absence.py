"""Diagnosis of missing services: why no node offers one, and what to start."""

from ros_calls import master
from ros_calls.master import NoAnswer, Refused

START = "roslaunch gazebo_ros empty_world.launch"
WORLD = "get_world_properties"  # every simulator has it
LOCKSTEP = (
    "step_world", "prepare_step", "prepared_step", "advance_world", "save_state", "restore_state",
    "set_link_friction",
)  # fmt: skip
MANAGER = "controller_manager"
SPAWNS = "gazeboSpawns"  # XML-RPC method of the simulator's node: see `spawns`


def is_offered(service: str) -> bool:
    """Returns whether a node, dead or alive, is registered for a service, given by its full name."""
    try:
        master.call("lookupService", service)
    except Refused:
        return False
    return True


def why_absent(service: str) -> str:
    """Returns why no node offers a service, given by its full name, and the command that starts one."""
    parent, _, name = service.rpartition("/")
    above, _, last = parent.rpartition("/")
    if name in LOCKSTEP and is_offered(f"{parent}/{WORLD}"):
        return f"the simulator isn't in lock-step; start it with: {START} lockstep:=true"
    if name in LOCKSTEP:
        return f"no simulator runs at {master.uri()}; start one with: {START} lockstep:=true"
    if name == WORLD or (last == "gazebo" and not is_offered(f"{parent}/{WORLD}")):
        return f"no simulator runs at {master.uri()}; start one with: {START}"
    if last == MANAGER:
        return (
            f"there is no controller manager in the namespace {above or '/'}: spawn a robot there whose URDF "
            f"has the plugin libgazebo_ros_control.so, and is the parameter {above}/robot_description, too"
        )
    return "no node offers this service"


def why_not_up(service: str) -> str:
    """As `why_absent`, for a service that didn't come up: its node may be registered but not answer."""
    try:
        return "its node doesn't answer" if is_offered(service) else why_absent(service)
    except NoAnswer as fault:
        return f"the master at {master.uri()}: {fault}"


def spawns() -> list[int]:
    """Returns how many models are being spawned, and how many have been; nothing if no simulator says."""
    address = master.answer(master.uri(), "lookupNode", "/gazebo")
    return list(master.answer(address, SPAWNS) or ()) if address else []
