"""The printed shader against NumPy, in headless Chromium: 10^4 random stacks and directions over all layer patterns.

Of a model that solves materials the code holds a single one: then there is one stack to a pattern, and 10^4 directions.
For each model the largest difference in energy, alpha, value and density, where it was met, and what a shader costs:
time to record and print, its lines, time to compile it, and to draw it the first time (SwiftShader compiles then).

    python benchmarks/shader.py [--models belcour2018,velatura] [--count 10000] [--seed 0] [--textured]
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

import velatura
from velatura.model import Model, bsdf, named, solution
from velatura.model.context import Context, at_a_point
from velatura.shader import record, shader, variance
from velatura.stack import Material, Stack

#: Of textures: ranges by key, drawn for presets of several kinds, seen from some cosines.
DRAWN = {"alpha": (0.05, 0.5), "eta": (1.2, 1.9), "depth": (0.1, 3.0), "sigma_a": (0.05, 2.0), "albedo": (0.05, 0.95)}
TEXTURED = (
    "coated-gold",
    "wet-copper",
    "turned-brushing",
    "glossy-plastic",
    "red-enamel",
    "tinted-varnish-on-copper",
    "three-dielectrics-over-metal",
    "frosted-glass",
    "scattering-brushed-metal",
    "opal-glass",
)
COSINES = [1.0, 0.7, 0.35]
SAMPLES = 4000

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


def closed_form(count: int, seed: int) -> None:
    """How far textured materials, which are printed in closed form, are from uniform ones of `velatura`: means of total
    variation and of the difference of albedos, for values drawn of a parameter."""
    rng, model = np.random.default_rng(seed), named("velatura")
    for key, (low, high) in DRAWN.items():
        found: dict[str, list[tuple[float, float]]] = {}
        for preset in TEXTURED:
            stack = velatura.preset(preset)
            for k, layer in enumerate(stack.layers):
                if key not in type(layer).model_fields or (key == "eta" and stack.kinds[k] != "dielectric"):
                    continue
                for value in rng.uniform(low, high, count):
                    made = stack.replace(**{f"layer{k}_{key}": float(value)})
                    found.setdefault(preset, []).extend(_apart(made, model, rng))
        pairs = {preset: np.mean(each, axis=0) for preset, each in found.items()}
        print(f"{key:8}", ", ".join(f"{preset} {a:.3f} {b:.3f}" for preset, (a, b) in pairs.items()), flush=True)


def _apart(stack: Stack, model: Model, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Total variation and difference of albedo, at each cosine, of a material in closed form from the same solved."""
    material, kind = Material.of(stack), variance(stack)
    bodies = solution.solve(material, model, kind, Context()), bsdf.body(material, model.adder, kind, at_a_point())
    found = []
    for cosine in COSINES:
        wi = (np.full(SAMPLES, np.sqrt(1 - cosine * cosine)), np.zeros(SAMPLES), np.full(SAMPLES, cosine))
        # Half of the directions are those that either draws
        drawn = [[w[: SAMPLES // 2] for w in body.sample(wi, *rng.random((3, SAMPLES)))[0]] for body in bodies]
        wo = tuple(map(np.concatenate, zip(*drawn)))
        (f, p), (g, q) = (body.eval_pdf(wi, wo) for body in bodies)
        shares = np.divide(1.0, 0.5 * (p + q), out=np.zeros(SAMPLES), where=p + q > 0)
        apart = (f - g) * shares
        found.append((0.5 * float(np.abs(apart).mean()), float(np.abs(apart.mean(axis=1)).mean())))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", default=MODELS)
    parser.add_argument("--count", type=int, default=10_000, help="random stacks with directions, for each model")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--textured", action="store_true", help="textured materials against uniform ones, instead")
    arguments = parser.parse_args()
    if arguments.textured:
        closed_form(3, arguments.seed)
        return
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
