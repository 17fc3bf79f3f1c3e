"""Kubelka and Munk's theory beside the transport of light: random mixtures of pigments, opaque and as films.

    python benchmarks/pigments.py [--mixtures 100] [--seed 35] [--plot FILE] [--iadpython]

Errors are those of reflectances, formula minus transport by the energies of `velatura`: at most, and in the mean. Light
is diffuse and there is no surface, or one of index 1.5 is seen along the normal and Saunderson's correction stands for
it. Another relation of coefficients is tried, too, S = 3/4 (1 - g) sigma_s - sigma_a / 4 (Star et al. 1988).
`--iadpython` adds opaque mixtures by the package of that name, an adding-doubling by another author.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rows import parsed, row

import velatura as vt
from velatura import tables
from velatura.model.solved.energies.energies import energies
from velatura.model.solved.lobes import widths
from velatura.optics import kubelka_munk
from velatura.stack import Material
from velatura.stack.pigments import absorption, scattering

Array = NDArray[np.floating]

PIGMENTS = 4  # of which mixtures are made
ETA = 1.5
ASYMMETRIES = 0.0, 0.5, 0.8
LENGTHS = 40.0  # of diffusion: opaque
FILMS = 0.1, 0.5, 2.0  # S times depth
GROUNDS = 0.0, 0.5, 0.9
NODES = 8  # cosines of diffuse light
IADPYTHON_NODES = 16  # more lose light to rounding


def mixtures(count: int, seed: int) -> tuple[Array, Array]:
    """K and S (count,) of random mixtures of a few pigments, the first white and the last black."""
    rng = np.random.default_rng(seed)
    k, s = np.logspace(-3, 1.5, PIGMENTS), 10 ** rng.uniform(-0.3, 0.3, PIGMENTS)
    shares = 10 ** rng.uniform(-4, 0, (count, PIGMENTS))
    return shares @ k, shares @ s


def cosines() -> tuple[Array, Array]:
    """Cosines of diffuse light, with the normal at the end, and their weights."""
    x, weights = np.polynomial.legendre.leggauss(NODES)
    mu = (x + 1) / 2
    return np.append(mu, 1.0), np.append(weights * mu, 0.0)


def transported(k: Array, s: Array, depth: float, g: float, ground: float = 0.0, eta: float = 1.0) -> Array:
    """Reflectances (N, NODES + 1) of media of K and S (N,), for light at `cosines`."""
    surface = [vt.Interface(eta=eta)] if eta != 1 else []
    material = Material.of(vt.Stack([*surface, vt.Medium(depth=depth, g=g), vt.Diffuse(albedo=ground)]))
    material = replace(
        material.with_layer(len(surface), sigma_a=absorption(k)[:, None], sigma_s=scattering(s, g)[:, None])
    )
    mu, _ = cosines()
    found = energies(material, mu, 0 * mu, tables.load(), widths.nearly_straight, incidences=np.zeros(0))
    return np.broadcast_to(found.lobes.sum(axis=0) + found.veils.sum(axis=0) + found.rest, (len(k), len(mu)))


def opaque(k: Array, s: Array, g: float, eta: float = 1.0) -> Array:
    """The same of opaque media."""
    sigma_a, reduced = absorption(k), scattering(s, 0.0)
    depth = float(np.max(LENGTHS / np.sqrt(3 * sigma_a * (sigma_a + reduced))))
    return transported(k, s, depth, g, eta=eta)


def diffuse(reflectances: Array) -> Array:
    """Reflectances (N,) of diffuse light."""
    return np.asarray(reflectances @ cosines()[1])


def star(k: Array, s: Array) -> Array:
    """Reflectance of opaque media by the relation of Star et al. 1988."""
    return kubelka_munk.opaque(k, np.maximum(s - absorption(k) / 4, 1e-9))


def by_iadpython(k: Array, s: Array, g: float, eta: float) -> Array:
    """Reflectances (N,) by iadpython: of diffuse light without a surface, else along the normal."""
    import iadpython

    found = []
    for sigma_a, sigma_s in zip(absorption(k), scattering(s, g)):
        depth = LENGTHS / np.sqrt(3 * sigma_a * (sigma_a + sigma_s * (1 - g)))
        b, a = (sigma_a + sigma_s) * depth, sigma_s / (sigma_a + sigma_s)
        indices = {"n": eta, "n_above": 1.0, "n_below": 1.0}
        normal, _, whole, _ = iadpython.Sample(a=a, b=b, g=g, d=1, **indices, quad_pts=IADPYTHON_NODES).rt()
        found.append(normal if eta != 1 else whole)
    return np.array(found, float)


def report(name: str, error: Array) -> None:
    row("pigments", name, [float(np.abs(error).max())], "", f"mean {np.abs(error).mean():.4f}")


def draw(k: Array, s: Array, path: Path) -> None:
    """Errors over reflectance, of the formula and with a surface."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    formula = kubelka_munk.opaque(k, s)
    for g in ASYMMETRIES:
        left.plot(formula, formula - diffuse(opaque(k, s, g)), ".", label=f"g = {g:g}")
        seen = kubelka_munk.outside(formula, ETA)
        right.plot(seen, seen - opaque(k, s, g, ETA)[:, -1], ".", label=f"g = {g:g}")
    left.plot(formula, star(k, s) - diffuse(opaque(k, s, 0.0)), "k.", markersize=2, label="Star et al. 1988")
    left.set(title="diffuse light, no surface", xlabel="reflectance by Kubelka and Munk", ylabel="its error")
    right.set(title=f"along the normal, index {ETA:g}", xlabel="reflectance by Saunderson's correction")
    for axes in (left, right):
        axes.axhline(0, color="0.7", linewidth=0.8)
        axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    options: Any = parsed(__doc__, mixtures=100, seed=35, plot=Path, iadpython=False)
    k, s = mixtures(options.mixtures, options.seed)
    formula = kubelka_munk.opaque(k, s)
    for g in ASYMMETRIES:
        inside, outside = diffuse(opaque(k, s, g)), opaque(k, s, g, ETA)[:, -1]
        report(f"opaque, g {g:g}", formula - inside)
        report(f"opaque, g {g:g}, Star et al. 1988", star(k, s) - inside)
        report(f"opaque under {ETA:g}, g {g:g}", kubelka_munk.outside(formula, ETA) - outside)
        if options.iadpython:
            report(f"iadpython, opaque, g {g:g}", by_iadpython(k, s, g, 1.0) - inside)
            report(f"iadpython, opaque under {ETA:g}, g {g:g}", by_iadpython(k, s, g, ETA) - outside)
    for thickness in FILMS:
        # All of S = 1, so that one depth is that of all
        errors = [
            kubelka_munk.over(k / s, 1 + 0 * s, thickness, ground)
            - diffuse(transported(k / s, 1 + 0 * s, thickness, 0.0, ground))
            for ground in GROUNDS
        ]
        report(f"films of S depth {thickness:g}", np.concatenate(errors))
    if options.plot:
        draw(k, s, options.plot)


if __name__ == "__main__":
    main()
