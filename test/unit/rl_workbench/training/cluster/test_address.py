"""Addresses where no cluster is: one line, found out without Ray."""

import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster import address
from rl_workbench.training.cluster.address import check_address

Answering = Callable[[bytes], str]


@pytest.fixture
def answering() -> Iterator[Answering]:
    """Makes a server that says something to the first who comes, and goes; returns its address."""
    threads: list[threading.Thread] = []

    def made(words: bytes) -> str:
        server = socket.create_server(("127.0.0.1", 0))

        def answer() -> None:
            with server, server.accept()[0] as connection:
                connection.recv(100)
                connection.sendall(words)

        threads.append(threading.Thread(target=answer))
        threads[-1].start()
        return f"127.0.0.1:{server.getsockname()[1]}"

    yield made
    for thread in threads:
        thread.join()


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ("nonsense", "names a cluster by its head's HOST:PORT"),
        ("ray://127.0.0.1:10001", "names a cluster by its head's HOST:PORT"),
        ("127.0.0.1:99999", "names a cluster by its head's HOST:PORT"),
        ("127.0.0.1:\N{SUPERSCRIPT TWO}", "names a cluster by its head's HOST:PORT"),
        (":6379", "names a cluster by its head's HOST:PORT"),
        (f"{'a' * 70}:6379", "no Ray cluster answers at a{70}:6379: .*label"),
        ("a..b:6379", "no Ray cluster answers at a..b:6379: "),
        ("127.0.0.1:1", "no Ray cluster answers at 127.0.0.1:1: Connection refused"),
    ],
)
def test_where_nobody_is(given: str, line: str) -> None:
    with pytest.raises(WorkbenchError, match=line) as raised:
        check_address(given)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "words", [b"SSH-2.0-OpenSSH_9.2\r\n", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"+OK", b""]
)
def test_where_something_else_is(answering: Answering, words: bytes) -> None:
    with pytest.raises(WorkbenchError, match="^what answers at .* is no Ray cluster's head"):
        check_address(answering(words))


def test_where_something_listens_and_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(address, "PATIENCE", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        where = f"127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(WorkbenchError, match=f"^no Ray cluster answers at {where}: timed out$"):
            check_address(where)


def test_a_head_may_be_there(answering: Answering) -> None:
    check_address(answering(bytes(3) + b"\x04" + bytes(5)))


@pytest.mark.extras("ray")
def test_a_machine_without_a_cluster(monkeypatch: pytest.MonkeyPatch) -> None:
    from ray._private import services

    from rl_workbench.training.cluster.head import head_of_this_machine

    monkeypatch.setattr(services, "canonicalize_bootstrap_address", lambda *_, **__: None)
    for found in (set(), {"10.0.0.1:6379", "10.0.0.2:6379"}):
        monkeypatch.setattr(services, "find_gcs_addresses", lambda found=found: found)
        with pytest.raises(
            WorkbenchError, match="^--ray auto: this machine belongs to no Ray cluster"
        ):
            head_of_this_machine()


@pytest.mark.extras("ray")
@pytest.mark.parametrize(
    ("code", "line"),
    [
        (
            "UNAUTHENTICATED",
            "^can't join the Ray cluster at .*: its token is another than this machine's",
        ),
        ("UNIMPLEMENTED", "^what answers at .* is no Ray cluster's head"),
        ("UNAVAILABLE", "^no Ray cluster answers at .*: Not now."),
    ],
)
def test_what_speaks_as_a_head_does_and_refuses(code: str, line: str) -> None:
    """Another port of Ray's, or another token."""
    import grpc

    from rl_workbench.training.cluster.head import check_head

    class Refusing(grpc.GenericRpcHandler):
        def service(self, details: grpc.HandlerCallDetails) -> grpc.RpcMethodHandler:
            def refuse(request: bytes, context: grpc.ServicerContext) -> bytes:
                context.abort(grpc.StatusCode[code], "Not now.\nPages.")

            return grpc.unary_unary_rpc_method_handler(refuse)

    server = grpc.server(ThreadPoolExecutor(1), handlers=[Refusing()])
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    try:
        with pytest.raises(WorkbenchError, match=line) as raised:
            check_head(f"127.0.0.1:{port}")
    finally:
        server.stop(None).wait()
    assert "\n" not in str(raised.value)


@pytest.mark.extras("ray")
@pytest.mark.usefixtures("signals")
@pytest.mark.parametrize("command", [
    ["benchmark", "--seeds", "1"],
])  # fmt: skip
def test_a_command_says_it_in_one_line(
    command: list[str],
    tmp_path,
    monkeypatch,
    capsys: pytest.CaptureFixture[str],
    answering: Answering,
) -> None:
    monkeypatch.chdir(tmp_path)
    place = ["--out", str(tmp_path / "out")] if command[0] == "benchmark" else []
    for where in ("127.0.0.1:1", "", answering(b"SSH-2.0-OpenSSH_9.2\r\n")):
        assert cli.main([*command, *place, "--ray", where]) == 1
        said = capsys.readouterr().err.splitlines()
        assert len(said) == 1 and where in said[0] and said[0].startswith("rl-workbench"), said
