"""The editor's server under hostile requests, many clients, slow calls, and clients that never end their request.
Then the editor's page under random edits by hand, in headless Chromium.

    python benchmarks/fuzz_server.py [--requests 500] [--messages 200] [--clients 50] [--each 200]
                                     [--minutes 10] [--seed 0]

Prints a table. Exit status 1 if any request is answered by 500 or not at all, if the process ends, if a limit of the
manual does not hold, if the page's console complains, its state is not that of Python, or its memory grows.
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
import editor
from fuzzing import server as fuzzing
from fuzzing.hands import Hands

import velatura as vt
from velatura.editor import guard

INVERSIONS = 45
LOBES = 12
STALLED, SENT = 20, 24 * 2**20  # uploads, and bytes that each sends of its 30 MiB
HALF_OPEN = 500
EDITS, LOOKS = 15, 8  # between two looks at the page, and between two reloads
HEAP_MB, GROWN_MB = 64.0, 200.0  # of the page, and of the server
REACH_S, REACH_MB = 1.0, 60.0  # of `list` beside inversions, and of memory for stalled uploads


def main() -> None:
    options = parsed(__doc__, requests=500, messages=200, clients=50, each=200, seed=0, minutes=10.0)

    failures: list[str] = []
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+") as log:
        command = [sys.executable, "-m", "velatura", "edit", "--no-browser"]
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=log, text=True)
        assert process.stdout
        found = re.search(r":(\d+)/\?token=([\w-]+)", process.stdout.readline())
        assert found, "the server does not start"
        port, token = int(found[1]), found[2]
        try:
            for what, outcome in (
                ("requests", fuzzing.requests(port, token, options.requests, options.seed)),
                ("messages", fuzzing.messages(port, token, options.messages, options.seed)),
                ("clients", fuzzing.crowd(port, token, options.clients, options.each)),
            ):
                answers = ", ".join(f"{count} x {answer}" for answer, count in sorted(outcome.answers.items()))
                print(f"{what:32s} {len(outcome.failures)} failed; {answers}", flush=True)
                failures += outcome.failures
            failures += [
                *slow(port, token),
                *stalled(port, token, process.pid),
                *half_open(port, process.pid),
            ]
            if process.poll() is not None:
                failures.append(f"the server has ended with status {process.returncode}")
        finally:
            process.kill()
            process.wait()
        log.seek(0)
        if "Traceback" in (text := log.read()):
            failures.append(f"the server's log holds a traceback: {text[:3000]}")
    failures += edited(options.minutes, options.seed) if options.minutes else []
    for failure in failures:
        print(failure)
    sys.exit(1 if failures else 0)


def slow(port: int, token: str) -> list[str]:
    """Ask for `list` while inversions are at work."""
    lobes = [{"energy": 0.02, "alpha": 0.05 + 0.02 * k} for k in range(LOBES)]
    answers: list[int] = []

    def invert() -> None:
        body = fuzzing.json.dumps({"target": {"lobes": lobes}}).encode()
        answers.append(fuzzing.Client(port, token).ask("POST", "/api/invert", body, {})[0])

    threads = [threading.Thread(target=invert) for _ in range(INVERSIONS)]
    for thread in threads:
        thread.start()
    client, times = fuzzing.Client(port, token), []
    time.sleep(0.2)
    while any(thread.is_alive() for thread in threads):
        begun = time.perf_counter()
        client.call("list", {})
        times.append(time.perf_counter() - begun)
        time.sleep(0.05)
    statuses = f"{answers.count(200)} x 200, {answers.count(503)} x 503"
    row(f"list beside {INVERSIONS} inversions", f"median {median(times):.3f} s, worst {max(times):.3f} s; {statuses}")
    lost = len(answers) < INVERSIONS or set(answers) - {200, 503}
    return ["inversions are lost"] * bool(lost) + [f"list takes {max(times):.1f} s"] * (max(times) > REACH_S)


def stalled(port: int, token: str, pid: int) -> list[str]:
    """Begin uploads, and never end them."""
    before = memory(pid)
    head = (
        f"POST /api/texture HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {guard.cookie_name(port)}={token}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {30 * 2**20}\r\n\r\n"
    )
    clients = []
    for _ in range(STALLED):
        clients.append(socket.create_connection(("127.0.0.1", port)))
        clients[-1].sendall(head.encode() + b" " * SENT)
    time.sleep(1)
    grown = memory(pid) - before
    row(f"{STALLED} stalled uploads hold", f"{grown:.0f} MB")
    for client in clients:
        client.close()
    time.sleep(1)
    return [f"stalled uploads hold {grown:.0f} MB"] * (grown > REACH_MB)


def half_open(port: int, pid: int) -> list[str]:
    """Begin requests, and never end their heads."""
    before = connections(pid)
    clients = []
    for _ in range(HALF_OPEN):
        clients.append(socket.create_connection(("127.0.0.1", port)))
        clients[-1].sendall(b"POST /api/list HTTP/1.1\r\nHost: ")
    time.sleep(1)
    at_first = connections(pid) - before
    time.sleep(guard.HEAD_TIME + 2)
    left = max(connections(pid) - before, 0)
    row(f"{HALF_OPEN} half-open requests", f"{at_first} at first, {left} after {guard.HEAD_TIME + 3} s")
    for client in clients:
        client.close()
    return [f"{left} half-open requests stay"] * (left > 0)


def edited(minutes: float, seed: int) -> list[str]:
    """Edit in the page by random hands, which look at what has become of it now and then."""
    with tempfile.TemporaryDirectory() as folder, editor.server(Path(folder)) as server, chromium.launched() as opened:
        render(server)
        visit = editor.Visit(opened.new_page(viewport={"width": 900, "height": 600}), server.entrance)
        hands, end = Hands(visit, Path(folder), seed), time.monotonic() + 60 * minutes
        memories = []
        while time.monotonic() < end:
            for _ in range(LOOKS):
                hands.edit(EDITS)
                hands.look()
            hands.reload()
            memories.append(memory(server.process.pid))
        heaps, failures = hands.outcome.heaps, hands.outcome.failures
        each = ", ".join(f"{x:.0f}" for x in memories)
        pages = f"page {heaps[0]:.0f} to {max(heaps):.0f} MB, server {each} MB"
        row(f"{len(hands.outcome.edits)} edits, {len(heaps)} looks", f"{len(failures)} failed; {pages}")
        grown = max(heaps) > HEAP_MB or max(memories) - memories[0] > GROWN_MB
        return failures + [f"memory grows: {pages}"] * grown


def render(server: editor.Server) -> None:
    """Render once, so that Mitsuba, which takes 150 MB, is there from the start."""
    camera = {"fov": 30, "origin": [0, 2, 6], "target": [0, 1, 0]}
    scene = {"object": "sphere", "camera": camera, "size": [32, 32], "samples": 1, "key": "1", "file": "first.png"}
    client = fuzzing.Client(int(server.address.rpartition(":")[2].rstrip("/")), server.token)
    client.call("render", {"material": vt.preset("coated-gold").to_dict(), **scene})


def memory(pid: int) -> float:
    """Resident memory of a process, MB."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def connections(pid: int) -> int:
    """How many sockets a process has open."""
    folder = f"/proc/{pid}/fd"
    found = 0
    for name in os.listdir(folder):
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            found += os.readlink(f"{folder}/{name}").startswith("socket:")
    return found


def row(what: str, measured: str) -> None:
    print(f"{what:32s} {measured}", flush=True)


if __name__ == "__main__":
    main()
