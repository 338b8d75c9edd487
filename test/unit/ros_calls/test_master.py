"""XML-RPC with a time limit, and the master that is asked."""

import contextlib
import socket
import threading
import time

import pytest

from ros_calls import master as ros_master

LIMIT = 0.3  # [s]


@pytest.fixture
def master(other_master):
    with ros_master.using(other_master.uri):
        yield other_master


@contextlib.contextmanager
def listening(serve):
    """The address of a server that is no master."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def work():
            with contextlib.suppress(OSError):  # closed
                while True:
                    with server.accept()[0] as client:
                        serve(client)

        threading.Thread(target=work, daemon=True).start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)


def test_an_answer_is_its_value(master):
    assert ros_master.call_node(master.uri, "getPid") == 1
    master.services["/a"] = "rosrpc://here:1"
    assert ros_master.call("lookupService", "/a") == "rosrpc://here:1"


def test_no_is_an_answer(master):
    with pytest.raises(ros_master.Refused, match="unknown"):
        ros_master.call("lookupService", "/a")


@pytest.mark.parametrize("method", ["unknown", "nonsense"])
def test_what_is_not_ross_way(master, method):
    with pytest.raises(ros_master.BadAnswer):
        ros_master.call_node(master.uri, method, "a")


def test_nobody_listens(nobody_listens):
    with pytest.raises(ros_master.NobodyListens, match="Connection refused"):
        ros_master.call_node(nobody_listens, "getPid")
    with ros_master.using(nobody_listens):
        assert not ros_master.is_up()
        assert not ros_master.is_up_or_startable()


def test_a_server_that_says_nothing(nobody_answers):
    begin = time.monotonic()
    with pytest.raises(ros_master.NoAnswer, match=r"no answer within 0.3 s"):
        ros_master.call_node(nobody_answers, "getPid", timeout=LIMIT)
    assert time.monotonic() - begin >= LIMIT
    with (
        ros_master.using(nobody_answers),
        pytest.raises(ros_master.MasterDown, match="port is in use, and not by a ROS master"),
    ):
        ros_master.is_up_or_startable()


@pytest.mark.parametrize("answer", [b"", b"220 mail.example.com ESMTP\r\n"])
def test_a_server_of_another_kind(answer):
    def serve(client):
        client.recv(4096)
        client.sendall(answer)

    with listening(serve) as uri, pytest.raises(ros_master.NoAnswer):
        ros_master.call_node(uri, "getPid", timeout=LIMIT)


@pytest.mark.parametrize("uri", ["", "localhost", "http://", "http://host:port", "http://host"])
def test_an_address_that_is_none(uri, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    with pytest.raises(ros_master.MasterDown, match="ROS_MASTER_URI is "):
        ros_master.require()
    assert not ros_master.is_up()


def test_another_master_is_for_the_block_and_the_thread_only(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://here:1")
    seen = []
    with ros_master.using("http://there:2"):
        thread = threading.Thread(target=lambda: seen.append(ros_master.uri()))
        thread.start()
        thread.join()
        with ros_master.using(None):
            assert ros_master.uri() == "http://there:2"
    assert (seen, ros_master.uri()) == (["http://here:1"], "http://here:1")


def test_a_node_that_answers_lives(master, other_master) -> None:
    assert ros_master.living_address("/gazebo") is None
    master.nodes["/gazebo"] = other_master.uri
    assert ros_master.living_address("/gazebo") == other_master.uri
    other_master.told.update(getName="/gazebo", getMasterUri=master.uri)
    assert ros_master.living_address("/gazebo") == other_master.uri


@pytest.mark.parametrize("kind", ["nobody_listens", "nobody_answers"])
def test_one_that_was_killed_does_not_nor_one_that_says_nothing(master, kind, request) -> None:
    master.nodes["/gazebo"] = request.getfixturevalue(kind)
    assert ros_master.living_address("/gazebo", timeout=0.2) is None


@pytest.mark.parametrize(
    "told", [{"getName": "/talker"}, {"getName": "/gazebo", "getMasterUri": "http://127.0.0.1:1"}]
)
def test_its_port_may_belong_to_another_node_now(master, other_master, told) -> None:
    master.nodes["/gazebo"] = other_master.uri
    other_master.told.update(told)
    assert ros_master.living_address("/gazebo") is None


def test_a_master_that_is_away_is_not_a_node_that_is(monkeypatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    with pytest.raises(ros_master.NoAnswer):
        ros_master.living_address("/gazebo")
