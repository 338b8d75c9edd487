"""The six services of a controller manager (docs/contract/ros_control.md 1.2 to 1.7)."""

import threading
import traceback
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import rosgraph
import rospy
from controller_manager_msgs import srv
from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources

from bullet_gazebo.common.publishing import Thinner
from bullet_gazebo.control.controller_topics import ControllerTopics
from robot_sim.control.controllers import find_type
from robot_sim.control.controllers.base import Controller
from robot_sim.control.errors import ControlError, faults
from robot_sim.control.manager import ControllerManager
from robot_sim.simulator import Simulator

BASE_CLASS = "controller_interface::ControllerBase"


class ControllerServices:
    """Serves one manager. All calls are answered at once, also while the world is paused."""

    def __init__(self, sim: Simulator, thinner: Thinner, manager: ControllerManager, namespace: str) -> None:
        self._sim = sim
        self._thinner = thinner
        self._manager = manager
        self._namespace = namespace
        self._topics: dict[str, ControllerTopics] = {}
        self._one_at_a_time = threading.Lock()
        self._gone = False
        manager.on_fault = _report_fault
        self._services: list[rospy.Service] = []
        with ExitStack() as opened:  # if one can't be offered, those before it are closed
            opened.callback(self.shutdown)
            self._advertise("list_controllers", srv.ListControllers, self._list)
            self._advertise("list_controller_types", srv.ListControllerTypes, self._list_types)
            self._advertise("load_controller", srv.LoadController, self._load)
            self._advertise("unload_controller", srv.UnloadController, self._unload)
            self._advertise("switch_controller", srv.SwitchController, self._switch)
            self._advertise("reload_controller_libraries", srv.ReloadControllerLibraries, self._reload)
            opened.pop_all()

    def shutdown(self) -> None:
        """Closes the services and all controllers' topics."""
        for service in self._services:
            service.shutdown("the model was deleted")
        with self._one_at_a_time:
            self._gone = True
            self._close_all()

    def _advertise(self, name: str, kind: type, handler: Callable[[Any], object]) -> None:
        def handle(request: object) -> object:
            with self._one_at_a_time:
                if self._gone:  # rospy keeps persistent connections to a service that is shut down
                    raise rospy.ServiceException("the model was deleted")
                try:
                    return handler(request)
                except ControlError as error:  # the answer is just ok=false: ros_control.md 1.3
                    rospy.logerr("Controller manager: %s", error)
                    return False

        full = rospy.names.ns_join(self._namespace, f"controller_manager/{name}")
        self._services.append(rospy.Service(full, kind, handle))

    def _list(self, request: srv.ListControllersRequest) -> srv.ListControllersResponse:
        with self._sim.lock.glance():
            return srv.ListControllersResponse([_state(each) for each in self._manager.loaded])

    def _list_types(self, request: srv.ListControllerTypesRequest) -> srv.ListControllerTypesResponse:
        types = sorted(self._manager.types)
        return srv.ListControllerTypesResponse(types, [BASE_CLASS] * len(types))

    def _load(self, request: srv.LoadControllerRequest) -> bool:
        # An empty name would fetch the whole namespace, and resolve to it.
        if not rosgraph.names.is_legal_name(request.name):
            raise ControlError(f"'{request.name}' is not a legal name of a controller")
        params = rospy.get_param(rospy.names.ns_join(self._namespace, request.name), None)
        self._know_type(params)
        with self._sim.lock:
            controller = self._manager.load(request.name, params)
        self._topics[request.name] = self._open(controller)
        return True

    def _know_type(self, params: object) -> None:
        """Imports a user's own type, without holding the simulator's lock: it may take a while."""
        kind = params.get("type") if isinstance(params, dict) else None
        if isinstance(kind, str) and kind not in self._manager.types:
            own = find_type(kind)
            if own is not None:
                self._manager.types[kind] = own

    def _open(self, controller: Controller) -> ControllerTopics:
        try:
            return ControllerTopics(self._sim, self._thinner, self._manager, controller, self._namespace)
        except faults() as error:  # from a user's outputs, inputs or pids
            with self._sim.lock:
                self._manager.unload(controller.name)
            raise ControlError(f"the topics of '{controller.name}': {error!r}") from error

    def _unload(self, request: srv.UnloadControllerRequest) -> bool:
        with self._sim.lock:
            self._manager.unload(request.name)
        self._topics.pop(request.name).shutdown()
        return True

    def _switch(self, request: srv.SwitchControllerRequest) -> bool:
        if request.strictness == 0:
            rospy.logwarn("Controller manager: strictness was not set, best effort is used.")
        with self._sim.lock:
            self._manager.switch(request.start_controllers, request.stop_controllers, request.strictness)
        return True

    def _reload(self, request: srv.ReloadControllerLibrariesRequest) -> bool:
        with self._sim.lock:
            loaded = [controller.name for controller in self._manager.loaded]
        if loaded and not request.force_kill:
            raise ControlError(f"Controllers {loaded} are loaded and force_kill is not set.")
        self._close_all()
        return True

    def _close_all(self) -> None:
        with self._sim.lock:
            self._manager.unload_all()
        for topics in self._topics.values():
            topics.shutdown()
        self._topics.clear()


def _report_fault(controller: Controller, error: BaseException) -> None:
    rospy.logerr(
        "Controller '%s' (%s) is stopped, because it raised:\n%s",
        controller.name, controller.type_name, "".join(traceback.format_exception(error)),
    )  # fmt: skip


def _state(controller: Controller) -> ControllerState:
    claims = [
        HardwareInterfaceResources(f"hardware_interface::{interface}", list(joints))
        for interface, joints in controller.claims.items()
    ]
    return ControllerState(controller.name, controller.state, controller.type_name, claims)
