"""The editor's server: the page, its calls, and the files of one folder, for browsers of this machine alone."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import logging
import socket
import sys
import tempfile
import threading
import webbrowser
from collections import Counter
from collections.abc import Callable, Mapping
from typing import IO, Any

import anyio
import uvicorn
from anyio.to_thread import run_sync
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from velatura import kernel
from velatura.editor import bundle, guard
from velatura.editor.folder import LARGEST, Conflict, Folder
from velatura.editor.guard import Guard, refusal
from velatura.editor.messages import Answer, Body, Verb, field
from velatura.editor.rendering import Renderings
from velatura.editor.service import VERBS
from velatura.errors import InvalidInput, VelaturaError
from velatura.stack.schema import unknown

BUG = "the editor has failed, which is a mistake in it; the terminal shows details"
BUSY = "the editor is busy with other calls like this one; ask again later"

SMALL = 2**20  # bytes of a message, and of every request but these:
MOST_OF = {"texture": LARGEST, "import": LARGEST, "render": 2 * LARGEST, "truth": 2 * LARGEST}
IN_MEMORY = 2**16  # bytes of a request; a larger one is kept in a file until all of it is there
BODY_TIME, ANSWER_TIME = 60, 60  # seconds for the body of a request, and for its answer

#: Calls that are answered at once, and those that may wait: none waits for those of another kind.
LANES = {"quick": (4, 512), "picture": (2, 64), "slow": (4, 32)}
SPARE = 4  # threads of a kind beside these, for answers that were given up, which go on until they end
LANE_OF = {
    **dict.fromkeys(("shader", "values", "appearance", "wishes"), "picture"),
    **dict.fromkeys(("invert", "ways", "wish", "stock", "class", "member", "coat", "targets"), "slow"),
    **dict.fromkeys(("truth", "validation", "film", "export", "import", "render"), "slow"),
}


def serve(material: str | None = None, port: int = 0, browse: bool = True) -> None:
    """Serve the editor from the working directory until interrupted.

    Args:
        material: a file or the name of a preset that the page is to show first.
        port: 0 for any that is free.
        browse: open the page in the user's browser.

    Raises:
        InvalidInput: not a valid material or token, or the port cannot be had.
        MissingTool: the page is missing.
    """
    token = guard.token()
    app = application(material, token)
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((guard.HOSTS[0], port))
        except OSError as error:
            raise InvalidInput(f"--port {port}: cannot be used ({error.strerror})") from None
        listening.listen()
        address = f"http://{guard.HOSTS[0]}:{listening.getsockname()[1]}/?token="
        print(f"The editor is at {address}{token} until you press Ctrl-C", flush=True)
        if browse:
            threading.Thread(target=webbrowser.open, args=[address + app.ticket()], daemon=True).start()
        uvicorn.Server(settings(app)).run(sockets=[listening])


def settings(app: ASGIApp) -> uvicorn.Config:
    """Settings of the server: it runs quietly, and stops within a second even while clients are connected."""
    return uvicorn.Config(
        app, http=guard.Connection, log_level="warning", ws_max_size=SMALL, timeout_graceful_shutdown=1
    )


def application(material: str | None, token: str) -> Guard:
    """The server as an ASGI application for those who have the token. Raises InvalidInput, MissingTool as `serve`."""
    folder = Folder()
    if material is not None:
        folder.first(material)  # refused now, before anything is served

    def session(body: Body) -> Answer:
        """The session, with the material as its file is now; without, where that has been broken since the start."""
        try:
            opened = None if material is None else folder.first(material)
        except InvalidInput:
            opened = None
        return {**VERBS["session"](body), "opened": opened}

    desk = Desk({**VERBS, **folder.verbs, **Renderings(folder).verbs, "session": session})

    async def call(request: Request) -> Response:
        name = request.path_params["verb"]
        if name not in desk.verbs:
            return refusal(404, f"there is no verb {name}")
        if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
            return refusal(415, "a request must say that it is application/json")
        most = MOST_OF.get(name, SMALL)
        with tempfile.SpooledTemporaryFile(IN_MEMORY) as body:
            try:
                with anyio.fail_after(BODY_TIME):
                    complete = await _received(request, body, most)
            except (TimeoutError, ClientDisconnect):
                return refusal(408, f"a request must be here within {BODY_TIME} seconds")
            if not complete:
                return refusal(413, f"a request of {name} may have {most >> 20} MiB at most")
            status, text = await desk.answer(name, lambda: _parsed(_whole(body)))
        return Response(text, status, media_type="application/json")

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await Live(socket, desk).run()

    def picture(request: Request) -> Response:
        try:
            return FileResponse(folder.picture(request.path_params["name"]))
        except InvalidInput as error:
            return refusal(404, str(error))

    routes = [
        Route("/api/{verb}", call, methods=["POST"]),
        WebSocketRoute("/api/live", live),
        Route("/files/{name:path}", picture),
        Mount("/", StaticFiles(directory=bundle.require(), html=True)),
    ]
    return Guard(Starlette(routes=routes, exception_handlers={500: lambda request, error: refusal(500, BUG)}), token)


# Calls ---------------------------------------------------------------------------------------------------------------


async def _received(request: Request, body: IO[bytes], most: int) -> bool:
    """Receive a body; False if it is too large. One with a larger declared length is not received at all."""
    if int(request.headers.get("content-length", 0)) > most:
        return False
    async for chunk in request.stream():
        if body.tell() + len(chunk) > most:
            return False
        body.write(chunk)
    return True


def _whole(body: IO[bytes]) -> bytes:
    body.seek(0)
    return body.read()


class Desk:
    """Answers calls in threads, a few for each kind of verb."""

    def __init__(self, verbs: Mapping[str, Verb]) -> None:
        self.verbs = verbs
        self.limiters: dict[str, anyio.CapacityLimiter] = {}
        self.calls = Counter[str]()

    async def answer(self, name: str, body: Callable[[], Body]) -> tuple[int, str]:
        """Status and answer, in JSON, of a call of a verb with a body, which its thread makes."""
        lane = LANE_OF.get(name, "quick")
        at_once, waiting = LANES[lane]
        free = self.limiters.setdefault(lane, anyio.CapacityLimiter(at_once))
        threads = self.limiters.setdefault(f"threads, {lane}", anyio.CapacityLimiter(at_once + SPARE))
        if self.calls[lane] >= at_once + waiting:
            return 503, _error(BUSY)
        self.calls[lane] += 1
        try:
            with anyio.fail_after(ANSWER_TIME):
                async with free:  # for others, too, where this answer is given up
                    return await run_sync(_answer, self.verbs[name], body, abandon_on_cancel=True, limiter=threads)
        except TimeoutError:
            return 503, _error(f"{name}: has no answer after {ANSWER_TIME} seconds")
        finally:
            self.calls[lane] -= 1


def _answer(verb: Verb, body: Callable[[], Body]) -> tuple[int, str]:
    try:
        return 200, _text(verb(body()))
    except VelaturaError as error:
        return 409 if isinstance(error, Conflict) else 422, _error(str(error))
    finally:
        kernel.return_memory()
        # It is slow to load, and another thread may be loading it
        if release := getattr(sys.modules.get("velatura.renderer.compiled"), "release_kernels", None):
            release()


def _text(answer: Answer) -> str:
    """An answer in JSON; in ASCII, since halves of surrogate pairs have no other form. Raises InvalidInput."""
    try:
        return json.dumps(answer, allow_nan=False)
    except ValueError:
        raise InvalidInput("the values are so large that some results are not finite") from None


def _error(reason: str) -> str:
    return json.dumps({"error": reason})


def _parsed(text: bytes | str) -> dict[str, Any]:
    try:
        body = json.loads(text)
    except (ValueError, RecursionError):
        raise InvalidInput("the body is not valid JSON") from None
    return _object(body)


def _object(body: Any) -> dict[str, Any]:
    if not isinstance(body, dict):
        raise InvalidInput("the body must be an object")
    return body


class Live:
    """Calls over a WebSocket, messages {id, verb, body}: of each verb one at a time, and after it the latest.

    A message that another of its verb overtakes while it waits is answered with an error, without being looked at.
    """

    def __init__(self, socket: WebSocket, desk: Desk) -> None:
        self.socket = socket
        self.desk = desk
        self.waiting: dict[str, Answer] = {}
        self.tasks: dict[str, asyncio.Task[None]] = {}

    async def run(self) -> None:
        """Answer until the page goes away."""
        try:
            while (message := await self.socket.receive())["type"] != "websocket.disconnect":
                await self.take(message.get("text"))
        except WebSocketDisconnect:
            pass
        finally:
            for task in self.tasks.values():
                task.cancel()

    async def take(self, text: str | None) -> None:
        """Begin with a message, or let it wait in the place of the one that waits."""
        try:
            if text is None:
                raise InvalidInput("a message must be text")
            message = _parsed(text)
            verb = field(message, "verb", str)
            if verb not in self.desk.verbs:
                raise InvalidInput(unknown("verb", verb, self.desk.verbs))
        except InvalidInput as error:
            return await self.send({}, _error(str(error)))
        overtaken = self.waiting.pop(verb, None)
        self.waiting[verb] = message
        if overtaken:
            await self.send(overtaken, _error("overtaken by a later call"))
        if verb not in self.tasks or self.tasks[verb].done():
            self.tasks[verb] = asyncio.create_task(self.work(verb))

    async def work(self, verb: str) -> None:
        """Answer what waits for a verb, until nothing does."""
        while message := self.waiting.pop(verb, None):
            try:
                status, text = await self.desk.answer(verb, functools.partial(_object, message.get("body", {})))
            except Exception:
                logging.getLogger("uvicorn.error").exception(BUG)
                status, text = 500, _error(BUG)
            await self.send(message, f'{{"answer": {text}}}' if status == 200 else text)

    async def send(self, message: Answer, text: str) -> None:
        """Send what becomes of a message, {"answer": ...} or {"error": ...}, with its id; a page may have gone."""
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            await self.socket.send_text(f'{{"id": {json.dumps(message.get("id"))}, {text[1:]}')
