"""Where a page is, and who gets in."""

import asyncio
import dataclasses
import gzip
import socket
import threading
import urllib.request
from contextlib import closing
from importlib.metadata import version

import msgspec
import pytest
from support.pages.browser import wait_for
from viser import _messages as messages
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.sync.client import connect

from web_viewer.address import Address, PortInUse, check
from web_viewer.server import USED_KINDS, Gate, ServedPage, is_used

TOKEN, COOKIE = "a-token", "viewer_a-to"
WINDOW = ("the window", "moves the simulation")
LOOKING = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)  # [m]


@pytest.fixture
def taken():
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        yield held.getsockname()[1]


def ask(gate, path="/", **headers):
    """What a request is answered: a refusal, or what stands behind the gate."""
    named = Headers({key.title().replace("_", "-"): value for key, value in headers.items()})
    behind = Response(200, "OK", Headers(), b"the page")
    return gate.guard(lambda connection, request: behind)(None, Request(path, named))


def test_a_port_in_use_is_one_line(taken):
    with pytest.raises(PortInUse, match=rf"port {taken}: Address already in use.*--port"):
        check("127.0.0.1", taken)


@pytest.mark.parametrize(
    ("host", "port"),
    [("127.0.0.1", -1), ("127.0.0.1", 70000), ("192.0.2.1", 0), ("no.such.host.invalid", 0)]
    + [(each, None) for each in ("a..b", ".", "a" * 64, "é" * 64, "", "\udcff", "[::1]")],
)
def test_where_no_page_can_be_is_one_line(host, port):
    with pytest.raises(PortInUse, match="can't be served on .*--host, --port") as refused:
        check(host, port)
    assert "\n" not in str(refused.value)


def test_a_free_port_is_found(page):
    found = page.address
    assert found.port >= 8080
    assert not found.token
    assert found.url == f"http://127.0.0.1:{found.port}/"
    with closing(ServedPage("another", *LOOKING)) as another:
        assert another.address.port > found.port


def test_this_machine_needs_no_token_and_no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    told = "\n".join(Address("127.0.0.1", 8081).advice(*WINDOW))
    assert "http://127.0.0.1:8081/" in told
    assert "ssh -N -L 8081:127.0.0.1:8081" in told
    monkeypatch.setenv("DISPLAY", ":0")
    assert "ssh" not in "\n".join(Address("127.0.0.1", 8081).advice(*WINDOW))


def test_other_machines_need_a_token_and_that_is_said():
    with closing(ServedPage("a page", *LOOKING, "0.0.0.0", 0)) as page:
        found = page.address
    assert len(found.token) > 16
    assert found.url.endswith(f"/?token={found.token}")
    assert "anybody who has this address" in "\n".join(found.advice(*WINDOW))
    assert found.token not in repr(found)


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:9", "[::1]:8080", "127.0.0.1"])
def test_this_machines_browsers_get_in(host):
    gate = Gate("")
    assert ask(gate, host=host).status_code == 200
    upgrade = {"upgrade": "websocket", "host": host}
    assert ask(gate, **upgrade, origin=f"http://{host}").status_code == 200
    assert ask(gate, **upgrade, origin="http://elsewhere.example").status_code == 403
    assert ask(gate, **upgrade, origin="null").status_code == 403


@pytest.mark.parametrize("host", ["elsewhere.example:8080", "", "127.0.0.1.elsewhere.example"])
def test_a_name_that_leads_here_is_refused(host):
    gate = Gate("")
    assert ask(gate, host=host).status_code == 403
    assert ask(gate, host="[").status_code == 400


def test_without_the_token_nobody_gets_in():
    gate = Gate(TOKEN)
    host = "robot:8080"
    for path in ("/", "/?token=", "/?token=b", "/?token=ä", f"/?x={TOKEN}"):
        assert ask(gate, path, host=host).status_code == 403
        assert ask(gate, path, host=host, upgrade="websocket").status_code == 403
    for cookie in ("", f"{COOKIE}=b", f"viewer_8081={TOKEN}", "=;="):
        assert ask(gate, host=host, cookie=cookie).status_code == 403
    answer = ask(gate, f"/?token={TOKEN}", host=host)
    assert answer.status_code == 200
    cookie = answer.headers["Set-Cookie"].partition(";")[0]
    assert ask(gate, host=host, cookie=cookie, origin=f"http://{host}").status_code == 200
    assert ask(gate, host=host, cookie=cookie, origin="http://other").status_code == 403


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/?token=\udcff", []), ("//[", []), ("http://[/", []),
        ("/", [("Origin", "http://[")]), ("/", [("Origin", "http://[::1")]),
        ("/", [("Host", "127.0.0.1")]), ("/", 2 * [("Origin", "http://a")]), ("/", 2 * [("Cookie", "a=1")]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("token", ["", TOKEN])
def test_no_request_is_an_error_of_the_page(token, path, headers):
    named = Headers([("Host", "127.0.0.1:8080"), *headers])
    guarded = Gate(token).guard(lambda connection, request: Response(404, "Not Found", Headers()))
    assert guarded(None, Request(path, named)).status_code in (400, 403, 404)


@pytest.fixture
def page():
    with closing(ServedPage("a page", *LOOKING)) as made:
        yield made


@pytest.fixture
def server(page):
    return page.server


CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3.0, 0, 1], "fov": 1.0, "near": 0.01,
    "far": 1000.0, "image_height": 600, "image_width": 800, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip


UPLOAD = {
    "type": "FileTransferStartUpload", "source_component_uuid": "", "transfer_uuid": "t", "filename": "x",
    "mime_type": "y", "part_count": 0, "size_bytes": 0,
}  # fmt: skip
ODD_CAMERAS = (  # that can't be calculated with
    {"position": "far"}, {"position": [1, 2]}, {"position": [1, 2, "3"]}, {"look_at": None},
    {"position": [1e300, 0, 0]}, {"wxyz": [float("nan"), 0, 0, 1]}, {"fov": "1"}, {"far": []},
    {"up_direction": [[1], [2], [3]]}, {"image_height": 10**9}, {"image_width": -1}, {"fov": True},
)  # fmt: skip
encoded = msgspec.msgpack.encode


@pytest.fixture
def browser(server):
    """The connection of a page."""
    address, protocol = f"ws://127.0.0.1:{server.get_port()}", f"viser-v{version('viser')}"
    with connect(address, subprotocols=[protocol], max_size=None) as made:
        made.send(encoded(CAMERA))
        yield made


def test_only_messages_of_our_pages_come_in(server, browser):
    """A file of no parts would set the field whose id it names."""
    box = server.gui.add_checkbox("c", False)
    change = {"type": "GuiUpdateMessage", "uuid": box._impl.uuid, "updates": {"value": True}}
    odd_updates = ({"visible": False}, {"value": True, "order": 1.0}, 7)
    bad = [
        UPLOAD | {"source_component_uuid": box._impl.uuid},
        {"type": "ShareUrlRequest"},
        {"type": "GuiUpdateMessage"},
        *({**change, "updates": each} for each in odd_updates),
        *(CAMERA | each for each in ODD_CAMERAS),
        {"type": []},
        7,
        {},
    ]
    dropped = [*map(encoded, bad), b"", b"\xc1", 5000 * b"\x91", "a text"]
    assert is_used(encoded(change)) and is_used(encoded(CAMERA)) and not any(map(is_used, dropped))
    for message in [*dropped, encoded(change)]:
        browser.send(message)
    wait_for(lambda: box.value is True, "change")


def test_what_pages_send_has_the_fields_of_visers_messages():
    for kind in USED_KINDS:
        theirs = getattr(messages, kind.__name__)
        assert set(kind.__struct_fields__) == {each.name for each in dataclasses.fields(theirs)}


def test_a_field_takes_only_what_its_options_and_bounds_admit(server, browser):
    """A speed that isn't offered, and a step below the first, would end a program that looks them up."""
    gui, seen = server.gui, []
    speed, step = gui.add_dropdown("d", ["1 x", "2 x"]), gui.add_slider("s", 0, 9, 1, 5)
    for field in (speed, step):
        field.on_update(lambda event: seen.append(event.target.value))
    for field, value in (
        (speed, "unknown"), (speed, 3), (speed, None), (step, -9999), (step, 10), (step, float("nan")),
        (step, "7"), (step, None), (speed, "2 x"), (step, 7),
    ):  # fmt: skip
        update = {"uuid": field._impl.uuid, "updates": {"value": value}}
        browser.send(encoded({"type": "GuiUpdateMessage", **update}))
    wait_for(lambda: step.value == 7, "last change")
    assert speed.value == "2 x" and set(seen) <= {"2 x", 7}


def test_a_drawing_thread_leaves_it_to_the_pages_thread_to_wake_them(server):
    """asyncio's event, set while its thread removes a page that waits, raises in the thread that draws."""
    buffer = server._websock_server._broadcast_buffer
    woken, busy, released = [], threading.Event(), threading.Event()

    async def read(number):
        async for window in buffer.window_generator(number):
            woken.append(len(window))

    def block():
        busy.set()
        assert released.wait(60.0)

    for number in range(3):
        asyncio.run_coroutine_threadsafe(read(1000 + number), buffer.event_loop)
    wait_for(lambda: len(buffer.message_event._waiters) == 3, "readers")
    woken.clear()
    buffer.event_loop.call_soon_threadsafe(block)
    assert busy.wait(60.0)
    server.scene.add_frame("/moved")
    touched = [each.done() for each in buffer.message_event._waiters]
    released.set()
    assert touched == [False] * 3
    wait_for(lambda: len(woken) >= 3, "readers that woke")


@pytest.mark.parametrize("encoding", ["gzip", "identity"])
def test_a_page_says_that_it_is_loading(server, encoding):
    request = urllib.request.Request(
        f"http://127.0.0.1:{server.get_port()}/", headers={"Accept-Encoding": encoding}
    )
    with urllib.request.urlopen(request, timeout=60.0) as answer:
        body = answer.read()
    text = gzip.decompress(body) if encoding == "gzip" else body
    assert b"The page is loading" in text
