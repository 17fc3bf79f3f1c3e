"""Time to the first answer: `velatura --help`, `velatura lobes`, the demo's first picture. Medians of fresh processes.

python benchmarks/startup.py [--rounds 5]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

COMMANDS = {
    "velatura --help": ["--help"],
    "velatura lobes": ["lobes", "coated-gold", "--cos", "1,0.5"],
    "first picture": ["render", "coated-gold", "--spp", "32", "-o", "picture.png"],
}
REACH_S = {"velatura --help": 0.5, "velatura lobes": 1.0, "first picture": 10.0}


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
            print(f"{name:18s} {median(times):6.2f} s   (reach {REACH_S[name]} s)")


if __name__ == "__main__":
    main()
