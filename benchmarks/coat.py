"""How a rough coat blurs, darkens and colours its base: rules in use and our formulas, against random walks.

    python benchmarks/coat.py [--stacks 150] [--paths 100000] [--seed 0] [--store STORE] [--json]

Walks are a sweep; STORE keeps them, and one that was interrupted goes on.

Coats have an index of 1.2 to 2 and an alpha of 0 to .5; the metals below have an alpha of .01 to .5, eta of .2 to 2
and k of .7 to 5. The walk meets one facet per interface for the roughness, as renderers do, and any number for the
energy. Printed: of log(alpha / true alpha) and of energy / true energy - 1 the mean and the 90th percentile of their
sizes, and the bias. The formulas are those of docs/explanation/coat.md.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import velatura as vt
from velatura.optics import fresnel
from velatura.stack import Interface, Stack

Array = NDArray[np.floating]

COSINES = np.array([1.0, 0.75, 0.5, 0.3])
STEEPNESS, CONE, WIDENING, SHADOW = 2.5, 0.57, 2.5, 2.4  # fitted to 80 stacks of another seed, as those of K


@dataclass(frozen=True)
class Coated:
    """A coat of index n and roughness coat, over a metal of roughness base and normal reflectance f_0."""

    n: float
    coat: float
    base: float
    eta: tuple[float, float, float]
    k: tuple[float, float, float]

    def stack(self) -> Stack:
        return Stack([Interface(eta=self.n, alpha=self.coat), Interface(eta=self.eta, k=self.k, alpha=self.base)])


# How rough the base looks


def ours(c: Coated, cosine: Array) -> Array:
    sin2 = 1 - cosine**2
    below = np.sqrt(c.n**2 - sin2)  # n cos theta_t
    coat = c.coat / (1 + SHADOW * c.coat**2)
    w = ((below * c.base) ** 1.5 + 2 * ((below - cosine) / 2 * coat) ** 1.5) ** (2 / 3)
    alpha = w * np.sqrt(2 / (cosine**2 + np.sqrt(cosine**4 + 4 * STEEPNESS * sin2 * w**2)))
    return alpha / np.sqrt(1 + (1 - 1 / c.n**2) * (alpha / (CONE * (1 + WIDENING * sin2))) ** 2)


def openpbr(factor: Callable[[float], float]) -> Callable[[Coated, Array], Array]:
    # r'^4 = r_B^4 + X r_C^4 with r = sqrt(alpha)
    return lambda c, cosine: np.sqrt(c.base**2 + factor(c.n) * c.coat**2) + 0 * cosine


def openpbr_proposed(c: Coated, cosine: Array) -> Array:
    # OpenPBR, pull request 261 (2026-03-31), whose 1.05 is fitted to random walks
    blur = 1.05 * (c.n - 1) * np.sqrt(1 + c.n**2) / c.n
    return 0.85 * np.tanh(np.hypot(c.n * c.base, blur * c.coat) / 0.85) + 0 * cosine


BLURS: dict[str, Callable[[Coated, Array], Array]] = {
    "ours": ours,
    "ours, at normal incidence": lambda c, cosine: ours(c, np.ones_like(cosine)),
    "model velatura (fgd)": lambda c, cosine: _model(c, cosine),
    "OpenPBR, pull request 261": openpbr_proposed,
    "OpenPBR, X = 2": openpbr(lambda n: 2.0),
    "OpenPBR, X = 1 - 1/n": openpbr(lambda n: 1 - 1 / n),
    "the larger of both": lambda c, cosine: np.maximum(c.base, c.coat) + 0 * cosine,
    "no roughening": lambda c, cosine: c.base + 0 * cosine,
}


def _model(c: Coated, cosine: Array) -> Array:
    alpha = vt.lobes(c.stack(), cosine, model="velatura", reflectance="fgd").alpha[-1]
    return np.sqrt(alpha[0] * alpha[1])


# How much light the base sends back


def darkened(c: Coated, cosine: Array, kept: Array) -> Array:
    """T E_b (1 - K) / (1 - E_b K), colours first, where a share K of the light going up is kept."""
    t = 1 - fresnel.dielectric(cosine, c.n)
    sine2 = (1 - cosine**2) / c.n**2
    base = fresnel.conductor(np.sqrt(1 - sine2), *(np.array(x)[:, None] / c.n for x in (c.eta, c.k)))
    return np.asarray(t * base * (1 - kept) / (1 - base * kept))


def kept_by_cone(c: Coated, cosine: Array) -> Array:
    """K: Fresnel at the mean direction, and what a rough base throws out of the cone."""
    f, sin2 = fresnel.dielectric(cosine, c.n), 1 - cosine**2
    below = np.sqrt(c.n**2 - sin2)
    w2 = (below * c.base) ** 2 + (0.64 * (below - cosine) * c.coat) ** 2
    x = w2 / (0.083 * (1 - 0.97 * sin2)) ** 2
    thrown = (x / (1 + x)) ** 4
    return np.asarray(f * (1 - thrown) + (1 - 1 / c.n**2) * thrown)


def below(c: Coated, cosine: Array) -> Array:
    """All that the model reflects below the coat, in a lobe or not."""
    found = vt.lobes(c.stack(), cosine, model="velatura")
    return np.asarray(found.energy[-1] + found.remainder)


ENERGIES: dict[str, Callable[[Coated, Array], Array]] = {
    "ours": lambda c, cosine: darkened(c, cosine, kept_by_cone(c, cosine)),
    "model velatura": lambda c, cosine: below(c, cosine),
    "Fresnel both ways": lambda c, cosine: darkened(c, cosine, fresnel.dielectric(cosine, c.n)),
    "one pass, 1 - F": lambda c, cosine: darkened(c, cosine, 0 * cosine),
}


def draw(rng: np.random.Generator) -> Coated:
    coat, base = rng.uniform(0, 0.5), rng.uniform(0.01, 0.5)
    eta, k = (tuple(rng.uniform(*limits, 3).tolist()) for limits in ((0.2, 2.0), (0.7, 5.0)))
    return Coated(rng.uniform(1.2, 2.0), coat, base, eta, k)


def walked(stack: Stack, seed: int, paths: int) -> dict[str, Any]:
    """What the metal reflects below the coat; the name of the stack is the seed of its walks."""
    once, often = (
        vt.reference.statistics(stack, COSINES, 0.0, paths, int(stack.name), microsurface)
        for microsurface in (False, True)
    )
    return {"alpha": once.alpha[-1][0], "energy": often.energy[-1]}


def _summary(errors: Array) -> list[str]:
    return [f"{abs(e).mean():.3f} {np.quantile(abs(e), 0.9):.3f} {e.mean():+.3f}" for e in errors.T]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stacks", type=int, default=150)
    parser.add_argument("--paths", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--store", type=Path, help="keeps the walks")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()

    rng = np.random.default_rng(options.seed)
    drawn = [draw(rng) for _ in range(options.stacks)]
    stacks = [coated.stack().replace(name=str(number)) for number, coated in enumerate(drawn)]
    space = vt.Space(material=stacks[0], vary={"material": {"values": stacks}})
    with tempfile.TemporaryDirectory() as folder:
        store = options.store or Path(folder, "walks.zarr")
        found = vt.sweep(space, walked, store=store, chunk=1, paths=options.paths).load()
    alphas, energies = found.alpha.values, found.energy.values

    blurs = {
        name: np.array([np.log(rule(c, COSINES) / true) for c, true in zip(drawn, alphas)])
        for name, rule in BLURS.items()
    }
    lights = {
        name: np.array([rule(c, COSINES) / true - 1 for c, true in zip(drawn, energies)]).reshape(-1, len(COSINES))
        for name, rule in ENERGIES.items()
    }
    if options.json:
        print(json.dumps({kind: {n: abs(e).mean(axis=0).tolist() for n, e in rows.items()} for kind, rows in
                          (("roughness", blurs), ("energy", lights))}))  # fmt: skip
        return
    for title, rows in (("roughness", blurs), ("energy", lights)):
        print(f"{title + ': mean, 90 %, bias':28s}" + "".join(f"{c:>22g}" for c in COSINES))
        for name, errors in rows.items():
            print(f"{name:28s}" + "".join(f"{cell:>22s}" for cell in _summary(errors)))


if __name__ == "__main__":
    main()
