"""dynamic_reconfigure for a table of parameters, without a generated configuration class."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import rospy
from dynamic_reconfigure.encoding import Config, encode_config
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import ReconfigureRequest, ReconfigureResponse

GONE = "the parameters are gone"
FIRST = -1  # the level of the first call


class Parameter(NamedTuple):
    """One parameter. `kind` is double, int or bool; requests are clipped to `least` and `most`."""

    name: str
    kind: str
    default: Any
    least: Any
    most: Any
    description: str = ""


class DynamicServer(Server):
    """The service `set_parameters` and the latched topics `parameter_descriptions`, `parameter_updates`.

    `apply` gets the requested configuration, carries it out, and returns the one in force. Its first call,
    with the level FIRST, asks for the initial values.
    """

    def __init__(
        self, parameters: Sequence[Parameter], apply: Callable[[Config, int], Config], namespace: str = ""
    ) -> None:
        self._kinds = [(parameter.kind, parameter.name) for parameter in parameters]
        super().__init__(_configuration(parameters), apply, namespace)

    def shutdown(self) -> None:
        """Closes the service and the topics; the parameters stay on the server."""
        self.set_service.shutdown(GONE)
        self.descr_topic.unregister()
        self.update_topic.unregister()

    def _copy_from_parameter_server(self) -> None:
        """Does nothing: the owner has read and checked its parameters already."""

    def _set_callback(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Takes the parameters whose name and type it knows, and leaves the rest, as the C++ server does."""
        sent = request.config
        groups = {"bool": sent.bools, "int": sent.ints, "double": sent.doubles}
        given = {(kind, p.name): p.value for kind, group in groups.items() for p in group}
        changes = {name: given[kind, name] for kind, name in self._kinds if (kind, name) in given}
        try:
            return ReconfigureResponse(encode_config(self.update_configuration(changes)))
        except rospy.ROSException as fault:  # a client's connection outlives service and topics
            raise rospy.ServiceException(GONE) from fault


def _configuration(parameters: Sequence[Parameter]) -> SimpleNamespace:
    """Returns the contents of a generated configuration module."""
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
