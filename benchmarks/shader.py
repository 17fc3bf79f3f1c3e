"""Printed shaders against NumPy: 10^4 random stacks and directions over all layer patterns, in every language.

GLSL ES runs in headless Chromium, the others as tests/shared/machines.py says. Of a model that solves materials code
holds a single one: then there is one stack to a pattern, and 10^4 directions. For each language and model the largest
difference in energy, alpha, value and density, where it was met, and what a shader costs: time to record and print, its
lines, and time to compile and run it. At the end the tables of docs/how-to/shaders.md.

    python benchmarks/shader.py [--language all] [--models belcour2018,velatura] [--count 10000] [--seed 0]
    python benchmarks/shader.py --uniforms [--language vulkan,wgsl] [--seed 0]
    python benchmarks/shader.py --textured
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import chromium
from agreement import PATTERNS, Changeable, Differences, differences, in_browser, in_numpy, on_machine, random_case
from machines import MACHINES

import velatura
from velatura.model import Model, named
from velatura.model.context import Context, at_a_point
from velatura.model.papers import bsdf
from velatura.model.solved import solve
from velatura.shader import record, shader, variance
from velatura.shader.printers.glsl import GLSL
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

CHANGES, DIRECTIONS = 6, 40  # stacks of a pattern that a program is given, and directions for each

MODELS = "belcour2018,weier2020,yamaguchi2019,realtime,velatura"


#: Runs a shader in a language.
LANGUAGES = ["glsl", *MACHINES]
KEYS = ("energy", "alpha", "value", "density")


def measure(model: str, languages: list[str], count: int, seed: int, page: Any) -> dict[str, dict[str, float]]:
    """The largest differences by language."""
    worst: dict[str, dict[str, tuple[float, str]]] = {language: {} for language in languages}
    costs: dict[str, dict[str, list[float]]] = {language: {} for language in languages}
    for k, pattern in enumerate(PATTERNS):
        case = random_case(pattern, -(-count // len(PATTERNS)), np.random.default_rng((seed, k)))
        recorded = record(case.stack, model)
        truth = in_numpy(case, recorded)
        name = f"{', '.join(pattern[0])}; {pattern[1]}"
        for language in languages:
            printer = MACHINES[language].printer if language in MACHINES else GLSL
            times = [time.perf_counter()]
            made = shader(case.stack, model, printer=printer)
            times.append(time.perf_counter())
            if language in MACHINES:
                found = on_machine(case, recorded, made, MACHINES[language])
            else:
                found, _, _ = in_browser(case, recorded, made, page)
            times.append(time.perf_counter())
            here: Differences = differences(truth, found)
            for key, value in vars(here).items():
                worst[language][key] = max(worst[language].get(key, (0.0, "")), (value, name))
            spent = {"print s": times[1] - times[0], "lines": made.text.count("\n"), "run s": times[2] - times[1]}
            for key, value in spent.items():
                costs[language].setdefault(key, []).append(value)
    for language in languages:
        for key, (value, where) in worst[language].items():
            print(f"{language:8} {model:14} {key:8} {value:.1e}  {where}")
        for word, of in (("median", median), ("worst", max)):
            each = ", ".join(f"{key} {of(values):.3g}" for key, values in costs[language].items())
            print(f"{language:8} {model:14} {word:6} {each}", flush=True)
    return {language: {key: value for key, (value, _) in found.items()} for language, found in worst.items()}


def table(title: str, rows: dict[str, dict[str, float]]) -> str:
    """The table in Markdown."""
    head = [f"| {title} | {' | '.join(KEYS)} |", "|---" * (1 + len(KEYS)) + "|"]
    return "\n".join([*head, *(f"| `{x}` | {' | '.join(f'{row[k]:.1e}' for k in KEYS)} |" for x, row in rows.items())])


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
    bodies = solve.solve(material, model, kind, Context()), bsdf.body(material, model.surrogate, kind, at_a_point())
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


def uniforms(languages: list[str], seed: int) -> None:
    """Programs whose values change, of `velatura`: one for each pattern, given the values of random stacks one after
    the other. The largest differences from NumPy, and quantiles of values."""
    each: dict[str, list[tuple[float, float]]] = {language: [] for language in languages}
    values: dict[str, list[np.ndarray]] = {language: [] for language in languages}
    for k, pattern in enumerate(PATTERNS):
        if pattern[0] == ("diffuse",):
            continue  # without interfaces nothing is solved
        cases = [random_case(pattern, DIRECTIONS, np.random.default_rng((seed, k, j))) for j in range(CHANGES)]
        programs = {language: Changeable.of(cases[0].stack, MACHINES[language]) for language in languages}
        for case in cases:
            truth = in_numpy(case, next(iter(programs.values())).recording)
            rough = (truth.alpha.reshape(-1, DIRECTIONS) >= 0.05).all(axis=0)
            for language, program in programs.items():
                found = program.given(case)
                apart = differences(truth, replace(found, alpha=truth.alpha))
                each[language].append((apart.energy, apart.value))
                relative = np.abs(found.value - truth.value) / np.maximum(truth.value, 1e-5)
                values[language].append(relative[:, rough].ravel())
    for language in languages:
        energy, value = np.max(each[language], axis=0)
        most = np.quantile(np.concatenate(values[language]), 0.999)
        count = len(each[language])
        print(f"{language:8} {count} stacks, {count * DIRECTIONS} directions: energy {energy:.1e}, value {value:.1e}")
        print(f"{language:8} 999 of 1000 values within {most:.1e}", flush=True)


def main() -> None:
    arguments = parsed(
        __doc__,
        language=("glsl", f"all, or some of {', '.join(LANGUAGES)}"),
        models=MODELS,
        count=(10_000, "random stacks with directions, for each model"),
        seed=0,
        uniforms=(False, "programs whose values change, instead"),
        textured=(False, "textured materials against uniform ones, instead"),
    )
    if arguments.textured:
        closed_form(3, arguments.seed)
        return
    asked = LANGUAGES if arguments.language == "all" else arguments.language.split(",")
    lacking = {x: MACHINES[x].missing() if x in MACHINES else chromium.missing() for x in asked}
    for language, why in lacking.items():
        print(f"{language}: skipped, {why}" if why else f"{language}: runs", flush=True)
    languages = [language for language, why in lacking.items() if not why]
    if arguments.uniforms:
        uniforms([language for language in languages if language in MACHINES], arguments.seed)
        return
    found: dict[str, dict[str, dict[str, float]]] = {}
    with chromium.browser() if "glsl" in languages else nullcontext() as page:
        for model in arguments.models.split(","):
            found[model] = measure(model, languages, arguments.count, arguments.seed, page)
    print(table("model", {model: _worst(of.values()) for model, of in found.items()}))
    print(table("language", {x: _worst(of[x] for of in found.values()) for x in languages}))


def _worst(found: Iterable[dict[str, float]]) -> dict[str, float]:
    each = list(found)
    return {key: max(x[key] for x in each) for key in KEYS}


if __name__ == "__main__":
    main()
