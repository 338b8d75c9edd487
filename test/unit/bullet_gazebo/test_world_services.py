"""The XML-RPC method that the simulator answers beside a node's own: whatever its arguments are."""

import contextlib
import xmlrpc.client
from datetime import datetime

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bullet_gazebo.clients.gz import CHUNK
from bullet_gazebo.services.world_services import WorldControl
from robot_sim.physics.engines import make_engine
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator

# What XML-RPC can carry.
SIMPLE = (
    st.none() | st.booleans() | st.floats() | st.text(max_size=8) | st.binary(max_size=8)
    | st.integers(-(2**40), 2**40) | st.just(xmlrpc.client.Binary(b"x"))
    | st.just(xmlrpc.client.DateTime(datetime(2020, 1, 1)))
)  # fmt: skip
ANY = st.recursive(
    SIMPLE, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner)
)
COMMANDS = st.sampled_from(["step", "pause", "unpause", "reset", "reset_models", "reset_time"])
COUNTS = st.integers(-2, 3) | st.sampled_from([CHUNK + 1, 2**31 - 1, True, 1.0, 1.5, "1", b"1", None, [1]])


@pytest.fixture(scope="module")
def control():
    sim = Simulator(World(make_engine()))
    yield WorldControl(sim, contextlib.nullcontext(), {})
    sim.world.close()


@pytest.mark.parametrize("count", [1.5, 1.0, True, "1", None, [1], {"a": 1}, 0, -1, CHUNK + 1, 2**40])
def test_a_number_of_steps_that_is_none_is_refused_and_the_world_stays(control, count) -> None:
    before = control._sim.now
    code, text, value = control.answer("step", count)
    assert (code, value, control._sim.now) == (-1, 0, before)
    assert text


@pytest.mark.parametrize(
    "arguments", [(), ("step", 1, 1), (1,), (["step"],), ({},), (None, 1), ("x" * 10**6,)]
)
def test_what_is_no_command_is_refused(control, arguments) -> None:
    code, text, _ = control.answer(*arguments)
    assert code == -1
    assert 0 < len(text) < 200


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    st.tuples(COMMANDS, COUNTS) | st.lists(ANY, max_size=4).map(tuple)
    | st.tuples(COMMANDS | ANY) | st.tuples(COMMANDS, ANY)
)  # fmt: skip
def test_any_arguments_have_an_answer_that_xml_rpc_can_carry(control, arguments) -> None:
    code, text, value = control.answer(*arguments)
    assert code in (1, -1)
    answer = xmlrpc.client.dumps(((code, text, value),), methodresponse=True)
    assert xmlrpc.client.loads(answer)[0] == ([code, text, value],)
    assert control._sim.world.time_step == 0.001
