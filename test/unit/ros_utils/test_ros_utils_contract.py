"""The complete list of ros_utils' functions: names, orders and defaults of the arguments.

Additions are keyword-only, so that calls written for the list keep their meaning
(docs/contract/ros_utils.md 10).
"""

import inspect
import re
import socket
from pathlib import Path

import pytest

import ros_utils
from ros_utils import ros_gazebo, simulation

PAGE = Path(__file__).resolve().parents[3] / "docs/contract/ros_utils.md"
LIST = PAGE.read_text(encoding="utf-8").split("\n## 10 ")[1]
# A list as a default could be changed by a caller; an empty tuple means the same.
SIGNATURES = [
    (getattr(ros_utils, module), each.replace("controllers_list=[]", "controllers_list=()"))
    for module, block in re.findall(r"`(\w+)`:\n\n```\n(.*?)```", LIST, re.DOTALL)
    for each in block.splitlines()
]


@pytest.mark.parametrize(("module", "signature"), SIGNATURES, ids=[each for _, each in SIGNATURES])
def test_signature(module, signature):
    name = signature.split("(")[0]
    parameters = inspect.signature(getattr(module, name)).parameters.values()
    positional = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in parameters
        if parameter.kind not in (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.VAR_KEYWORD)
    ]
    assert f"{name}{inspect.Signature(positional)}" == signature


@pytest.mark.parametrize(
    "function", [getattr(ros_gazebo, name) for name in ros_gazebo.__all__ if name[0] == "g"]
)
def test_every_call_has_a_bound_and_a_simulator(function):
    parameters = inspect.signature(function).parameters.values()
    keywords = {each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY}
    for each in parameters:
        if each.kind is inspect.Parameter.VAR_KEYWORD:
            (declared,) = each.annotation.__args__  # of Unpack
            keywords |= declared.__annotations__.keys()
    assert {"timeout", "gazebo_ns"} <= keywords


def test_reserved_ports_differ_and_can_be_taken_by_a_master():
    ports = {simulation.reserved_port() for _ in range(20)}
    assert len(ports) == 20
    for port in ports:
        with socket.socket() as server:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as a ROS master does
            server.bind(("127.0.0.1", port))
