"""The form `exact` beside the walk and the model: equal light, noise, and cost, over stacks of the benchmark.

Values: variance of single estimates at the model's directions, over the model's density and the light squared, and
processor time of an evaluation; with the estimator of pbrt-v4 (`layered_bxdf.py`) where that is one of the stack.

Agreement: light of samples in 24 cells of directions, against that of walks, by z-tests at .01 for all cells of all
stacks together (Sidak); and all light, with 1 % more, as far as samples distinguish that from chance. Pictures:
spheres in the studio by path tracing, rounds interleaved; noise is the standard deviation of a pixel over rounds (root
mean square, and median over pixels), cost is processor time, and error at equal time is noise times the root of time:
of the model noise alone, as the least that estimates of walks can reach.

    python benchmarks/exact.py [--of-each 1] [--kinds "two interfaces" ...] [--count 262144] [--spp 16] [--rounds 6]
        [--size 96] [--parts agreement values pictures] [--variant llvm_ad_rgb]
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from layered_bxdf import fits
from numpy.typing import NDArray
from rows import parsed, row
from scipy import stats

import velatura as vt
from velatura import kernel
from velatura.benchmark.stacks import Case, chosen
from velatura.scenes import scene_dict
from velatura.stack import Stack, dumps

Array = NDArray[np.floating]

LEVEL = 0.01  # false alarms of all z-tests together
LIGHT = 0.005  # least share of the light of a cell that is compared, whose estimate is nearly normal
FOUND = 3.0  # standard errors
DEPTH = 6


def bsdfs(stack: Stack, often: bool) -> dict[str, Any]:
    """Plugins of a stack by name, as dictionaries; facets are met `often`, or once."""
    material = dumps(stack, "json")
    model = {"type": "layered", "material": material, "reflectance": "fgd-multi" if often else "fgd"}
    walk = {"type": "layered_reference", "material": material, "microsurface": often}
    found = {"model": model, "exact": {**model, "form": "exact"}, "walk": walk}
    return {**found, "pbrt": {"type": "layered_bxdf", "material": material}} if fits(stack, often) else found


def interactions(mi: Any, wi: Iterable[float], count: int) -> Any:
    """Points that see one direction, and differ in uv, so that their random numbers do."""
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi, si.uv = mi.Vector3f(*map(float, wi)), mi.Point2f(dr.arange(mi.Float, count) / count, 0.5)
    if mi.is_spectral:
        si.wavelengths = type(si.wavelengths)(450, 520, 580, 640)
    dr.make_opaque(si.wi)  # one kernel for all directions
    return si


def drawn(mi: Any, bsdf: Any, wi: Iterable[float], count: int, seed: int) -> tuple[Array, Array]:
    """Directions of samples, and the energy that they carry; none of mirrors."""
    rng, context = mi.PCG32(count, seed), mi.BSDFContext(mi.TransportMode.Importance)
    u = [rng.next_float32() for _ in range(3)]
    bs, weight = bsdf.sample(context, interactions(mi, wi, count), u[0], mi.Point2f(u[1], u[2]))
    rough = (bs.sampled_type & mi.UInt32(+mi.BSDFFlags.Delta)) == 0
    return np.array(bs.wo, float), np.array(weight & rough, float)


def cells(wo: Array, weight: Array) -> tuple[Array, Array]:
    """Light by colour and cell of directions, (C, 24), and its standard error."""
    place = np.clip((wo[2] + 1) * 3, 0, 5).astype(int) * 4 + (np.arctan2(wo[1], wo[0]) / np.pi * 2 + 2).astype(int) % 4
    first, second = (np.array([np.bincount(place, w**p, 24) for w in weight]) / len(place) for p in (1, 2))
    return first, np.sqrt(np.maximum(second - first**2, 0) / len(place))


def deviations(a: tuple[Array, Array], b: tuple[Array, Array]) -> Array:
    """Differences over their standard errors, in cells with enough light in both for a normal distribution."""
    known = (b[0] > LIGHT) & (a[1] < 0.1 * a[0]) & (b[1] > 0)
    return (a[0] - b[0])[known] / np.hypot(a[1], b[1])[known]


def bound(count: int) -> float:
    """Bound of so many z-tests together (Sidak)."""
    return float(stats.norm.isf((1 - (1 - LEVEL) ** (1 / max(count, 1))) / 2))


def agreement(mi: Any, cases: Iterable[Case], count: int) -> None:
    found, distinguished, tried = [], 0, 0
    for case in cases:
        plugins = bsdfs(case.stack, case.often)
        exact, walk = (mi.load_dict(plugins[name]) for name in ("exact", "walk"))
        for number, wi in enumerate(case.incident):
            a, b = (drawn(mi, bsdf, wi, count, 2 * number + k) for k, bsdf in enumerate((exact, walk)))
            z = deviations(cells(*a), cells(*b))
            means, errors = ([f(w[0]) for _, w in (a, b)] for f in (np.mean, lambda w: np.std(w) / np.sqrt(count)))
            error = np.hypot(*errors)
            distinguished += error < 0.01 * means[0] / (2 * FOUND)
            tried += 1
            found.append(z)
            if len(z):
                print(
                    f"{case.id:24s} {number} light {means[0]:.4f} {means[1]:.4f} ({(means[0] - means[1]) / error:+.1f}"
                    f" standard errors) worst of {len(z)} cells {np.abs(z).max():.2f}",
                    flush=True,
                )
    z = np.abs(np.concatenate(found))
    row("agreement", "worst cell", float(z.max()), "standard errors", f"bound {bound(len(z)):.2f} for {len(z)} cells")
    row("agreement", "cells beyond two standard errors", float(np.mean(z > 2)), "", "0.046 by chance")
    row(
        "agreement",
        "a bias of 1 % is found",
        distinguished / tried,
        "of the directions",
        f"at {FOUND:g} standard errors",
    )


def values(mi: Any, cases: Iterable[Case], count: int) -> None:
    import drjit as dr

    found: dict[str, list[float]] = {}
    for case in cases:
        plugins = {name: mi.load_dict(plugin) for name, plugin in bsdfs(case.stack, case.often).items()}
        context = mi.BSDFContext(mi.TransportMode.Importance)
        for number, wi in enumerate(case.incident):
            si = interactions(mi, wi, count)
            wo = mi.Vector3f(*drawn(mi, plugins["model"], wi, count, number)[0])
            density = np.array(plugins["model"].pdf(context, si, wo), float)
            rng, measured = mi.PCG32(count, number), {}
            for name, bsdf in plugins.items():
                weights, start = [], 0.0
                for _ in range(2):
                    si.uv = mi.Point2f(rng.next_float32(), rng.next_float32())
                    dr.eval(si.uv)
                    start = time.process_time()
                    value = np.array(bsdf.eval(context, si, wo), float)[0]
                    seconds = time.process_time() - start
                    weights.append(np.where(density > 0, value / np.maximum(density, 1e-20), 0.0))
                variance = np.mean((weights[0] - weights[1]) ** 2) / 2 / np.mean(weights) ** 2
                measured[name] = float(variance), seconds / count * 1e6
            print(case.id, number, *(f"{k} {v:.3g} in {t:.2f} us" for k, (v, t) in measured.items()), flush=True)
            for name, (variance, microseconds) in measured.items():
                found.setdefault(f"variance, {name}", []).append(variance)
                found.setdefault(f"time, {name}", []).append(microseconds)
                if name in ("walk", "pbrt"):
                    ratio = np.prod(measured["exact"]) / max(np.prod(measured[name]), 1e-9)
                    found.setdefault(f"variance times time, exact over {name}", []).append(float(ratio))
    for name, each in found.items():
        row("values", name, each, "us" if name.startswith("time") else "")


def pictures(mi: Any, cases: Iterable[Case], spp: int, rounds: int, size: int) -> None:
    ratios: dict[tuple[str, str], list[float]] = {}
    for case in cases:
        images: dict[str, list[Array]] = {}
        seconds: dict[str, list[float]] = {}
        scenes = {}
        for name, plugin in bsdfs(case.stack, case.often).items():
            description = scene_dict("sphere", "studio", mi.load_dict(plugin), (size, size), 1.25)
            scenes[name] = mi.load_dict({**description, "integrator": {"type": "path", "max_depth": DEPTH}})
            mi.render(scenes[name], spp=spp, seed=rounds)  # compile
        for seed in range(rounds):
            for name, scene in scenes.items():
                start = time.process_time()
                images.setdefault(name, []).append(np.array(mi.render(scene, spp=spp, seed=seed)))
                seconds.setdefault(name, []).append(time.process_time() - start)
        variance = {name: np.var(each, axis=0, ddof=1) for name, each in images.items()}
        noise = {name: float(np.sqrt(np.mean(each))) for name, each in variance.items()}
        usual = {name: float(np.sqrt(np.median(each.mean(axis=-1)))) for name, each in variance.items()}
        cost = {name: float(np.median(each)) for name, each in seconds.items()}
        over_walk = {name: noise[name] * (cost[name] / cost["walk"]) ** 0.5 / noise["walk"] for name in noise}
        measured = {
            (title, name): values[name] / values["model"]
            for title, values in (("noise", noise), ("noise of the median pixel", usual), ("time", cost))
            for name in sorted(noise.keys() - {"model"})
        }
        measured |= {("error at equal time", name): over_walk[name] for name in sorted(noise.keys() - {"walk"})}
        print(case.id, *(f"{title}, {name} {x:.2f};" for (title, name), x in measured.items()), flush=True)
        for named, x in measured.items():
            ratios.setdefault(named, []).append(x)
    for (title, name), each in ratios.items():
        row("picture", f"{title}, {name}", each, "x the walk's" if title.startswith("error") else "x the model's")


def main() -> None:
    arguments = parsed(
        __doc__,
        of_each=(1, "stacks of each kind"),
        kinds=([""], "kinds of stacks; default: all of the first edition"),
        count=(2**18, "samples of a direction"),
        spp=16,
        rounds=6,
        size=96,
        parts=(["agreement", "values", "pictures"], "what is measured", ["agreement", "values", "pictures"]),
        variant="llvm_ad_rgb",
    )
    mi = kernel.mitsuba(arguments.variant)
    vt.register()
    kinds: dict[str, list[Case]] = {}
    for case in chosen([kind for kind in arguments.kinds if kind] or None):
        kinds.setdefault(case.kind, []).append(case)
    # Of few stacks, those that meet facets once and often by turns
    cases = [each[(2 * k + n) % len(each)] for k, each in enumerate(kinds.values()) for n in range(arguments.of_each)]
    if "agreement" in arguments.parts:
        agreement(mi, cases, arguments.count)
    if "values" in arguments.parts:
        values(mi, cases, arguments.count)
    if "pictures" in arguments.parts:
        pictures(mi, cases, arguments.spp, arguments.rounds, arguments.size)


if __name__ == "__main__":
    main()
