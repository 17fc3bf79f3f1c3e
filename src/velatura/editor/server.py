"""The editor's server: the page, its calls, and the files of one folder, for browsers of this machine alone."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
import webbrowser
from collections.abc import Mapping
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from velatura.editor import bundle
from velatura.editor.bodies import Answer, Body, Verb, field
from velatura.editor.folder import LARGEST, PICTURES, Conflict, Folder
from velatura.editor.service import VERBS
from velatura.errors import InvalidInput, VelaturaError
from velatura.stack.schema import unknown

#: Names of this machine; a foreign one leads here where somebody has rebound it, to have a browser ask on his behalf.
HOSTS = ("127.0.0.1", "localhost")

BUG = "the editor has failed, which is a mistake in it; the terminal says more"

#: What the page may load: from here alone, and what it makes itself; attributes of style are how it moves things about.
POLICY = {
    "default-src": "'self' blob: data:",
    "script-src": "'self'",
    "worker-src": "'self' blob:",
    "style-src-attr": "'unsafe-inline'",
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


def serve(material: str | None = None, port: int = 0, browse: bool = True) -> None:
    """Serve the editor from the working directory until interrupted.

    Args:
        material: a file or the name of a preset that the page is to show first.
        port: 0 for any that is free.
        browse: open the page in the user's browser.

    Raises:
        InvalidInput: not a valid material, or the port cannot be had.
        MissingTool: the page is missing.
    """
    app = application(material)
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOSTS[0], port))
        except OSError as error:
            raise InvalidInput(f"--port {port}: cannot be used ({error.strerror})") from None
        listening.listen()
        address = f"http://{HOSTS[0]}:{listening.getsockname()[1]}/"
        print(f"The editor is at {address} until you press Ctrl-C", flush=True)
        if browse:
            threading.Thread(target=webbrowser.open, args=[address], daemon=True).start()
        uvicorn.Server(settings(app)).run(sockets=[listening])


def settings(app: ASGIApp) -> uvicorn.Config:
    """How the application is run: quietly, and stopped within a second whatever is connected."""
    return uvicorn.Config(app, log_level="warning", ws_max_size=LARGEST, timeout_graceful_shutdown=1)


def application(material: str | None = None) -> ASGIApp:
    """The server as an ASGI application. Raises InvalidInput and MissingTool as `serve`."""
    folder = Folder()
    if material is not None:
        folder.first(material)  # refused now, before anything is served

    def session(body: Body) -> Answer:
        """With the material as its file is now; without, where that has been broken since the start."""
        try:
            opened = None if material is None else folder.first(material)
        except InvalidInput:
            opened = None
        return {**VERBS["session"](body), "opened": opened}

    verbs = {**VERBS, **folder.verbs, "session": session}

    async def call(request: Request) -> Response:
        name = request.path_params["verb"]
        if name not in verbs:
            return _refusal(404, f"there is no verb {name}")
        body = await _read(request)
        if body is None:
            return _refusal(413, f"a request may have {LARGEST >> 20} MiB at most")
        status, answer = await run_in_threadpool(_answer, verbs[name], body)
        return JSONResponse(answer, status)

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await Live(socket, verbs).run()

    def picture(request: Request) -> Response:
        try:
            return FileResponse(folder.existing(request.path_params["name"], PICTURES))
        except InvalidInput as error:
            return _refusal(404, str(error))

    routes = [
        Route("/api/{verb}", call, methods=["POST"]),
        WebSocketRoute("/api/live", live),
        Route("/files/{name:path}", picture),
        Mount("/", StaticFiles(directory=bundle.require(), html=True)),
    ]
    return Guard(Starlette(routes=routes, exception_handlers={500: lambda request, error: _refusal(500, BUG)}))


# Calls ---------------------------------------------------------------------------------------------------------------


async def _read(request: Request) -> bytes | None:
    """The body, or None where it is too large; one that says so is not read at all."""
    if int(request.headers.get("content-length", 0)) > LARGEST:
        return None
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > LARGEST:
            return None
    return bytes(body)


def _answer(verb: Verb, text: bytes) -> tuple[int, Answer]:
    """Status and answer of a call with the text of its body."""
    try:
        return 200, verb(_parsed(text))
    except VelaturaError as error:
        return 409 if isinstance(error, Conflict) else 422, {"error": str(error)}


def _parsed(text: bytes | str) -> dict[str, Any]:
    try:
        body = json.loads(text)
    except (ValueError, RecursionError):
        raise InvalidInput("the body is not valid JSON") from None
    if not isinstance(body, dict):
        raise InvalidInput("the body must be an object")
    return body


def _refusal(status: int, reason: str) -> Response:
    return JSONResponse({"error": reason}, status)


class Live:
    """Calls over a WebSocket, messages {id, verb, body}: of each verb one at a time, and after it the latest.

    A message that another of its verb overtakes while it waits is answered with an error, without being looked at.
    """

    def __init__(self, socket: WebSocket, verbs: Mapping[str, Verb]) -> None:
        self.socket = socket
        self.verbs = verbs
        self.waiting: dict[str, Answer] = {}
        self.tasks: dict[str, asyncio.Task[None]] = {}

    async def run(self) -> None:
        """Answer until the page goes away."""
        try:
            while True:
                await self.take(await self.socket.receive_text())
        except WebSocketDisconnect:
            for task in self.tasks.values():
                task.cancel()

    async def take(self, text: str) -> None:
        """Begin with a message, or let it wait in the place of the one that waits."""
        try:
            message = _parsed(text)
            verb = field(message, "verb", str)
            if verb not in self.verbs:
                raise InvalidInput(unknown("verb", verb, self.verbs))
        except InvalidInput as error:
            return await self.refuse({}, str(error))
        overtaken = self.waiting.pop(verb, None)
        self.waiting[verb] = message
        if overtaken:
            await self.refuse(overtaken, "overtaken by a later call")
        if verb not in self.tasks or self.tasks[verb].done():
            self.tasks[verb] = asyncio.create_task(self.work(verb))

    async def work(self, verb: str) -> None:
        """Answer what waits for a verb, until nothing does."""
        while message := self.waiting.pop(verb, None):
            try:
                body = field(message, "body", dict, {})
                answer = await run_in_threadpool(self.verbs[verb], body)
            except VelaturaError as error:
                await self.refuse(message, str(error))
            except Exception:
                await self.refuse(message, BUG)
                raise
            else:
                await self.socket.send_json({"id": message.get("id"), "answer": answer})

    async def refuse(self, message: Answer, reason: str) -> None:
        """Say why a message has no answer."""
        await self.socket.send_json({"id": message.get("id"), "error": reason})


# Strangers -----------------------------------------------------------------------------------------------------------


class Guard:
    """Refuses requests to another host and from another origin, WebSockets too, and adds headers to every response."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        app = self.app if scope["type"] == "lifespan" or _welcome(Headers(scope=scope)) else self.refuse
        await app(scope, receive, send_guarded)

    async def refuse(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a stranger; a WebSocket that is closed before it is accepted is refused with 403."""
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close"})
        else:
            await _refusal(403, "the editor answers its own page alone")(scope, receive, send)


def _welcome(headers: Headers) -> bool:
    """Whether a request is to this machine by its own name, and from a page of this very server, if from any."""
    host, origin = headers.get("host", ""), headers.get("origin")
    return host.partition(":")[0] in HOSTS and origin in (None, f"http://{host}")
