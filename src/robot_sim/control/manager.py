"""The controller manager: loads, switches and updates controllers (docs/contract/ros_control.md 1)."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from robot_sim.control.controllers import built_in
from robot_sim.control.controllers.base import Controller
from robot_sim.control.errors import ControlError, faults
from robot_sim.control.hardware import RobotHardware
from robot_sim.state_dict import load, state_of

BEST_EFFORT = 1
STRICT = 2
RUNNING, STOPPED = "running", "stopped"


class ControllerManager:
    """The controllers of one robot, in load order. Not thread-safe: called between two ticks only.

    A refused request raises ControlError with the reason, and changes nothing. A controller that raises
    anything else is stopped and reported to `on_fault`; the others continue.
    """

    def __init__(self, hardware: RobotHardware) -> None:
        self.hardware = hardware
        self.types: dict[str, type[Controller]] = dict(built_in())
        self._controllers: dict[str, Controller] = {}
        self._running: list[Controller] = []
        self.version = 0  # changes whenever `loaded` does
        self._now = 0
        self.on_fault: Callable[[Controller, BaseException], None] = lambda controller, error: None
        # Called when controllers are loaded, started or stopped, and when gains have changed.
        self.on_change: Callable[[], None] = lambda: None

    def update(self, now: int, dt: float) -> None:
        """Updates the running controllers; `now` [ns], `dt` [s]."""
        self._now = now
        for controller in self._running:
            try:
                controller.update(now, dt)
            except faults() as error:  # a user's code must not stop the world
                self._fail(controller, error)

    @property
    def loaded(self) -> list[Controller]:
        """The loaded controllers, in load order."""
        return list(self._controllers.values())

    @property
    def running(self) -> tuple[Controller, ...]:
        """The running controllers, in load order."""
        return tuple(self._running)

    def get(self, name: str) -> Controller:
        """Returns controller `name`."""
        if name not in self._controllers:
            raise ControlError(f"No controller named '{name}' is loaded.")
        return self._controllers[name]

    def load(self, name: str, params: object) -> Controller:
        """Creates controller `name` from the parameters `<ns>/<name>`."""
        if name in self._controllers:
            raise ControlError(
                f"A controller named '{name}' was already loaded inside the controller manager"
            )
        kind = params.get("type") if isinstance(params, Mapping) else None
        if not isinstance(params, Mapping) or not isinstance(kind, str):
            raise ControlError(
                f"Could not load controller '{name}' because the type was not specified. "
                "Did you load the controller configuration on the parameter server?"
            )
        if kind not in self.types:
            raise ControlError(
                f"Could not load controller '{name}' because controller type '{kind}' does not exist. "
                "Use 'rosservice call controller_manager/list_controller_types' to get the available types"
            )
        try:
            controller = self.types[kind].create(name, params, self.hardware)
            _check_made(controller, name, self.hardware)
        except faults() as error:
            reason = error if isinstance(error, ControlError) else repr(error)
            raise ControlError(f"Initializing controller '{name}' failed: {reason}") from error
        self._controllers[name] = controller
        self.version += 1
        self.on_change()
        return controller

    def unload(self, name: str) -> None:
        """Unloads a controller that isn't running."""
        controller = self.get(name)
        if controller.state == RUNNING:
            raise ControlError(f"Could not unload controller '{name}' because it is still running")
        self.version += 1
        del self._controllers[name]

    def switch(self, start: Iterable[str], stop: Iterable[str], strictness: int = BEST_EFFORT) -> None:
        """Stops and starts controllers at once, also while the world is paused.

        A running controller that is in both lists, or in the start list under BEST_EFFORT, is restarted;
        STRICT refuses both (docs/contract/ros_control.md 1.6).
        """
        strict = strictness == STRICT
        stopping = self._known(stop, strict)
        starting = self._known(start, strict)
        if strict:
            _check_strict(starting, stopping)
        stopping = [c for c in stopping if c.state == RUNNING]
        kept = [c for c in self._running if c not in stopping and c not in starting]
        _check_conflicts(kept + starting)
        for controller in stopping:
            self._stop(controller)
        failed = [c.name for c in starting if not self._start(c)]
        self._running = [c for c in self._controllers.values() if c.state == RUNNING]
        self.on_change()
        if failed:
            raise ControlError(f"Could not start {failed}: see the error above.")

    def restart(self) -> None:
        """Restarts all running controllers, at the end of an emergency stop."""
        names = [c.name for c in self._running]
        self.switch(names, names)

    def unload_all(self) -> None:
        """Stops and unloads all controllers."""
        self.switch([], [c.name for c in self._running])
        self._controllers.clear()
        self.version += 1

    def loops_changed(self) -> None:
        """Checks gains after a change."""
        self.on_change()

    def joints_moved(self, now: int, relatch: bool) -> None:
        """Tells controllers that a service or reset has moved joints.

        If `relatch`, they start over: set-points at the new positions, no PID history, no old effort.
        """
        self._now = now
        if relatch:
            self.hardware.relatch()
            for controller in self._running:
                self._start(controller)
        self._running = [c for c in self._controllers.values() if c.state == RUNNING]
        self._tell(lambda controller: controller.joints_moved(now))

    def state_dict(self) -> dict[str, Any]:
        """Returns the state of the controllers, by name; the robot saves it."""
        controllers = {name: state_of(each) for name, each in self._controllers.items()}
        return {"now": self._now, "controllers": controllers}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Loads what `state_dict` returned, with the same controllers running."""
        self._now = state["now"]
        saved = state["controllers"]
        for name, each in self._controllers.items():
            if name not in saved and each in self._running:
                each.joints_moved(self._now)
        load((each, saved[name]) for name, each in self._controllers.items() if name in saved)

    def restored(self) -> None:
        """Tells the running controllers that a snapshot was restored."""
        self._tell(lambda controller: controller.restored())

    def _tell(self, call: Callable[[Controller], None]) -> None:
        for controller in self._running:
            try:
                call(controller)
            except faults() as error:  # a user's code must not stop the world
                self._fail(controller, error)

    def _start(self, controller: Controller) -> bool:
        try:
            controller.starting(self._now)
        except faults() as error:
            controller.state = STOPPED
            self._fail(controller, error)
            return False
        controller.state = RUNNING
        return True

    def _stop(self, controller: Controller) -> None:
        controller.state = STOPPED
        try:
            controller.stopping()
        except faults() as error:
            self._fail(controller, error)

    def _fail(self, controller: Controller, error: BaseException) -> None:
        """Stops a controller that raised, and releases its joints."""
        if controller.state == RUNNING:
            self._stop(controller)
        # A new list: the old one may be in use by a running update.
        self._running = [c for c in self._running if c is not controller]
        self.hardware.relatch(controller.claimed)
        self.on_change()
        self.on_fault(controller, error)

    def _known(self, names: Iterable[str], strict: bool) -> list[Controller]:
        controllers: dict[str, Controller] = {}
        for name in names:
            if name in self._controllers:
                controllers[name] = self._controllers[name]
            elif strict:
                raise ControlError(f"Could not switch: no controller named '{name}' is loaded.")
        return list(controllers.values())


def _check_made(controller: object, name: str, hardware: RobotHardware) -> None:
    """Refuses a user's controller that would break list_controllers or the check for conflicts."""
    if not isinstance(controller, Controller):
        raise ControlError(f"create() returned {controller!r}, which isn't a controller")
    if controller.name != name:
        raise ControlError(f"it calls itself {controller.name!r}: __init__ must get create()'s name")
    if not isinstance(getattr(controller, "interface", None), str):
        raise ControlError("its class lacks `interface`, the name of a hardware interface")
    claimed = controller.claimed
    if not isinstance(claimed, (tuple, list)) or not all(name in hardware.joints for name in claimed):
        raise ControlError(
            f"it claims {claimed!r}, which isn't a tuple of names of controlled joints "
            f"({', '.join(hardware.joints) or 'there are none'})"
        )


def _check_strict(starting: list[Controller], stopping: list[Controller]) -> None:
    both = [c.name for c in starting if c in stopping]
    idle = [c.name for c in stopping if c.state != RUNNING]
    busy = [c.name for c in starting if c.state == RUNNING]
    if both:
        raise ControlError(f"Could not switch: {both} are in both the start and the stop list.")
    if idle:
        raise ControlError(f"Could not stop {idle}: not running.")
    if busy:
        raise ControlError(f"Could not start {busy}: already running.")


def _check_conflicts(controllers: list[Controller]) -> None:
    """Refuses two controllers of one joint, whatever their interfaces."""
    owners: dict[str, str] = {}
    for controller in controllers:
        for joint in controller.claimed:
            if joint in owners:
                raise ControlError(
                    f"Could not switch: controllers '{owners[joint]}' and '{controller.name}' "
                    f"both claim joint '{joint}'"
                )
            owners[joint] = controller.name
