"""The editor's server with its own page, and with clients that it must refuse.

Rationale: it reads and writes files of its user, so that only the page that it serves may call it; and it
is a process of its own, which must start fast and stop on request. Requests are made by hand, so that they can
be wrong.
"""

from __future__ import annotations

import base64
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import urlsplit

import pytest
import uvicorn
from fuzzing import server as fuzzing
from interrupts import hear
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from velatura.editor import bundle, guard, server, service
from velatura.editor.folder import LARGEST

Run = Callable[..., tuple[int, str, str]]
TOKEN = "a-token-for-all-these-tests"

COAT: dict[str, Any] = {
    "name": "Coat",
    "layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"conductor": "Au"}}],
}
DEEP: list[Any] = json.loads("[" * 21 + "1" + "]" * 21)  # below the four levels of a material of one layer


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory, and beside it a page of one line."""
    static = tmp_path / "static"
    static.mkdir()
    (static / "index.html").write_text("<!doctype html><title>Velatura</title>")
    for name in ("editor.js", "widget.js"):
        (static / name).write_text("export {};")
    monkeypatch.setattr(bundle, "STATIC", static)
    folder = tmp_path / "folder"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@contextmanager
def served() -> Iterator[int]:
    """The port of a server that runs in this process."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        running = uvicorn.Server(server.settings(server.application(None, TOKEN)))
        thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            running.should_exit = True
            thread.join()


@pytest.fixture
def port(here: Path) -> Iterator[int]:
    with served() as port:
        yield port


def cookie(port: int, token: str = TOKEN) -> str:
    return f"{guard.cookie_name(port)}={token}"


def ask(
    port: int, method: str, path: str, body: Any = None, **headers: str | None
) -> tuple[int, bytes, dict[str, str]]:
    """Status, body and headers of an answer; headers that are None are not sent."""
    sent = {"Cookie": cookie(port), "Content-Type": "application/json", **headers}
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    try:
        connection.request(method, path, body, {key: value for key, value in sent.items() if value is not None})
        answer = connection.getresponse()
        return answer.status, answer.read(), {key.lower(): value for key, value in answer.getheaders()}
    finally:
        connection.close()


def call(port: int, verb: str, body: Any, **headers: str | None) -> tuple[int, dict[str, Any]]:
    text = body if isinstance(body, bytes) else json.dumps(body)
    status, answer, _ = ask(port, "POST", f"/api/{verb}", text, **headers)
    return status, json.loads(answer)


def head(port: int, *lines: str) -> bytes:
    """The head of a request to put a texture into the folder."""
    common = ("POST /api/texture HTTP/1.1", f"Host: 127.0.0.1:{port}", f"Cookie: {cookie(port)}")
    return "\r\n".join([*common, "Content-Type: application/json", *lines, "", ""]).encode()


# What the page gets


def test_the_page_and_its_calls(port: int) -> None:
    """Expected: the page, under a policy that lets it load nothing from elsewhere, and never a stale one."""
    status, body, headers = ask(port, "GET", "/")
    assert status == 200 and b"Velatura" in body
    assert (
        "default-src 'self'" in headers["content-security-policy"] and "http" not in headers["content-security-policy"]
    )
    assert headers["cache-control"] == "no-cache"
    status, session = call(port, "session", {})
    assert status == 200 and session["opened"] is None
    assert call(port, "read", {"text": "layers: [{interface: {eta: 1.5}}]"})[0] == 200


def test_a_material_named_at_the_start_is_opened(here: Path) -> None:
    (here / "coat.json").write_text(json.dumps(COAT))
    with running("coat.json") as (_, port):
        opened = call(port, "session", {})[1]["opened"]
        assert (opened["material"], opened["file"]) == (COAT, "coat.json")
        body = {"file": "coat.json", "material": {**COAT, "name": "New"}, "version": opened["version"]}
        version = call(port, "save", body)[1]["version"]
        assert call(port, "session", {})[1]["opened"] == {
            "material": body["material"],
            "file": "coat.json",
            "version": version,
        }
    assert json.loads((here / "coat.json").read_text())["name"] == "New"


def test_textures_are_sent_and_nothing_else(here: Path, port: int) -> None:
    (here / "wood grain.png").write_bytes(b"a picture")
    (here / "secret.txt").write_text("secret")
    assert ask(port, "GET", "/files/wood%20grain.png")[:2] == (200, b"a picture")
    for path in (
        "secret.txt",
        "../static/editor.js",
        "..%2fstatic%2feditor.js",
        "%2e%2e/static/index.html",
        "none.png",
        "%00.png",
        "a" * 3000 + "/b.png",
    ):
        assert ask(port, "GET", f"/files/{path}")[0] == 404


def test_materials_of_other_programs_are_read(here: Path, port: int) -> None:
    """Expected: material and losses of a file of the folder and of one that is sent, which leaves nothing behind."""
    scene = '<scene version="3.0.0">{}</scene>'
    gilt = '<bsdf type="principled" id="{}"><float name="sheen" value="1"/></bsdf>'
    (here / "gilt.xml").write_text(scene.format(gilt.format("Gilt")))
    status, answer = call(port, "import", {"file": "gilt.xml"})
    assert status == 200 and answer["material"]["name"] == "Gilt"
    assert answer["left"][0].startswith("sheen 1: ")
    two = base64.b64encode(scene.format(gilt.format("A") + gilt.format("B")).encode()).decode()
    assert call(port, "import", {"file": "two.xml", "data": two}) == (200, {"names": ["A", "B"]})
    assert call(port, "import", {"file": "two.xml", "data": two, "name": "B"})[1]["material"]["name"] == "B"

    texture = '<texture type="bitmap" name="base_color"><string name="filename" value="{}"/></texture>'
    image = f'<bsdf type="principled">{texture}</bsdf>'
    for path, says in (
        ("none.png", "far.xml: bsdf 0: texture: file not found: none.png"),
        ("../static/index.html", "index.html"),
    ):
        far = base64.b64encode(scene.format(image.format(path)).encode()).decode()
        status, answer = call(port, "import", {"file": "far.xml", "data": far})
        assert status == 422 and says in answer["error"] and str(here) not in answer["error"], answer
    assert call(port, "import", {"file": "../gilt.xml"})[0] == 422
    assert [file.name for file in here.iterdir()] == ["gilt.xml"]


# What goes wrong


def test_mistakes_are_answered_in_words(port: int) -> None:
    """Expected: one line for what a user can do wrong, and for invalid requests."""
    assert call(port, "read", {"text": "layers: [\n  oops"})[0] == 422
    for body in (b"", b"{", b"[]", b"\xff", b'{"a":' * 100_000, b"null"):
        status, answer = call(port, "read", body)
        assert status == 422 and answer["error"].startswith("the body")
    assert call(port, "nonsense", {})[0] == 404


CAMERA = {"origin": [0, 1, 5], "target": [0, 0, 0], "fov": 30}
VIEW = {"material": COAT, "object": "sphere", "size": [8, 8], "spp": 1, "camera": CAMERA}
NAN, INFINITY = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("verb", "body", "says"),
    [
        ("shader", {"material": COAT, "switches": {"model": "velatura"}}, "unknown switch 'model'"),
        ("shader", {"material": COAT, "switches": {"self": 1}}, "unknown switch 'self'"),
        ("shader", {"material": {"self": 1}}, "unknown key 'self'"),
        ("write", {"material": {"layers": [{"interface": {"self": 1}}]}}, "layer 0 (interface): unknown key 'self'"),
        ("invert", {"target": {"self": 1, "lobes": []}}, "unknown key 'self'"),
        ("invert", {"target": {"lobes": [{"self": 1}]}}, "lobe 1: unknown key 'self'"),
        ("shader", {"material": {"layers": COAT["layers"] * 25}}, "material: layers: may be 48 at most here, got 50"),
        ("coat", {"material": {"layers": COAT["layers"][:1] * 20}}, "material: layers: may be 16 at most below a coat"),
        ("coat", {"material": COAT, "eta": NAN}, "eta: numbers must be finite and at most 1e+30 in size, got nan"),
        ("coat", {"material": COAT, "keep": 1}, "keep: must be true or false, got 1"),
        ("invert", {"target": {"lobes": [{"energy": 0.1}] * 17}}, "target: lobes: may be 16 at most here, got 17"),
        ("appearance", {"material": COAT, "interfaces": "x"}, "interfaces: must be a list"),
        ("appearance", {"material": COAT, "interfaces": {"a": 1}}, "interfaces: must be a list"),
        ("appearance", {"material": COAT, "interfaces": [None]}, "interfaces: must be a whole number from 1 to 3"),
        ("appearance", {"material": COAT, "interfaces": [[1]]}, "interfaces: must be a whole number from 1 to 3"),
        ("truth", {**VIEW, "object": []}, "object: must be text, got []"),
        ("truth", {**VIEW, "environment": []}, "environment: must be text"),
        ("truth", {**VIEW, "size": 3}, "size: must be a width and a height"),
        ("truth", {**VIEW, "size": [512, 512], "spp": 64}, "spp: may be 8 at most for this size"),
        ("truth", {**VIEW, "rotation": 10**400}, "rotation: numbers must be finite"),
        ("truth", {**VIEW, "camera": {**CAMERA, "fov": 1e9}}, "camera.fov: must lie in 0 to 180, both excluded"),
        ("truth", {**VIEW, "camera": {**CAMERA, "fov": 0}}, "camera.fov: must lie in 0 to 180, both excluded"),
        ("truth", {**VIEW, "camera": {**CAMERA, "origin": [INFINITY, 0, 0]}}, "camera: numbers must be finite"),
        (
            "truth",
            {**VIEW, "camera": {**CAMERA, "origin": [0, 0, 0]}},
            "camera.origin: must not lie on, above or below",
        ),
        (
            "truth",
            {**VIEW, "camera": {**CAMERA, "origin": [0, 5, 0]}},
            "camera.origin: must not lie on, above or below",
        ),
        ("truth", {**VIEW, "camera": []}, "camera: must be an object"),
        ("validation", {"name": []}, "name: must be text, got []"),
        ("validation", {"name": {}}, "name: must be text, got {}"),
        ("validation", {"name": "tir", "parameters": 3}, "parameters: must be an object, got 3"),
        ("validation", {"name": "tir", "parameters": [1]}, "parameters: must be an object, got [1]"),
        ("read", {"text": "thin: !!bool maybe"}, "the text"),
        ("read", {"text": "x" * 2**19}, "text: may have 262144 characters at most, got 524288"),
        ("open", {"file": "x" * 300 + ".yaml"}, "file: may have 255 characters at most"),
        ("open", {"file": "\udc80.yaml"}, "must be the plain name of a file"),
        ("write", {"material": {"layers": [{"interface": {"eta": DEEP}}]}}, "24 deep at most"),
    ],
)
def test_no_body_is_a_failure_of_the_editor(port: int, verb: str, body: dict[str, Any], says: str) -> None:
    status, answer = call(port, verb, body)
    assert status == 422 and says in answer["error"] and "\n" not in answer["error"]


def test_a_large_file_is_not_opened(here: Path, port: int) -> None:
    (here / "large.yaml").write_text("# " + "x" * 2**18)
    assert call(port, "open", {"file": "large.yaml"})[1]["error"] == (
        "large.yaml: a material file may have 256 KiB at most here"
    )


def test_hostile_requests_are_answered(here: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Expected: one line for each, never 500, no lost answer and no traceback, and a server that goes on."""
    with served() as port:
        for outcome in (
            fuzzing.requests(port, TOKEN, 60, 7),
            fuzzing.messages(port, TOKEN, 60, 8),
            fuzzing.crowd(port, TOKEN, 8, 10),
        ):
            assert outcome.failures == []
        assert call(port, "list", {})[0] == 200
    assert "Traceback" not in capfd.readouterr().err


def test_files_hold_the_digits_that_a_picture_shows(here: Path, port: int) -> None:
    """Expected: eight, as single precision has, of a file that is saved, and of one that is downloaded."""
    layers = [
        {"interface": {"eta": 1.0797032977443721, "alpha": 0.1}},
        {"medium": {"sigma_s": 1, "g": 0.1234567890123}},
    ]
    material = {"layers": [*layers, {"interface": {"eta": [1.5, 1.6, 1.7], "k": 3.00000000001}}]}
    text = call(port, "write", {"material": material})[1]["text"]
    assert call(port, "save", {"file": "a.yaml", "material": material, "version": None})[0] == 200
    assert (here / "a.yaml").read_text() == text
    assert [n for n in re.findall(r"[\d.]+", text) if len(n) > 3] == ["1.0797033", "0.12345679"]


def test_a_name_that_is_too_long_for_the_disk_is_refused_without_the_folder(here: Path, port: int) -> None:
    for verb, body in (("open", {}), ("save", {"material": COAT, "version": None})):
        status, answer = call(port, verb, {"file": "\u6f06" * 200 + ".yaml", **body})
        assert status == 422 and "name too long" in answer["error"].lower()
        assert str(here) not in answer["error"]


def test_of_two_tabs_that_save_the_second_is_told(here: Path, port: int) -> None:
    body = {"file": "coat.yaml", "material": COAT, "version": None}
    assert call(port, "save", body)[0] == 200
    status, answer = call(port, "save", body)
    assert (status, answer["error"]) == (409, "coat.yaml: exists already")


@pytest.mark.parametrize(
    "name", ["../coat.yaml", "/tmp/coat.yaml", "..\\coat.yaml", "..%2fcoat.yaml", "%2e%2e%2fcoat.yaml"]
)
def test_nothing_is_saved_outside_the_folder(here: Path, port: int, name: str) -> None:
    """Expected: refused, but for the last, since nothing is decoded twice, and this is the plain name of a file."""
    status, _ = call(port, "save", {"file": name, "material": COAT, "version": None})
    assert status == (200 if name.startswith("%") else 422)
    assert {path.parent for path in here.parent.rglob("*coat.yaml")} <= {here}


def test_files_that_are_moved_stay_in_the_folder_and_none_is_written_over(here: Path, port: int) -> None:
    for name in ("a.yaml", "b.yaml"):
        (here / name).write_text(name)
    assert call(port, "rename", {"file": "a.yaml", "name": "b.yaml"})[0] == 409
    for name in ("../c.yaml", "c.json", "c.png"):
        assert call(port, "rename", {"file": "a.yaml", "name": name})[0] == 422
    assert call(port, "remove", {"file": "a.yaml"}) == (200, {"file": "a.yaml"})
    (here / "a.yaml").write_text("another")
    assert call(port, "remove", {"file": "a.yaml"}) == (200, {"file": "a-2.yaml"})
    assert call(port, "list", {})[1]["files"] == ["b.yaml"]
    assert call(port, "restore", {"file": "a.yaml", "name": "b.yaml"})[0] == 409
    assert call(port, "restore", {"file": "../b.yaml", "name": "c.yaml"})[0] == 422
    assert call(port, "restore", {"file": "none.yaml", "name": "c.yaml"})[0] == 422
    assert call(port, "restore", {"file": "a.yaml", "name": "a.yaml"})[0] == 200
    assert {path.name: path.read_text() for path in here.glob("*.yaml")} == {"a.yaml": "a.yaml", "b.yaml": "b.yaml"}


def test_names_of_pictures_write_no_headers(port: int) -> None:
    for name in ("a%0d%0aSet-Cookie:%20a=b.png", "%22;%20filename=evil.exe.png", "%E2%80%AE.png", "a" * 5000 + ".png"):
        status, body, headers = ask(port, "GET", f"/files/{name}")
        assert status == 404 and b"\n" not in body, (name, body)
        assert not {"set-cookie", "content-disposition"} & headers.keys()


def test_what_is_no_picture_is_no_texture(here: Path, port: int) -> None:
    data = base64.b64encode(b"#!/bin/sh").decode()
    status, answer = call(port, "texture", {"file": "script.png", "data": data})
    assert status == 422 and "no picture" in answer["error"]
    assert not list(here.iterdir())


def test_a_failure_of_the_editor_is_told_too(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("velatura.editor.service.loads", lambda *_: 1 / 0)
    status, answer = call(port, "read", {"text": ""})
    assert status == 500 and "mistake in it" in answer["error"]


# Too much


def test_a_large_body_is_refused_before_it_is_sent(port: int) -> None:
    """Expected: an answer to the head of a request of 300 MB, of which no byte of the body follows."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as client:
        client.sendall(head(port, "Content-Length: 300000000"))
        assert client.recv(4096).startswith(b"HTTP/1.1 413 ")


def test_a_large_body_without_a_length_is_not_kept(port: int) -> None:
    """Expected: an answer as soon as more than the limit has come, while the body has no end."""
    chunk = b"100000\r\n" + bytes(2**20) + b"\r\n"
    with socket.create_connection(("127.0.0.1", port), timeout=10) as client:
        client.sendall(head(port, "Transfer-Encoding: chunked"))
        for _ in range(LARGEST // 2**20 + 1):
            client.sendall(chunk)
        assert client.recv(4096).startswith(b"HTTP/1.1 413 ")


def test_what_never_comes_is_not_waited_for(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the end of a connection without a whole head, first or later, and 408 without a whole body."""
    monkeypatch.setattr(guard, "HEAD_TIME", 0.3)
    monkeypatch.setattr(server, "BODY_TIME", 0.3)
    with served() as port:
        whole = head(port, "Content-Length: 2") + b"{}"
        for first, then in [(b"", b""), (whole[:60], b""), (whole, whole[:60]), (whole[:-1], None)]:
            with socket.create_connection(("127.0.0.1", port), timeout=4) as client:  # before an idle one is closed
                client.sendall(first)
                if then is None:
                    assert client.recv(4096).startswith(b"HTTP/1.1 408 ")
                    continue
                if then:
                    told = client.recv(4096)
                    while not told.endswith(b"}"):
                        told += client.recv(4096)
                    assert told.startswith(b"HTTP/1.1 422 ")
                    client.sendall(then)
                assert client.recv(4096) == b""


def test_quick_verbs_do_not_wait_for_slow_ones(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: while inversions take all threads and places of theirs, files are listed, and one more is refused."""
    threads, waiting = server.LANES["slow"]
    release = threading.Event()
    monkeypatch.setitem(service.VERBS, "invert", lambda body: {"waited": release.wait(30)})
    with served() as port, ThreadPoolExecutor(threads + waiting + 1) as clients:
        asked = [clients.submit(call, port, "invert", {}) for _ in range(threads + waiting + 1)]
        try:
            (first,) = wait(asked, 20, FIRST_COMPLETED).done
            begun = time.perf_counter()
            assert call(port, "list", {})[0] == 200
            assert time.perf_counter() - begun < 1
        finally:
            release.set()
        assert first.result() == (503, {"error": server.BUSY})
        assert [each.result() for each in asked if each is not first] == [(200, {"waited": True})] * (threads + waiting)


def test_an_answer_that_takes_too_long_is_given_up(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "ANSWER_TIME", 0.2)
    monkeypatch.setitem(service.VERBS, "invert", lambda body: {"waited": threading.Event().wait(1)})
    with served() as port:
        assert call(port, "invert", {}) == (503, {"error": "invert: has no answer after 0.2 seconds"})


def test_an_answer_stands_while_another_thread_loads_kernels(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the module that releases them may be there, but have no functions yet."""
    name = "velatura.renderer.compiled"
    monkeypatch.setitem(sys.modules, name, ModuleType(name))
    with served() as port:
        assert call(port, "object", {"name": "ball"})[0] == 200


def test_answers_that_are_given_up_stop_no_others(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: after as many endless answers as a kind of verb has at once, the next one is answered."""
    release = threading.Event()
    monkeypatch.setattr(server, "ANSWER_TIME", 1)
    monkeypatch.setitem(service.VERBS, "values", lambda body: {"waited": release.wait(30)})
    assert server.LANE_OF["values"] == server.LANE_OF["shader"]
    at_once, _ = server.LANES[server.LANE_OF["shader"]]
    with served() as port, ThreadPoolExecutor(at_once) as clients:
        try:
            asked = [clients.submit(call, port, "values", {}) for _ in range(at_once)]
            assert [each.result()[0] for each in asked] == [503] * at_once
            assert call(port, "shader", {"material": {}})[0] == 422
        finally:
            release.set()


# Strangers


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example:{port}", "", "[::1]:{port}"]
)
def test_another_host_is_refused(port: int, host: str) -> None:
    """Expected: 403 under any name that is not this machine's, which a name that is rebound to it would be."""
    assert ask(port, "GET", "/", Host=host.format(port=port))[0] == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:1", "https://127.0.0.1:{port}"])
def test_another_origin_is_refused(port: int, origin: str) -> None:
    """Expected: 403 for a page of another site, another port, or no site, on both ways in."""
    origin = origin.format(port=port)
    assert call(port, "list", {}, Origin=origin)[0] == 403
    with pytest.raises(InvalidStatus) as refused, live(port, origin):
        pass
    assert refused.value.response.status_code == 403


def test_the_own_page_is_welcome(port: int) -> None:
    for name in ("127.0.0.1", "localhost"):
        assert call(port, "list", {}, Host=f"{name}:{port}", Origin=f"http://{name}:{port}")[0] == 200


def test_the_address_with_the_token_lets_a_browser_in(port: int) -> None:
    """Expected: a cookie for this server alone that no script can read, and the address without the token."""
    status, _, headers = ask(port, "GET", f"/?token={TOKEN}", Cookie=None)
    assert (status, headers["location"]) == (303, "/")
    given, *attributes = headers["set-cookie"].split("; ")
    assert given == cookie(port) and {"HttpOnly", "SameSite=strict", "Path=/"} <= set(attributes)
    assert ask(port, "GET", "/", Cookie=given)[0] == 200
    for path in ("/?token=another", "/?token=", "/?token=%ff", f"/editor.js?token={TOKEN}", f"/api/list?token={TOKEN}"):
        assert ask(port, "GET", path, Cookie=None)[0] == 403, path


@pytest.mark.parametrize("token", ["", "another", TOKEN[:-1], TOKEN + "x", "\xe9"])
def test_without_the_token_nothing_is_answered(here: Path, port: int, token: str) -> None:
    """Expected: 403 for every request, of another account of this machine for one, with a line that helps."""
    (here / "wood.png").write_bytes(b"a picture")
    for method, path in [("GET", "/"), ("GET", "/editor.js"), ("GET", "/files/wood.png"), ("POST", "/api/list")]:
        for wrong in (None, cookie(port, token), cookie(port + 1)):
            status, body, _ = ask(port, method, path, b"{}" if method == "POST" else None, Cookie=wrong)
            assert status == 403 and b"open the address that it has printed" in body
    with pytest.raises(InvalidStatus) as refused, live(port, token=token):
        pass
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    ("lines", "status"),
    [
        (["Sec-Fetch-Site: cross-site"], 403),
        (["Sec-Fetch-Site: same-site"], 403),
        (["Sec-Fetch-Site: none", "Sec-Fetch-Site: cross-site"], 403),
        (["Origin: http://127.0.0.1:{port}", "Origin: http://evil.example"], 403),
        (["Host: evil.example"], 400),
        (["Sec-Fetch-Site: same-origin", "Origin: http://127.0.0.1:{port}"], 200),
        (["Sec-Fetch-Site: none"], 200),
    ],
)
def test_what_a_browser_says_of_a_page_elsewhere_is_believed(port: int, lines: list[str], status: int) -> None:
    """Expected: a refusal of other sites, and of heads that say two things."""
    usual = ["POST /api/list HTTP/1.1", f"Host: 127.0.0.1:{port}", f"Cookie: {cookie(port)}"]
    usual += ["Content-Type: application/json", "Content-Length: 2"]
    text = "\r\n".join([*usual, *lines, "", "{{}}"])
    with socket.create_connection(("127.0.0.1", port), timeout=10) as client:
        client.sendall(text.format(port=port).encode())
        assert client.recv(4096).startswith(f"HTTP/1.1 {status} ".encode())


@pytest.mark.parametrize("kind", [None, "text/plain", "application/x-www-form-urlencoded", "application/jsonp"])
def test_a_form_of_another_page_is_not_json(port: int, kind: str | None) -> None:
    status, answer = call(port, "list", {}, **{"Content-Type": kind})
    assert status == 415 and "application/json" in answer["error"]
    assert call(port, "list", {}, **{"Content-Type": "application/json; charset=utf-8"})[0] == 200


def test_a_token_of_ones_own_is_long(run: Run, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(guard.VARIABLE, "short")
    status, _, err = run("edit", "--no-browser")
    assert status == 2 and err.startswith(f"velatura: {guard.VARIABLE}: must be 16 to 128")


# Live


@contextmanager
def live(port: int, origin: str | None = None, token: str = TOKEN) -> Iterator[ClientConnection]:
    headers = {"Cookie": cookie(port, token)}
    with connect(
        f"ws://127.0.0.1:{port}/api/live", origin=origin, open_timeout=10, additional_headers=headers
    ) as socket:
        yield socket


def test_a_live_line_stays_open_though_nothing_is_said(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: it has no head to wait for any more."""
    monkeypatch.setattr(guard, "HEAD_TIME", 0.3)
    with served() as port, live(port) as socket:
        with pytest.raises(TimeoutError):
            socket.recv(timeout=0.9)
        socket.send(json.dumps({"id": 1, "verb": "list", "body": {}}))
        assert "answer" in json.loads(socket.recv(timeout=10))


def test_live_calls_are_answered(port: int) -> None:
    with live(port, f"http://127.0.0.1:{port}") as socket:
        for body, field in [({"text": "layers: [{interface: {eta: 1.5}}]"}, "answer"), ({"text": "["}, "error")]:
            socket.send(json.dumps({"id": 7, "verb": "read", "body": body}))
            answer = json.loads(socket.recv(10))
            assert answer["id"] == 7 and field in answer
        for wrong in ("{", "[]", "{}", '{"verb": "nonsense"}', '{"verb": "read", "body": []}'):
            socket.send(wrong)
            assert "error" in json.loads(socket.recv(10))
        socket.send(b"{}")
        assert json.loads(socket.recv(10)) == {"id": None, "error": "a message must be text"}
        socket.send('{"id": "\\ud800", "verb": "list"}')
        assert json.loads(socket.recv(10)) == {"id": "\ud800", "answer": {"files": [], "textures": [], "kept": {}}}


def test_of_a_burst_the_first_and_the_last_are_answered(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: while the first call is at work the later ones overtake each other, and never are two at work."""
    started, release, bodies = threading.Event(), threading.Event(), []

    def slow(body: Any) -> dict[str, Any]:
        bodies.append(body["n"])
        started.set()
        assert release.wait(10)
        return {"n": body["n"]}

    monkeypatch.setitem(service.VERBS, "slow", slow)
    with served() as port, live(port) as socket:
        socket.send(json.dumps({"id": 0, "verb": "slow", "body": {"n": 0}}))
        assert started.wait(10)
        for n in range(1, 6):
            socket.send(json.dumps({"id": n, "verb": "slow", "body": {"n": n}}))
        overtaken = [json.loads(socket.recv(10)) for _ in range(4)]
        release.set()
        answers = [json.loads(socket.recv(10)) for _ in range(2)]
    assert [message["id"] for message in overtaken] == [1, 2, 3, 4]
    assert all("overtaken" in message["error"] for message in overtaken)
    assert [message["answer"]["n"] for message in answers] == [0, 5] == bodies


# Start and stop


@contextmanager
def running(*arguments: str, browse: bool = False) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The command in a process of its own, and the port that it prints."""
    command = [sys.executable, "-m", "velatura", "edit", *arguments, "--browser" if browse else "--no-browser"]
    environment = {**os.environ, guard.VARIABLE: TOKEN}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=hear, env=environment
    )
    try:
        assert process.stdout
        address = urlsplit(process.stdout.readline().split()[4])
        assert address.query == f"token={TOKEN}" and address.port
        yield process, address.port
    finally:
        process.kill()
        process.communicate()


def test_it_stops_when_it_is_told_to(here: Path) -> None:
    """Expected: within a second (two, where others are at work), though a page is connected, and without complaint."""
    for number, status in [(signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM)]:
        with running("coated-gold") as (process, port):
            assert call(port, "session", {})[1]["opened"]["material"]["name"] == "Coated brushed gold"
            with live(port):
                told = time.perf_counter()
                process.send_signal(number)
                assert process.wait(10) == status
                assert time.perf_counter() - told < 2
            _, err = process.communicate()
            assert err == ("velatura: interrupted\n" if number == signal.SIGINT else "")


def test_the_page_is_opened_in_the_browser(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the user's browser gets an address that admits it once, since others may read a command line."""
    browser = here / "browser.py"
    browser.write_text("import pathlib, sys; pathlib.Path('address').write_text(sys.argv[1])")
    monkeypatch.setenv("BROWSER", f"{sys.executable} {browser} %s")
    with running(browse=True) as (_, port):
        for _ in range(100):
            if (here / "address").is_file() and (here / "address").read_text():
                break
            time.sleep(0.05)
        told = (here / "address").read_text()
        assert told.startswith(f"http://127.0.0.1:{port}/?token=") and TOKEN not in told
        path = told.partition(str(port))[2]
        assert [ask(port, "GET", path, Cookie=None)[0] for _ in range(2)] == [303, 403]


def test_a_bad_material_starts_no_server(run: Run, here: Path) -> None:
    (here / "broken.yaml").write_text("layers: [")
    for material in ("broken.yaml", "none.yaml", "coated-gld"):
        status, out, err = run("edit", material, "--no-browser")
        assert (status, out, err.count("\n")) == (2, "", 1)


def test_a_port_that_is_taken_is_named(run: Run, here: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        status, out, err = run("edit", "--no-browser", "--port", str(taken.getsockname()[1]))
    assert (status, out) == (2, "") and "--port" in err


def test_a_missing_page_is_told(run: Run, here: Path) -> None:
    (bundle.STATIC / "editor.js").unlink()
    status, _, err = run("edit", "--no-browser")
    assert status == 1 and "pip install" in err
