"""Thin films: smooth stacks against `tmm`, rough ones against the walk, and what they cost in a render.

- smooth: random stacks of coherent films between thick media, absorbing or clear, s and p apart: the largest error.
- rough: energies of a model minus those of walks, for random stacks with films and for the same ones without, by kind.
- queries: albedos that are queried in a spectral variant minus those of samples, of a film of index 1.5 on a metal,
  over roughness and thickness: the largest difference at one wavelength, and in the mean over all of them.
- cost: CPU time of a render, and of `eval_pdf`, with films over that without, interleaved; and of an index of films
  from a texture over that of a thickness from one.

    python benchmarks/films.py [--smooth 10000] [--stacks 12] [--paths 300000] [--queries 100000] [--rounds 7]
        [--seed 0] [--model NAME]
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

from mixed_films import random_mixed
from render import picture
from rows import parsed, row

import velatura as vt
from velatura import kernel
from velatura.model import DEFAULT, named
from velatura.stack import Film, Interface, Layer, Medium, Stack

COSINES = (1.0, 0.7, 0.35)
WAVELENGTHS, QUERIED = 96, (1.0, 0.8, 0.6, 0.35)  # and cosines of queries

Array = NDArray[np.floating]


def smooth(count: int, seed: int) -> float:
    """The largest error of reflectance or transmittance."""
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(count):
        mixed, cosine = random_mixed(rng)
        for kind in "sp":
            worst = max(worst, float(np.abs(np.subtract(mixed.summed(kind, cosine), mixed.exact(kind, cosine))).max()))
    return worst


# Rough stacks --------------------------------------------------------------------------------------------------------


def films(rng: np.random.Generator, absorbs: bool = False) -> tuple[Film, ...]:
    """One or two, of any thickness, half of them below 500 nm."""
    return tuple(
        Film(
            eta=float(rng.uniform(1.2, 2.6)),
            k=float(rng.uniform(0, 0.5)) if absorbs and rng.random() < 0.5 else 0.0,
            thickness_nm=float(rng.uniform(0, 500) if rng.random() < 0.5 else rng.uniform(0, 5000)),
        )
        for _ in range(rng.integers(1, 3))
    )


def alpha(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.02, 0.55))


def metal(rng: np.random.Generator) -> Interface:
    eta, k = (tuple(map(float, rng.uniform(*span, 3))) for span in ((0.2, 2.0), (1.5, 5.0)))
    return Interface(eta=eta, k=k, alpha=alpha(rng), films=films(rng, absorbs=True))


def glass(rng: np.random.Generator) -> Interface:
    return Interface(eta=float(rng.uniform(1.2, 2.2)), alpha=alpha(rng), films=films(rng))


def gilt(rng: np.random.Generator) -> Interface:
    """A dielectric whose films absorb: of metals below 40 nm, or tinted."""
    tinted = Film(
        eta=float(rng.uniform(1.2, 2.6)), k=float(rng.uniform(0, 0.5)), thickness_nm=float(rng.uniform(0, 500))
    )
    metals = Film(
        eta=float(rng.uniform(0.2, 2.0)), k=float(rng.uniform(1.5, 5.0)), thickness_nm=float(rng.uniform(0, 40))
    )
    both = (tinted, metals) if rng.random() < 0.5 else (tinted,)
    return glass(rng).model_copy(update={"films": both})


def mirror(rng: np.random.Generator) -> Interface:
    """Metals like `gilt`, through which nothing passes."""
    return Interface(conductor="mirror", alpha=alpha(rng), films=gilt(rng).films)


def coated(rng: np.random.Generator) -> list[Layer]:
    medium = [Medium(sigma_a=tuple(map(float, rng.uniform(0, 0.5, 3))))] if rng.random() < 0.5 else []
    return [glass(rng), *medium, metal(rng)]


def pane(rng: np.random.Generator) -> list[Layer]:
    return [glass(rng), Interface(eta=1.0, alpha=alpha(rng), films=films(rng))]


def many(rng: np.random.Generator) -> list[Layer]:
    return [glass(rng), glass(rng), metal(rng)]


KINDS: dict[str, Callable[[np.random.Generator], list[Layer]]] = {
    "metal": lambda rng: [metal(rng)],
    "brushed metal": lambda rng: [metal(rng).model_copy(update={"alpha": (alpha(rng), alpha(rng))})],
    "glass": lambda rng: [glass(rng)],
    "glass, films absorb": lambda rng: [gilt(rng)],
    "mirror, films absorb": lambda rng: [mirror(rng)],
    "coated metal": coated,
    "metal under films that absorb": lambda rng: [gilt(rng), metal(rng)],
    "pane": pane,
    "two coats over metal": many,
}


def without(stack: Stack) -> Stack:
    """The stack without its films."""
    return Stack([x.model_copy(update={"films": ()}) if isinstance(x, Interface) else x for x in stack.layers])


def errors(stack: Stack, model: str, often: bool, paths: int, seed: int) -> list[float]:
    """Energies by colour of all that is reflected, and of all that passes, minus those of walks."""
    chosen = named(model, reflectance="fgd-multi" if often else "fgd")
    truth = vt.reference.statistics(stack, COSINES, paths=paths, seed=seed, microsurface=often)
    found = vt.lobes(stack, COSINES, model=chosen)
    off = [np.sum(found.energy, axis=0) + found.remainder - np.sum(truth.energy, axis=0)]
    if truth.transmitted:
        off.append(found.passed - truth.transmitted.energy)
    return [float(x) for x in np.ravel(off)]


def rough(model: str, stacks: int, paths: int, seed: int) -> Iterator[tuple[str, bool, list[list[float]]]]:
    """Errors with films, and without, by kind and by whether facets are met often."""
    for number, (kind, make) in enumerate(KINDS.items()):
        for often in (False, True):
            rng, found = np.random.default_rng([seed, number]), list[list[float]]([[], []])
            for k in range(stacks):
                stack = Stack(make(rng))
                for column, each in zip(found, (stack, without(stack))):
                    column += errors(each, model, often, paths, seed + k)
            yield kind, often, found


# Queries --------------------------------------------------------------------------------------------------------------


def queries(model: str, count: int, seed: int) -> None:
    """Mean weights of samples of a metal under a film, `count` at a wavelength, over the cosines."""
    import drjit as dr

    mi = kernel.mitsuba("llvm_ad_spectral")
    nm = np.linspace(380, 720, WAVELENGTHS).reshape(-1, 4)

    def hit(cosine: float, at: Array, count: int) -> Any:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0, cosine)
        si.wavelengths = mi.UnpolarizedSpectrum(*at.tolist())
        return si

    def off(bsdf: Any, cosine: float, at: Array) -> Array:
        rng = mi.PCG32(count, initseq=seed)
        u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), hit(cosine, at, count), *u)
        return np.ravel(bsdf.eval_diffuse_reflectance(hit(cosine, at, 1))) - np.mean(np.array(weight), axis=1)

    for alpha in (0.005, 0.03, 0.1, 0.3):
        for thickness_nm in (500.0, 1500.0, 5000.0):
            film = Film(eta=1.5, thickness_nm=thickness_nm)
            bsdf = vt.bsdf(Stack([Interface(eta=2.0, k=1.0, alpha=alpha, films=[film])]), model=model)
            found = np.array([[off(bsdf, cosine, at) for at in nm] for cosine in QUERIED])
            name = f"alpha {alpha:g}, {thickness_nm:g} nm"
            row("queries", f"{name}: at a wavelength", float(np.abs(found).max()), "")
            row("queries", f"{name}: in the mean", float(np.abs(found.mean(axis=(1, 2))).max()), "")


# Cost ----------------------------------------------------------------------------------------------------------------


COSTS = {
    "metal": Stack([Interface(conductor="Al", alpha=0.15, films=[Film(eta=1.46, thickness_nm=320)])]),
    "glass": Stack([Interface(eta=1.5, alpha=0.1, films=[Film(eta=2.0, thickness_nm=200)])]),
    "coated metal": Stack(
        [
            Interface(eta=1.5, alpha=0.05, films=[Film(eta=2.0, thickness_nm=200)]),
            Interface(conductor="Al", alpha=0.15, films=[Film(eta=1.46, thickness_nm=320)]),
        ]
    ),
    "pane": Stack(
        [
            Interface(eta=1.5, alpha=0.1, films=[Film(eta=2.0, thickness_nm=200)]),
            Interface(eta=1.0, alpha=0.05, films=[Film(eta=2.0, thickness_nm=200)]),
        ]
    ),
}


def evaluation(mi: Any, bsdf: Any, count: int) -> Callable[[int], None]:
    """A function that evaluates random pairs of directions on the sphere."""
    import drjit as dr

    rng = mi.PCG32(count)

    def job(_: int) -> None:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi, wo = (
            mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32())) for _ in range(2)
        )
        dr.eval(bsdf.eval_pdf(mi.BSDFContext(), si, wo), rng)
        dr.sync_thread()

    return job


def ratios(jobs: list[Callable[[int], None]], rounds: int) -> list[float]:
    """The CPU time of the first job over that of the second, interleaved."""
    found = []
    for number in range(rounds + 1):
        seconds = []
        for job in jobs:
            start = time.process_time()
            job(number)
            seconds.append(time.process_time() - start)
        found.append(seconds[0] / seconds[1])
    return found[1:]  # the first one compiles


def textured(mi: Any, folder: str) -> Iterator[tuple[str, list[Stack]]]:
    """Stacks of `COSTS` whose lowest film has an index from a texture, and a thickness."""
    image = Path(folder) / "ramp.exr"
    mi.util.write_bitmap(str(image), np.linspace(0, 1, 16, dtype=np.float32).reshape(4, 4, 1), write_async=False)
    for name in ("metal", "glass", "coated metal"):
        film = f"layer{len(COSTS[name].layers) - 1}_film0_"
        eta = {"texture": image, "scale": 0.5, "offset": 1.5}
        thickness = {"texture": image, "scale": 200.0, "offset": 100.0}
        yield (
            f"{name}, textured",
            [COSTS[name].replace(**x) for x in ({film + "eta": eta}, {film + "thickness_nm": thickness})],
        )


def cost(model: str, rounds: int) -> None:
    mi = kernel.mitsuba("llvm_ad_rgb")
    with tempfile.TemporaryDirectory() as folder:
        found = [(name, [stack, without(stack)], 32) for name, stack in COSTS.items()]
        found += [(name, both, 4) for name, both in textured(mi, folder)]
        made = [(name, [vt.bsdf(each, model=model) for each in both], spp) for name, both, spp in found]
    for name, bsdfs, spp in made:
        row("cost", f"{name}: render", ratios([picture(mi, bsdf, 256, spp) for bsdf in bsdfs], rounds), "")
        row("cost", f"{name}: eval_pdf", ratios([evaluation(mi, bsdf, spp << 16) for bsdf in bsdfs], rounds), "")


def main() -> None:
    options = parsed(__doc__, smooth=10_000, stacks=12, paths=300_000, queries=100_000, rounds=7, seed=0, model=DEFAULT)
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of tmm, where nothing passes
    if options.smooth:
        print(f"smooth: {options.smooth} stacks, s and p: error {smooth(options.smooth, options.seed):.1e}", flush=True)
    if options.stacks:
        print(f"{'rough, model minus walk':42s}{'with films':>26s}{'without':>26s}")
        for kind, often, found in rough(options.model, options.stacks, options.paths, options.seed):
            cells = (f"mean {np.abs(x).mean():.4f} worst {np.abs(x).max():.4f}" for x in found)
            name = f"{kind}, facets met {'often' if often else 'once'}"
            print(f"{name:42s}" + "".join(f"{cell:>26s}" for cell in cells), flush=True)
    if options.queries:
        queries(options.model, options.queries, options.seed)
    if options.rounds:
        cost(options.model, options.rounds)


if __name__ == "__main__":
    main()
