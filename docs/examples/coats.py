"""
A sweep over coats
==================

How rough a metal looks below a rough coat: a map over both roughnesses, computed by `vt.sweep` into a Zarr store, and a
formula of four constants fitted to it. With `steps=100` it takes minutes, and finds the
same constants within 1 %. White contours are those of the map, dashed ones those of the fit.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import velatura as vt

METAL = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=0.2, k=3.9, alpha=0.1)])


def coats(store: Path, steps: int = 16, executor: Any = None) -> Any:
    """Lobes of coats of every roughness on metals of every roughness."""
    vary = {
        "layer0_alpha": {"range": [0.0, 0.5], "steps": steps},
        "layer1_alpha": {"range": [0.01, 0.5], "steps": steps},
    }
    space = vt.Space(material=METAL, vary=vary)
    return vt.sweep(space, "lobes", store=store, executor=executor, cos_theta=[1.0])


def apparent(found: Any) -> Any:
    """The roughness of the metal's lobe, by that of coat and metal."""
    return found.alpha.sel(axis="u").isel(interface=1, direction=0).load()


def formula(coat: Any, base: Any, constants: Any) -> Any:
    """A sum of powers of both roughnesses, bent where it is wide."""
    scale, share, power, bend = constants
    sum_of_powers = ((scale * base) ** power + (share * coat) ** power) ** (1 / power)
    return sum_of_powers / np.sqrt(1 + bend * sum_of_powers**2)


def fitted(alpha: Any) -> tuple[Any, Any]:
    """The constants of the formula, and what remains of log(alpha) at every coat."""
    coat, base = (alpha[name] for name in ("layer0_alpha", "layer1_alpha"))

    def rest(constants: Any) -> Any:
        return np.log(formula(coat, base, constants) / alpha).transpose(*alpha.dims)

    start = [1.5, 0.5, 2.0, 0.1]
    constants = least_squares(lambda x: rest(x).values.ravel(), start, bounds=(1e-3, 10)).x
    return constants, rest(constants)


def draw(alpha: Any, constants: Any) -> None:
    """The map, and the contours of the fit."""
    coat, base = (alpha[name].values for name in ("layer0_alpha", "layer1_alpha"))
    figure, axes = plt.subplots(figsize=(6, 4.6), layout="constrained")
    filled = axes.pcolormesh(base, coat, alpha, cmap="viridis", shading="nearest", rasterized=True)
    levels = np.arange(0.1, 0.8, 0.1)
    style: dict[str, Any] = {"levels": levels, "linewidths": 1.2}
    axes.contour(base, coat, alpha, colors="white", **style)
    fit = axes.contour(base, coat, formula(coat[:, None], base, constants), colors="black", linestyles="--", **style)
    axes.clabel(fit, fmt="%.1f")
    axes.set(xlabel="alpha of the metal", ylabel="alpha of the coat")
    figure.colorbar(filled, label="alpha of the metal's lobe")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        alpha = apparent(coats(Path(folder, "coats.zarr")))
    constants, rest = fitted(alpha)
    print(f"{alpha.size} coats, apparent alpha {float(alpha.min()):.3f} to {float(alpha.max()):.3f}")
    print("scale {:.3f}, share {:.3f}, power {:.2f}, bend {:.2f}".format(*constants))
    print(f"error: {100 * float(abs(rest).mean()):.1f} % in the mean, {100 * float(abs(rest).max()):.1f} % at most")
    draw(alpha, constants)
