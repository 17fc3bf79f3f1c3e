"""Time to the first answer: `--help`, `lobes`, the demo's first picture, the editor. Medians of fresh processes.

python benchmarks/startup.py [--rounds 5]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from statistics import median

COMMANDS = {
    "velatura --help": ["--help"],
    "velatura lobes": ["lobes", "coated-gold", "--cos", "1,0.5"],
    "first picture": ["render", "coated-gold", "--spp", "32", "-o", "picture.png"],
}
REACH_S = {"velatura --help": 0.5, "velatura lobes": 1.0, "first picture": 10.0, "velatura edit": 1.0}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in COMMANDS.items():
            times = []
            for _ in range(rounds):
                start = time.perf_counter()
                command = [sys.executable, "-m", "velatura", *arguments]
                subprocess.run(command, cwd=Path(folder), check=True, capture_output=True)
                times.append(time.perf_counter() - start)
            report(name, times)
        report("velatura edit", [edit(Path(folder)) for _ in range(rounds)])


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


def report(name: str, times: list[float]) -> None:
    print(f"{name:18s} {median(times):6.2f} s   (reach {REACH_S[name]} s)")


if __name__ == "__main__":
    main()
