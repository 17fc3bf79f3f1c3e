"""Hostile requests and messages to the editor's server, and clients that ask it much at once."""

from __future__ import annotations

import copy
import http.client
import json
import random
import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from websockets.sync.client import connect

from velatura.editor import guard

SLOW = 90  # seconds, in which everything is answered

COAT: dict[str, Any] = {
    "name": "Coat",
    "layers": [
        {"interface": {"eta": 1.5, "alpha": [0.1, 0.2], "rotation": 30}},
        {"medium": {"depth": 1.0, "sigma_a": [0.1, 0.2, 0.3]}},
        {"interface": {"conductor": "Au", "alpha": 0.2}},
    ],
}
TARGET: dict[str, Any] = {
    "lobes": [
        {"energy": 0.05, "alpha": 0.05, "interfaces": 1},
        {"energy": [0.4, 0.3, 0.2], "alpha": 0.2, "interfaces": 1, "base": "conductor", "fixed": {"tau": [0.1]}},
    ]
}
MODEL = {"model": "velatura", "switches": {"reflectance": "fgd", "form": "forward"}}
ABOUT = {"material": COAT, "target": TARGET, "lobe": 1, **MODEL}
SHOT = {
    "material": COAT,
    "object": "sphere",
    "environment": "studio",
    "rotation": 20,
    "camera": {"origin": [0, 1, 5], "target": [0, 0, 0], "fov": 30},
    "size": [16, 12],
}

#: A body of each verb that is answered, from which others are made.
BODIES: dict[str, dict[str, Any]] = {
    "session": {},
    "list": {},
    "targets": {},
    "validations": {},
    "shader": {"material": COAT, **MODEL},
    "tables": {"key": "conductor,inside"},
    "table": {"name": "conductor"},
    "read": {"text": "layers: [{interface: {eta: 1.5, alpha: 0.1}}]"},
    "write": {"material": COAT},
    "object": {"name": "ball"},
    "environment": {"name": "studio"},
    "open": {"file": "coat.yaml"},
    "save": {"file": "coat.yaml", "material": COAT, "version": "0123456789abcdef"},
    "texture": {"file": "wood.png", "data": "aGVsbG8="},
    "appearance": {"material": COAT, "interfaces": [1, 1], **MODEL},
    "invert": ABOUT,
    "wishes": {"material": COAT, "angle": 60, **MODEL},
    "wish": {"material": COAT, "target": {"grazing": {"energy": 0.4}}, "coarse": True, **MODEL},
    "stock": {"material": COAT, "available": ["bk7", {"eta": 1.5, "sigma_a": [0.1, 0.2, 0.3]}, "Au"], "thinnest": 2},
    "class": {**ABOUT, "size": 16},
    "member": {**ABOUT, "point": [1.5, 3.0, 0.5], "map": "conductor"},
    "coat": {"material": COAT, "eta": 1.5, "alpha": 0.1, "keep": True, **MODEL},
    "truth": {**SHOT, "spp": 1, "seed": 1},
    "render": {**SHOT, **MODEL, "samples": 1, "key": "a", "step": 0, "file": "picture.png", "transparent": True},
    "rename": {"file": "coat.yaml", "name": "coat.yml"},
    "keep": {"file": "coat.yaml", "tags": ["warm"], "thumbnail": "/9j/AA=="},
    "remove": {"file": "coat.yaml"},
    "restore": {"file": "coat.yaml", "name": "again.yaml"},
    "validation": {"name": "reflection", "parameters": {"alpha_1": 0.2, "angle": 30}},
}

#: What takes the place of a value.
WRONG: list[Any] = [
    *(None, True, False, 0, 1, -1, 2**31, 10**400, 0.5, -0.0, 1e-320, 1e38, 1e300, -1e300),
    *(float("nan"), float("inf"), float("-inf")),
    *("", "x", "\x00", "\ud800", "\udc80.yaml", "é" * 300, "a\nb", "../../etc/passwd", "x" * 300_000, "1e999"),
    *("!!python/object:os.system", "layers: [!!timestamp foo]", "thin: !!bool maybe", "&a [*a]", "model", "self"),
    *([], [None], [[1]], [1, 2, 3], [1e400, 0, 0], list(range(1000)), [{}], {}, {"a": 1}, {"": {}}),
    *({"model": "velatura"}, {"self": 1}, {"layers": []}, {"layers": [{"interface": {"eta": 1.5}}] * 500}),
    *({"texture": "none.png"}, {"texture": "/dev/zero"}, {"brushing": "radial"}, {"spectrum": "/dev/zero"}),
]


def _deep(rng: random.Random) -> Any:
    value: Any = 1
    for _ in range(rng.choice([20, 200])):
        value = [value] if rng.random() < 0.5 else {"a": value}
    return value


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Everything within a body that holds something, and the key of that."""
    for key in list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield value, key
        yield from _places(value[key])


def mutated(rng: random.Random, body: dict[str, Any]) -> Any:
    """A body with one to three of its values changed."""
    body = copy.deepcopy(body)
    for _ in range(rng.choice([1, 1, 2, 3])):
        places = list(_places(body))
        if not places or rng.random() < 0.05:
            body[rng.choice(["size", "camera", "switches", "interfaces", "name", "material"])] = copy.deepcopy(
                rng.choice(WRONG)
            )
            continue
        holder, key = rng.choice(places)
        what = rng.random()
        if what < 0.1:
            del holder[key]
        elif what < 0.2 and isinstance(holder, list):
            holder += [holder[key]] * rng.choice([1, 100])
        else:
            holder[key] = _deep(rng) if what > 0.97 else copy.deepcopy(rng.choice(WRONG))
    return body


RAW: list[bytes] = [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"a":' * 100_000, b"[" * 100_000, b'"x"', b"9" * 5000]
HEADS: list[dict[str, str]] = [
    {"Content-Type": "text/plain"},
    {"Content-Type": ""},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Sec-Fetch-Site": "cross-site"},
    {"Cookie": "velatura=1"},
    {"Cookie": "\x7f=;;=" * 50},
    {"Host": "evil.example"},
    {"Content-Length": "-1"},
    {"Content-Length": "99999999999999"},
    {"Transfer-Encoding": "chunked, chunked"},
]
PATHS = ["/api/nothing", "/api/../api/list", "/files/../x.png", "/files/%00.png", "/?token=", "/?token=%ff&token=1"]


def request(rng: random.Random) -> tuple[str, str, bytes, dict[str, str]]:
    """Method, path, body and further headers of a request; most are bodies that are nearly right."""
    what = rng.random()
    verb = rng.choice(list(BODIES))
    if what < 0.85:
        return "POST", f"/api/{verb}", json.dumps(mutated(rng, BODIES[verb])).encode(), {}
    if what < 0.9:
        return "POST", f"/api/{verb}", rng.choice(RAW), {}
    if what < 0.96:
        return "POST", f"/api/{verb}", b"{}", rng.choice(HEADS)
    return rng.choice(["GET", "PUT", "DELETE", "OPTIONS", "HEAD"]), rng.choice(PATHS), b"", {}


def message(rng: random.Random) -> str | bytes:
    """A message to the WebSocket."""
    verb = rng.choice(list(BODIES))
    what = rng.random()
    if what < 0.7:
        return json.dumps({"id": rng.random(), "verb": verb, "body": mutated(rng, BODIES[verb])})
    if what < 0.9:
        return json.dumps(mutated(rng, {"id": 1, "verb": verb, "body": BODIES[verb]}))
    odd: list[str | bytes] = [b"\x00\xff", b"{}", "", "{", "[]", "null", '{"id": "\\ud800", "verb": "list"}']
    return rng.choice(odd)


# What becomes of them ------------------------------------------------------------------------------------------------


@dataclass
class Outcome:
    """How many answers there were of each kind, and what went wrong."""

    answers: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


class AtOnce(http.client.HTTPConnection):
    """Sends head and body together: a server that closes at the head would leave a body that comes later unread, and
    the connection is then reset, at times before the answer is read."""

    waiting = b""

    def send(self, data: Any) -> None:
        self.waiting += data

    def getresponse(self) -> http.client.HTTPResponse:
        waiting, self.waiting = self.waiting, b""
        super().send(waiting)
        return super().getresponse()


class Client:
    """Asks a server on a port of this machine with its token, on a connection that is kept."""

    def __init__(self, port: int, token: str) -> None:
        self.cookie = f"{guard.cookie_name(port)}={token}"
        self.connection = AtOnce("127.0.0.1", port, timeout=SLOW)

    def ask(self, method: str, path: str, body: bytes, headers: dict[str, str]) -> tuple[int, bytes]:
        """Status and body of the answer."""
        sent = {"Cookie": self.cookie, "Content-Type": "application/json", **headers}
        try:
            self.connection.request(method, path, body, sent)
            answer = self.connection.getresponse()
            return answer.status, answer.read()
        except BaseException:
            self.connection.close()
            raise

    def call(self, verb: str, body: Any) -> Any:
        """The answer of a verb; AssertionError where it refuses."""
        status, text = self.ask("POST", f"/api/{verb}", json.dumps(body).encode(), {})
        assert status == 200, (verb, status, text[:200])
        return json.loads(text)


def requests(port: int, token: str, count: int, seed: int) -> Outcome:
    """Make hostile requests, one after the other; each must be answered in one line, and not by 500."""
    rng, outcome = random.Random(seed), Outcome()
    for n in range(count):
        method, path, body, headers = request(rng)
        shown = f"request {n}: {method} {path} {body[:300]!r} {headers}"
        try:
            status, text = Client(port, token).ask(method, path, body, headers)
        except (OSError, http.client.HTTPException) as error:
            outcome.failures.append(f"{shown}: {error!r}")
            continue
        outcome.answers[f"{status}"] += 1
        if status == 500 or (path.startswith("/api/") and status == 422 and "\n" in json.loads(text)["error"]):
            outcome.failures.append(f"{shown}: {status} {text[:300]!r}")
    return outcome


def messages(port: int, token: str, count: int, seed: int) -> Outcome:
    """Send hostile messages of up to 1 MiB over one WebSocket, one after the other; each must be answered."""
    rng, outcome = random.Random(seed), Outcome()
    headers = {"Cookie": f"{guard.cookie_name(port)}={token}"}
    with connect(f"ws://127.0.0.1:{port}/api/live", additional_headers=headers, max_size=None) as socket:
        for n in range(count):
            sent = message(rng)
            while len(sent) > 2**20:
                sent = message(rng)
            shown = f"message {n}: {sent[:300]!r}"
            try:
                socket.send(sent)
                answer = json.loads(socket.recv(SLOW))
            except Exception as error:
                outcome.failures.append(f"{shown}: {error!r}")
                break
            outcome.answers["error" if "error" in answer else "answer"] += 1
            if "mistake in it" in answer.get("error", ""):
                outcome.failures.append(f"{shown}: {answer}")
    return outcome


def crowd(port: int, token: str, clients: int, each: int) -> Outcome:
    """Have clients ask at once, each one thing after the other; all must be answered by 200."""
    outcome, lock = Outcome(), threading.Lock()

    def work(number: int) -> None:
        client = Client(port, token)
        for n in range(each):
            verb = ("list", "write", "read")[(number + n) % 3]
            try:
                client.call(verb, BODIES[verb])
                with lock:
                    outcome.answers[verb] += 1
            except Exception as error:
                with lock:
                    outcome.failures.append(f"client {number}, request {n}: {error!r}")

    threads = [threading.Thread(target=work, args=[number]) for number in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return outcome
