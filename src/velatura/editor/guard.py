"""Access to the editor's server, and time limits of connections."""

from __future__ import annotations

import asyncio
import json
import os
import re
import secrets
from typing import Any
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from velatura.errors import InvalidInput

#: The accepted Host headers; others are refused, since a foreign name may have been rebound here (DNS rebinding).
HOSTS = ("127.0.0.1", "localhost")

#: Holds the token where it is to outlive the server; other accounts cannot read it, as they can a command line.
VARIABLE = "VELATURA_TOKEN"

HEAD_TIME = 15  # seconds for the head of a request

#: Sources that the page may load: this server, and its own objects.
POLICY = {
    "default-src": "'self' blob: data:",
    "script-src": "'self'",
    "worker-src": "'self' blob:",
    "object-src": "'none'",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}

HEADERS = {
    "Content-Security-Policy": "; ".join(map(" ".join, POLICY.items())),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}


def token() -> str:
    """A token that cannot be guessed: that of the environment, or else a new one. Raises InvalidInput."""
    chosen = os.environ.get(VARIABLE) or secrets.token_urlsafe(32)
    if not re.fullmatch(r"[\w-]{16,128}", chosen, re.ASCII):
        raise InvalidInput(f"{VARIABLE}: must be 16 to 128 letters, digits, hyphens or underscores")
    return chosen


def cookie_name(port: int) -> str:
    """The cookie that holds the token; browsers send cookies to all ports of a host."""
    return f"velatura-{port}"


class JSON(JSONResponse):
    """JSON in ASCII, which holds any text, halves of surrogate pairs too."""

    def render(self, content: Any) -> bytes:
        return json.dumps(content, allow_nan=False).encode()


def refusal(status: int, reason: str) -> Response:
    """An answer of one line."""
    return JSON({"error": reason}, status)


class Guard:
    """Refuses requests to another host, from another origin, or without the token, WebSockets too.

    The token comes with the first address, `/?token=...`, and from then on in a cookie. Responses get `HEADERS`.
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app = app
        self.token = token
        self._ticket: str | None = None

    def ticket(self) -> str:
        """A token that is good for one address, once: other accounts see the command line of a browser."""
        self._ticket = secrets.token_urlsafe(32)
        return self._ticket

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        instead = None if scope["type"] == "lifespan" else self._instead(HTTPConnection(scope))
        if instead is None:
            await self.app(scope, receive, send_guarded)
        elif scope["type"] == "websocket":  # one that is closed before it is accepted is refused with 403
            await receive()
            await send({"type": "websocket.close"})
        else:
            await instead(scope, receive, send_guarded)

    def _instead(self, asked: HTTPConnection) -> Response | None:
        """The refusal of a request; None if it is admitted."""
        if not _from_here(asked.headers):
            return refusal(403, "the editor answers its own page alone")
        name = cookie_name(asked.scope["server"][1])
        known = self._is_token(asked.cookies.get(name, ""))
        offered = parse_qs(asked.scope["query_string"].decode("latin-1")).get("token", [""])[0]
        entrance = offered and asked.scope.get("method") == "GET" and asked.scope["path"] == "/"
        if entrance and (known or self._is_token(offered) or self._takes_ticket(offered)):
            entered = RedirectResponse("/", 303)  # browsers keep what follows #
            entered.set_cookie(name, self.token, httponly=True, samesite="strict")
            return entered
        return None if known else refusal(403, "the editor asks for its token: open the address that it has printed")

    def _is_token(self, offered: str) -> bool:
        return secrets.compare_digest(offered.encode(), self.token.encode())

    def _takes_ticket(self, offered: str) -> bool:
        if self._ticket is None or not secrets.compare_digest(offered.encode(), self._ticket.encode()):
            return False
        self._ticket = None
        return True


def _from_here(headers: Headers) -> bool:
    """Whether a request names this machine as its host, and comes from a page of this server, if from any."""
    hosts, origins = headers.getlist("host"), headers.getlist("origin")
    if len(hosts) != 1 or hosts[0].partition(":")[0] not in HOSTS:
        return False
    return origins in ([], [f"http://{hosts[0]}"]) and set(headers.getlist("sec-fetch-site")) <= {"same-origin", "none"}


class Connection(H11Protocol):
    """HTTP as uvicorn has it, but a connection ends where the head of its request is not there in time."""

    waiting: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._stop()

    def _watch(self) -> None:
        """Wait for a head, since the first byte of it or the connection's beginning.

        A request at work has a limit of its own, and a connection that has become a WebSocket has none.
        """
        upgraded = self.transport.get_protocol() is not self
        if upgraded or (self.cycle is not None and not self.cycle.response_complete):
            self._stop()
        elif self.waiting is None:
            self.waiting = self.loop.call_later(HEAD_TIME, self.transport.close)

    def _stop(self) -> None:
        if self.waiting is not None:
            self.waiting.cancel()
            self.waiting = None
