"""dynamic_reconfigure for a table of parameters, without a generated configuration class."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import rospy
from dynamic_reconfigure.encoding import Config, encode_config
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import ReconfigureRequest, ReconfigureResponse

GONE = "the parameters are gone"
FIRST = -1  # the level of the call at the start


class Parameter(NamedTuple):
    """One parameter; `kind` is double, int or bool. Requests are cut to least..most."""

    name: str
    kind: str
    default: Any
    least: Any
    most: Any
    description: str = ""


class DynamicServer(Server):
    """The service `set_parameters` and the latched topics `parameter_descriptions`, `parameter_updates`.

    `apply` is called with the wanted configuration and carries it out; what it returns is in force. At
    its first call, with the level FIRST, it returns the values to start with.
    """

    def __init__(
        self,
        parameters: Sequence[Parameter],
        apply: Callable[[Config, int], Config],
        namespace: str = "",
    ) -> None:
        self._kinds = [(parameter.kind, parameter.name) for parameter in parameters]
        super().__init__(_configuration(parameters), apply, namespace)

    def shutdown(self) -> None:
        """Takes service and topics away; the parameters stay on the server."""
        self.set_service.shutdown(GONE)
        self.descr_topic.unregister()
        self.update_topic.unregister()

    def _copy_from_parameter_server(self) -> None:
        """Not here: whoever is configured has read its parameters, and checked them, already."""

    def _set_callback(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Takes what is known by name and type, and leaves the rest, as the C++ server does."""
        groups = {
            "bool": request.config.bools,
            "int": request.config.ints,
            "double": request.config.doubles,
        }
        given = {(kind, p.name): p.value for kind, group in groups.items() for p in group}
        changes = {name: given[kind, name] for kind, name in self._kinds if (kind, name) in given}
        try:
            return ReconfigureResponse(encode_config(self.update_configuration(changes)))
        except (
            rospy.ROSException
        ) as fault:  # a client's connection outlives the service and its topics
            raise rospy.ServiceException(GONE) from fault


def _configuration(parameters: Sequence[Parameter]) -> SimpleNamespace:
    """What a generated configuration module holds."""
    described = [
        {"name": p.name, "type": p.kind, "level": 1, "description": p.description or p.name,
         "edit_method": ""}
        for p in parameters
    ]  # fmt: skip
    group = {"name": "Default", "id": 0, "parent": 0, "type": "", "state": True,
             "groups": [], "parameters": described}  # fmt: skip
    return SimpleNamespace(
        config_description=group,
        defaults=Config({p.name: p.default for p in parameters}),
        min=Config({p.name: p.least for p in parameters}),
        max=Config({p.name: p.most for p in parameters}),
    )
