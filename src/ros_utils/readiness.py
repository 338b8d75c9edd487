"""Readiness of a world: a bounded wait, and its missing parts.

ready = Ready(models=["arm"], controllers=["joint_state_controller", "arm_controller"])
ros_launch.ros_launch_from_pkg("my_arm", "arm.launch", ready=ready, timeout=120.0)
"""

import difflib
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import rosgraph
from controller_manager_msgs.srv import ListControllers
from gazebo_msgs.srv import GetWorldProperties

from ros_calls import master as _master
from ros_calls.absence import LOCKSTEP, WORLD, why_absent
from ros_calls.absence import is_offered as _is_offered
from ros_calls.master import NoAnswer
from ros_calls.service import TIMEOUT as _CALL_TIMEOUT
from ros_calls.service import ServiceClient, ServiceFailed
from ros_calls.waiting import TIMEOUT, wait_until

RUNNING = "running"


class NotReady(Exception):
    """Something is missing; the text says what, and the command that fixes it."""


@dataclass(frozen=True)
class Ready:
    """A requirement: a world that answers, with its models and running controllers.

    Args:
        models: Names of models that must be in the world.
        controllers: Names of controllers that must run; a name with a leading slash includes its
            namespace.
        ns: The namespace of the other controllers' manager.
        gazebo_ns: The simulator's node, the prefix of its services' names.
        lockstep: The world must run in lock-step.
    """

    models: Sequence[str] = ()
    controllers: Sequence[str] = ()
    ns: str = "/"
    gazebo_ns: str = "/gazebo"
    lockstep: bool = False

    def __post_init__(self) -> None:
        for name in ("models", "controllers"):
            if isinstance(getattr(self, name), str):  # else its letters would be the names
                object.__setattr__(self, name, (getattr(self, name),))

    def missing(self, timeout: float = _CALL_TIMEOUT) -> str:
        """Returns the first missing thing and the command that fixes it; "" if nothing is missing.

        `timeout` limits each call [s].
        """
        try:
            _master.require(timeout)
            return next(self._faults(timeout), "")
        except (ServiceFailed, _master.MasterDown) as fault:
            return str(fault)
        except NoAnswer as fault:
            return f"the master at {_master.uri()}: {fault}"

    def wait(self, timeout: float = TIMEOUT) -> None:
        """Waits until nothing is missing; raises NotReady if something still is after `timeout` [s].

        Raises rospy.ROSInterruptException if the caller's node was shut down meanwhile.
        """
        missing = still_missing(self, timeout)
        if missing:
            raise NotReady(f"not ready after {timeout:g} s: {missing}")

    def _faults(self, timeout: float) -> Iterator[str]:
        gazebo = "/" + self.gazebo_ns.strip("/")
        world = ServiceClient(f"{gazebo}/{WORLD}", GetWorldProperties, timeout=timeout)
        models = world().model_names
        step = f"{gazebo}/{LOCKSTEP[0]}"
        if self.lockstep and not _is_offered(step):
            yield why_absent(step)
        for name in self.models:
            if name not in models:
                yield (
                    f"there is no model '{name}' in the world{_nearest(name, models)}; spawn it with: rosrun "
                    f"gazebo_ros spawn_model -urdf -param robot_description -model {name}"
                )
        for namespace, names in self._managers().items():
            yield from controller_faults(namespace, names, timeout)

    def _managers(self) -> dict[str, list[str]]:
        """Returns the controllers' names, by their manager's namespace."""
        by_namespace: dict[str, list[str]] = {}
        for each in self.controllers:
            full = rosgraph.names.ns_join("/" + self.ns.strip("/"), each)
            namespace, _, name = full.rpartition("/")
            by_namespace.setdefault(namespace, []).append(name)
        return by_namespace


def still_missing(ready: Ready, timeout: float, is_over: Callable[[], bool] = lambda: False) -> str:
    """Waits until nothing is missing, or `is_over`, at most `timeout` [s]; returns what still is."""
    deadline = time.monotonic() + timeout
    missing = ""

    def look() -> bool:
        nonlocal missing
        over = is_over()
        missing = ready.missing(min(max(deadline - time.monotonic(), 1.0), _CALL_TIMEOUT))
        return over or not missing

    wait_until(look, timeout, "a world that is ready")
    return missing


def controller_faults(namespace: str, names: Sequence[str], timeout: float) -> Iterator[str]:
    """Yields a line for each controller of a manager that isn't loaded or doesn't run, with the remedy.

    The namespace has no slash at its end. Raises ServiceFailed if the manager doesn't answer.
    """
    service = f"{namespace}/controller_manager/list_controllers"
    answer = ServiceClient(service, ListControllers, timeout=timeout)()
    states = {each.name: each.state for each in answer.controller}
    option = f" __ns:={namespace}" if namespace else ""
    for name in names:
        if name not in states:
            yield (
                f"the controller '{namespace}/{name}' isn't loaded{_nearest(name, states)}; load and start "
                f"it with: rosrun controller_manager spawner {name}{option}"
            )
        elif states[name] != RUNNING:
            yield (
                f"the controller '{namespace}/{name}' is {states[name]}, not running; start it with: rosrun "
                f"controller_manager controller_manager start {name}{option}"
            )


def _nearest(name: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(name, known, 1)
    if near:
        return f" (did you mean '{near[0]}'?)"
    return f" (there are: {', '.join(known)})" if known else " (there are none)"
