"""Time to the first answer: `--help`, `lobes`, the demo's first picture, the editor. Fresh processes, by turns;
pictures with the kernels of earlier ones, and with nothing compiled.

python benchmarks/startup.py [--rounds 5]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from rows import parsed, row

COMMANDS = {
    "velatura --help": ["--help"],
    "velatura lobes": ["lobes", "coated-gold", "--cos", "1,0.5"],
    "first picture": ["render", "coated-gold", "--spp", "32", "-o", "picture.png"],
}
NEW = "first picture, nothing compiled"
COMMANDS[NEW] = COMMANDS["first picture"]
REACH_S = {"velatura --help": 0.5, "velatura lobes": 1.0, "first picture": 4.0, NEW: 4.0, "velatura edit": 1.0}


def main() -> None:
    options = parsed(__doc__, rounds=5, only=(list(REACH_S), "", list(REACH_S)))
    times: dict[str, list[float]] = {name: [] for name in options.only}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            for name, seconds in times.items():
                if name in COMMANDS:
                    seconds.append(ended(COMMANDS[name], Path(folder), name == NEW))
                else:
                    seconds.append(edit(Path(folder)))
    for name, seconds in times.items():
        row("start-up", name, seconds, remark=f"reach {REACH_S[name]} s")


def ended(arguments: list[str], folder: Path, new: bool) -> float:
    """Seconds that a command takes, with a home of its own where all is `new`."""
    with tempfile.TemporaryDirectory() as home:
        changed = {"HOME": home} if new else {}
        command = [sys.executable, "-m", "velatura", *arguments]
        start = time.perf_counter()
        subprocess.run(command, cwd=folder, env={**os.environ, **changed}, check=True, capture_output=True)
        return time.perf_counter() - start


def edit(folder: Path) -> float:
    """Seconds until the editor has answered what its page asks first."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "velatura", "edit", "coated-gold", "--no-browser"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        address = next(word for word in process.stdout.readline().split() if word.startswith("http"))
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        browser.open(address).read()  # which leads to the page, and leaves the token
        question = urllib.request.Request(f"{address.partition('?')[0]}api/session", b"{}")
        question.add_header("Content-Type", "application/json")
        browser.open(question).read()
        took = time.perf_counter() - start
        process.terminate()
    return took


if __name__ == "__main__":
    main()
