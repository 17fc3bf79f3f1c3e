"""The printed shader against NumPy, in headless Chromium: 10^4 random stacks and directions over all layer patterns.

For each model the largest difference in energy, alpha, value and density, where it was met, and what a shader costs:
time to record and print, its lines, time to compile it, and to draw it the first time (SwiftShader compiles then).

    python benchmarks/shader.py [--models belcour2018,velatura] [--count 10000] [--seed 0]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
from agreement import PATTERNS, differences, in_browser, in_numpy, random_case

from velatura.shader import record, shader

MODELS = "belcour2018,weier2020,yamaguchi2019,realtime,velatura"


def measure(model: str, count: int, seed: int, page: chromium.Browser) -> tuple[dict, dict]:
    """The largest differences with their patterns, and the median costs."""
    worst: dict[str, tuple[float, str]] = {}
    costs: dict[str, list[float]] = {}
    for k, pattern in enumerate(PATTERNS):
        case = random_case(pattern, -(-count // len(PATTERNS)), np.random.default_rng((seed, k)))
        start = time.perf_counter()
        made = shader(case.stack, model)
        recording = time.perf_counter() - start
        recorded = record(case.stack, model)
        found, linking, drawing = in_browser(case, recorded, made, page)
        here = vars(differences(in_numpy(case, recorded), found))
        name = f"{', '.join(pattern[0])}; {pattern[1]}"
        worst = {key: max(worst.get(key, (0.0, "")), (value, name)) for key, value in here.items()}
        cost = {"record s": recording, "lines": made.text.count("\n"), "link s": linking / 1e3, "draw s": drawing / 1e3}
        for key, value in cost.items():
            costs.setdefault(key, []).append(value)
    return worst, costs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", default=MODELS)
    parser.add_argument("--count", type=int, default=10_000, help="random stacks with directions, for each model")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    if why := chromium.missing():
        print(f"skipped: {why}")
        return
    with chromium.browser() as page:
        for model in arguments.models.split(","):
            worst, costs = measure(model, arguments.count, arguments.seed, page)
            for key, (value, pattern) in worst.items():
                print(f"{model:14} {key:8} {value:.1e}  {pattern}")
            print(f"{model:14} median " + ", ".join(f"{key} {median(values):.3g}" for key, values in costs.items()))
            print(
                f"{model:14} worst  " + ", ".join(f"{key} {max(values):.3g}" for key, values in costs.items()),
                flush=True,
            )


if __name__ == "__main__":
    main()
