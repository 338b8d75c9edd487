"""A viser server behind a gate, without viser's console output or its tunnel to the internet.

viser serves everybody who reaches the port. Pages of other sites in the same browser reach it too: a
browser lets them connect anywhere and only reports where they come from. So `Gate` checks each request.
"""

import asyncio
import contextlib
import gzip
import hmac
import http
import io
import secrets
import threading
import webbrowser
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from typing import Annotated, Any, Union
from urllib.parse import parse_qs, urlsplit

import msgspec
import viser
import websockets.asyncio.server
from viser import _messages as messages
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from web_viewer import keys
from web_viewer.address import FIRST_PORT, LOOPBACK, Address, PortInUse, check, has_display, is_loopback

Answer = Callable[[Any, Request], Response | None]
Say = Callable[[str], object]
TOKEN_BYTES = 16
HTML, BEFORE_PROGRAM = "text/html", b"</title>"  # the program that follows is most of the page
# Words that go when the program has drawn something. On a telephone viser lays its panel over the scene: here
# the panel stands below, and the scene has what is left.
HEAD = b"""
<style>
body:has(#root > *) > #loading { display: none; }
@media (max-width: 36em) {
  :has(> .mantine-Paper-root > div > .mantine-ScrollArea-root) { flex-direction: column; }
  .mantine-Paper-root:has(> div > .mantine-ScrollArea-root) {
    position: static !important; width: 100% !important; max-height: 45% !important; flex-shrink: 0;
  }
  .mantine-ScrollArea-content > div { width: 100% !important; }
}
</style>
<p id="loading" style="font-family: sans-serif; padding: 1em">The page is loading ...</p>
"""
Point = tuple[float, float, float]  # [m]


class Gate:
    """Admits this machine's own browsers, or, beyond loopback, requests that carry the token."""

    def __init__(self, token: str) -> None:
        self._token = token
        self._cookie = f"viewer_{token[:4]}"  # pages on other ports have others

    def refusal(self, request: Request) -> str:
        """Returns why the request is refused; empty if it is admitted."""
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return "it comes from another page"
        if self._token:
            return "" if self._has_token(request) else "the address needs its token"
        # A foreign name that resolves to this machine belongs to a foreign page (DNS rebinding).
        name = urlsplit(f"//{host}").hostname or ""
        return "" if is_loopback(name) else "the page is at 127.0.0.1 only"

    def _has_token(self, request: Request) -> bool:
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        try:
            kept = SimpleCookie(request.headers.get("Cookie", "")).get(self._cookie)
        except CookieError:
            kept = None
        given += [kept.value] if kept is not None else []
        return any(hmac.compare_digest(each.encode(), self._token.encode()) for each in given)

    def guard(self, answer: Answer) -> Answer:
        """Wraps `answer` in the check; the answer sets the cookie that the page's websocket sends."""

        def guarded(connection: Any, request: Request) -> Response | None:
            try:
                refusal = self.refusal(request)
                if refusal:
                    return _said(http.HTTPStatus.FORBIDDEN, refusal)
                response = answer(connection, request)
            except (LookupError, ValueError, OSError):  # two hosts, a path that is no file's, ...
                return _said(http.HTTPStatus.BAD_REQUEST, "it is no browser's request")
            if response is not None and response.headers.get("Content-Type", "").startswith(HTML):
                _add_head(response)
            if self._token and response is not None:
                response.headers["Set-Cookie"] = (
                    f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
                )
            return response

        return guarded


def _add_head(response: Response) -> None:
    """Has viser's page say that it is loading until its program runs, and fit a telephone."""
    packed = response.headers.get("Content-Encoding") == "gzip"
    body = gzip.decompress(response.body) if packed else response.body
    body = body.replace(BEFORE_PROGRAM, BEFORE_PROGRAM + HEAD + keys.SCRIPT, 1)
    response.body = gzip.compress(body, 1) if packed else body
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))


def _said(status: http.HTTPStatus, text: str) -> Response:
    return Response(status, status.phrase, Headers(), f"{text}\n".encode())


# What pages of ours send, by the names of viser's messages; for a field's value see `can_be`.
Number = Annotated[float, msgspec.Meta(ge=-(2.0**53), le=2.0**53)]  # whose integers are exact
Side = Annotated[int, msgspec.Meta(ge=0, le=2**14)]  # [pixels]
Vector = tuple[Number, Number, Number]


class Value(msgspec.Struct, forbid_unknown_fields=True):
    value: Any


class GuiUpdateMessage(msgspec.Struct, tag=True, forbid_unknown_fields=True):
    uuid: str
    updates: Value


class ViewerCameraMessage(msgspec.Struct, tag=True, forbid_unknown_fields=True):
    wxyz: tuple[Number, Number, Number, Number]
    position: Vector
    look_at: Vector
    up_direction: Vector
    fov: Number
    near: Number
    far: Number
    image_height: Side
    image_width: Side


class GetRenderResponseMessage(msgspec.Struct, tag=True, forbid_unknown_fields=True):
    payload: bytes
    render_uuid: str


class CommandTriggerMessage(msgspec.Struct, tag=True, forbid_unknown_fields=True):
    uuid: str


USED_KINDS = (GuiUpdateMessage, ViewerCameraMessage, GetRenderResponseMessage, CommandTriggerMessage)
USED: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Union[USED_KINDS])  # noqa: UP007


def is_used(raw: Any) -> bool:
    """Returns whether a page's message is one that pages of ours send.

    Args:
        raw: From the websocket. viser also takes files, forms, clicks, ..., and trusts them.
    """
    try:
        USED.decode(raw)
    except (msgspec.MsgspecError, TypeError, RecursionError):
        return False
    return True


def can_be(props: object, value: Any) -> bool:
    """Returns whether a field's options or bounds admit a value: viser casts it, and takes any."""
    if hasattr(props, "options"):
        return value in props.options
    if hasattr(props, "min") and hasattr(props, "max"):
        return type(value) in (int, float) and bool(props.min <= value <= props.max)
    return True


def _check_fields(server: viser.ViserServer) -> None:
    """Drops values that a field doesn't admit; viser would pass them on to programs and other pages."""
    gui, pages = server.gui, server._websock_server
    pages.unregister_handler(messages.GuiUpdateMessage, gui._handle_gui_updates)

    async def checked(client: Any, message: messages.GuiUpdateMessage) -> None:
        field = gui._gui_input_handle_from_uuid.get(message.uuid)
        if field is not None and can_be(field._impl.props, message.updates["value"]):
            await gui._handle_gui_updates(client, message)

    pages.register_handler(messages.GuiUpdateMessage, checked)


class LoopEvent(asyncio.Event):
    """An event that only its loop's thread sets; viser asks the loop for it as well.

    In another thread asyncio's `set` raises while a page comes or goes, and wakes no one.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._owner = loop

    def set(self) -> None:
        """Sets it, in the loop's thread."""
        if asyncio._get_running_loop() is self._owner:
            super().set()


class SafeBuffer(AsyncMessageBuffer):
    """viser's buffer of messages, which any thread may fill while pages wait for it."""

    def __init__(self, event_loop: asyncio.AbstractEventLoop, persistent_messages: bool) -> None:
        super().__init__(event_loop, persistent_messages, LoopEvent(event_loop))


setattr(_infra, "AsyncMessageBuffer", SafeBuffer)  # noqa: B010 - it is no public name


class Door(websockets.asyncio.server.ServerConnection):
    """A page's connection that drops all but the messages that are used here."""

    async def recv(self, decode: bool | None = None) -> Any:
        """Waits for the next message that is used; see the base class."""
        while not is_used(raw := await super().recv(decode)):
            pass
        return raw


def _start(host: str, port: int, title: str, gate: Gate) -> viser.ViserServer:
    """Starts viser with a gate in front, on that port or a later one; viser has no public hook for a gate."""
    module = websockets.asyncio.server
    serve_anyone = module.serve

    def serve_guarded(*arguments: Any, process_request: Answer, **options: Any) -> Any:
        guard = gate.guard(process_request)
        return serve_anyone(*arguments, process_request=guard, create_connection=Door, **options)

    module.serve = serve_guarded  # type: ignore[assignment,misc]
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return viser.ViserServer(host, port, label=title, verbose=False)
    finally:
        module.serve = serve_anyone  # type: ignore[misc]


class ServedPage:
    """A page that threads of its own serve until `close`.

    Args:
        title: Of the page.
        camera: Where visitors look from [m].
        look_at: What they look at [m].
        host: The address to bind to.
        port: The port; None for the first free one from FIRST_PORT on.

    Raises:
        PortInUse: If nothing can be served there.
    """

    def __init__(
        self, title: str, camera: Point, look_at: Point, host: str = LOOPBACK, port: int | None = None
    ) -> None:
        check(host, port)
        token = "" if is_loopback(host) else secrets.token_urlsafe(TOKEN_BYTES)
        self.server = _start(host, FIRST_PORT if port is None else port, title, Gate(token))
        self.address = Address(host, self.server.get_port(), token)
        if port and port != self.address.port:
            self.close()
            raise PortInUse(f"another process has just taken port {port}; start again")
        _check_fields(self.server)
        self.server.gui.main_panel.dock_right()
        self.server.gui.configure_theme(control_width="medium", show_logo=False, show_share_button=False)
        self.server.initial_camera.position = camera
        self.server.initial_camera.look_at = look_at

    def announce(self, what: str, power: str, say: Say, warn: Say, browser: bool) -> list[str]:
        """Says where the page is, in the lines that it returns; see `Address.advice`.

        With `browser`, opens it on this machine, if it has a display; `warn` receives a line if that fails.
        """
        lines = self.address.advice(what, power)
        for line in lines:
            say(line)
        if browser and has_display():  # some browsers block until the user closes them
            threading.Thread(target=self._open, args=(warn,), daemon=True).start()
        return lines

    def _open(self, warn: Say) -> None:
        try:
            opened = webbrowser.open(self.address.url)
        except webbrowser.Error:
            opened = False
        if not opened:
            warn(f"no browser could be opened here; open {self.address.url} in one")

    def close(self) -> None:
        """Stops serving it."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()
