"""Who gets in: this machine's own browsers, or whoever has the token.

viser serves everybody who reaches the port. Other pages in the same browser reach it, too: they may open a
connection from anywhere to anywhere, and only say where they come from.
"""

import contextlib
import hmac
import http
from collections.abc import Callable, Iterator
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from web_page.address import Address, is_loopback

Answer = Callable[[Any, Request], Response | None]


class Gate:
    """Looks at each request before viser does."""

    def __init__(self, address: Address) -> None:
        self._token = address.token
        self._cookie = f"web_page_{address.port}"

    def refusal(self, request: Request) -> str:
        """Returns why the request is refused; empty where it isn't."""
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return "it comes from another page"
        if self._token:
            return "" if self._has_token(request) else "the address needs its token"
        # A name of somebody else's that leads to this machine is their page's.
        return "" if is_loopback(_name(host)) else "the page is at 127.0.0.1 only"

    def _has_token(self, request: Request) -> bool:
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        try:
            kept = SimpleCookie(request.headers.get("Cookie", "")).get(self._cookie)
        except CookieError:
            kept = None
        given += [kept.value] if kept is not None else []
        return any(hmac.compare_digest(each.encode(), self._token.encode()) for each in given)

    def guard(self, answer: Answer) -> Answer:
        """Returns `answer` for those who get in. The page's own connection comes with its cookie."""

        def guarded(connection: Any, request: Request) -> Response | None:
            refusal = self.refusal(request)
            if refusal:
                return Response(
                    http.HTTPStatus.FORBIDDEN, "Forbidden", Headers(), f"{refusal}\n".encode()
                )
            response = answer(connection, request)
            if self._token and response is not None:
                response.headers["Set-Cookie"] = (
                    f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
                )
            return response

        return guarded

    @contextlib.contextmanager
    def before_viser(self) -> Iterator[None]:
        """A server that viser starts in this block has this gate in front."""
        module = websockets.asyncio.server
        serve = module.serve

        def guarded(*arguments: Any, process_request: Answer, **options: Any) -> Any:
            return serve(*arguments, process_request=self.guard(process_request), **options)

        module.serve = guarded  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            module.serve = serve  # type: ignore[misc]


def _name(host: str) -> str:
    """The name in a Host header."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
