"""Time until a material is ready whose values have changed, in a process that has made one before.

    python benchmarks/preparation.py [--rounds 15]

One roughness of a preset is changed, the BSDF is made and evaluated once. Medians over changes of the processor's and
the clock's seconds, without the first two, which compile.
"""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import Any

import numpy as np

import velatura as vt
from velatura.checks.probe import Probe

PRESETS = ("frosted-metal", "coated-gold", "pearl-lacquer")
MODELS: dict[str, dict[str, Any]] = {
    "belcour2018": {"model": "belcour2018"},
    "velatura": {"model": "velatura"},
    "velatura, symmetric": {"model": "velatura", "form": "symmetric"},
}
WI = np.array([[0.6, 0.0, 0.8]])
WO = np.array([[-0.6, 0.0, 0.8]])


def seconds(preset: str, choices: dict[str, Any], rounds: int) -> tuple[float, float]:
    """Seconds of the processor and of the clock."""
    stack = vt.load(preset)
    name = next(name for name in stack.flat() if "_alpha" in name)
    spent = []
    for i in range(rounds + 2):
        changed = stack.replace(**{name: 0.05 + 0.3 * i / rounds})
        processor, clock = time.process_time(), time.perf_counter()
        Probe(vt.bsdf(changed, **choices)).eval_pdf(WI, WO)
        spent.append((time.process_time() - processor, time.perf_counter() - clock))
    return median(s[0] for s in spent[2:]), median(s[1] for s in spent[2:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    print(f"{'processor, clock (s)':24s}" + "".join(f"{preset:>20s}" for preset in PRESETS))
    for name, choices in MODELS.items():
        cells = (seconds(preset, choices, rounds) for preset in PRESETS)
        print(f"{name:24s}" + "".join(f"{p:13.2f}, {c:5.2f}" for p, c in cells))


if __name__ == "__main__":
    main()
