"""A step's request is written as genpy writes it, whatever was written before."""

import io
import struct

import pytest
from bullet_gazebo_msgs.srv import StepWorldRequest

from robot_envs.backends.ros.wire.messages import ask_for
from robot_envs.backends.ros.wire.step_request import StepRequest
from robot_envs.world_state import LinkQuery, StateQuery


def written(request):
    buffer = io.BytesIO()
    request.serialize(buffer)
    return buffer.getvalue()


def test_its_bytes_are_genpys():
    ours = StepRequest(8)
    query = StateQuery()
    for names, numbers in (
        (("/a/cart", "/b/arm"), [0.5, -0.0, 1e-300]),
        (("/a/cart",), [2.0]),
        (("/a/cart", "/b/arm"), [float("nan"), 1.0, 3.0]),
        ((), []),
        (("/ä",), list(map(float, range(300)))),
    ):
        for asked in (
            query,
            StateQuery(links=(LinkQuery("arm::hand", "arm::base"),), all_models=True),
        ):
            ours.ask_for(asked)
            genpys = StepWorldRequest(ticks=8)
            ask_for(genpys, asked)
            for factor in (1.0, 2.0):
                genpys.controllers, genpys.commands = (
                    list(names),
                    [factor * each for each in numbers],
                )
                ours.command(names, genpys.commands)
                assert written(ours) == written(genpys)


def test_what_is_no_number_is_refused():
    ours = StepRequest(8)
    ours.command(("/a",), ["much"])
    with pytest.raises(struct.error):
        written(ours)
