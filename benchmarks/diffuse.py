"""How far the albedo of a diffuse base under a stack, by a model of the papers, is from random walks.

    python benchmarks/diffuse.py [--stacks 60] [--paths 400000] [--seed 2] [--interfaces 2] [--model belcour2018]

Random stacks of 1, 2, ... interfaces in turn: indices from 1.3 to 2.2, roughness from 0 to .7 (one in ten is smooth);
below three in five a medium that absorbs, up to an optical depth of 2; albedos of the base from .1 to .95, colours
apart. Cosines 1, .6 and .2; light bounces between facets. The table lists the means and maxima of |albedo/true - 1|, in
per cent, and the mean standard error of the walks. Stacks that are more than 2 % off are listed.
"""

from __future__ import annotations

import numpy as np
from rich.progress import track
from rows import parsed

import velatura as vt
from velatura.model import named
from velatura.model.papers import bsdf
from velatura.stack import Diffuse, Interface, Material, Medium, Stack

COSINES = (1.0, 0.6, 0.2)


def random_stack(rng: np.random.Generator, interfaces: int) -> Stack:
    """Dielectrics over a diffuse base, as described above."""
    layers: list[Interface | Medium | Diffuse] = []
    for _ in range(interfaces):
        alpha = rng.uniform(0, 0.7) if rng.random() > 0.1 else 0.0
        layers.append(Interface(eta=rng.uniform(1.3, 2.2), alpha=alpha))
        if rng.random() < 0.6:
            layers.append(Medium(sigma_a=(0.0, rng.uniform(0, 1), rng.uniform(0, 2))))
    return Stack([*layers, Diffuse(albedo=tuple(rng.uniform(0.1, 0.95, 3)))])


def albedo(stack: Stack, cos_theta: tuple[float, ...], model: str) -> np.ndarray:
    """Albedo of the base in closed form, (3, cosines)."""
    body = bsdf.body(Material.of(stack), named(model))
    cosine = np.array(cos_theta)
    base = body.base((np.sqrt(1 - cosine**2), 0 * cosine, cosine))
    assert base is not None
    return np.broadcast_to(base.energy, (3, len(cosine)))


def main() -> None:
    options = parsed(__doc__, stacks=60, paths=400_000, seed=2, interfaces=(2, "at most"), model="belcour2018")

    rng = np.random.default_rng(options.seed)
    errors, noises, counts = [], [], np.arange(options.stacks) % options.interfaces + 1
    for count in track(counts, description="walking"):
        stack = random_stack(rng, int(count))
        truth = vt.reference.statistics(stack, COSINES, 0.0, options.paths, seed=3, microsurface=True)
        assert truth.standard_error is not None
        errors.append(100 * (albedo(stack, COSINES, options.model) / truth.energy[-1] - 1))
        noises.append(100 * truth.standard_error.energy[-1] / truth.energy[-1])
        if np.abs(errors[-1]).max() > 2:
            print([layer.model_dump(exclude_defaults=True) for layer in stack.layers], errors[-1].round(1).tolist())

    error, noise = np.abs(errors), np.array(noises)
    cells = {"all": np.ones(len(counts), bool), **{f"{k} interfaces": counts == k for k in np.unique(counts)}}
    print(f"{'':16s}{'mean':>8s}{'95 %':>8s}{'worst':>8s}{'noise':>8s}")
    for name, here in cells.items():
        found = error[here]
        print(
            f"{name:16s}{found.mean():8.2f}{np.percentile(found, 95):8.2f}{found.max():8.2f}{noise[here].mean():8.2f}"
        )
    for axis, names in ((2, [f"cosine {c:g}" for c in COSINES]), (1, ["clear", "depth to 1", "depth to 2"])):
        for k, name in enumerate(names):
            found = np.take(error, k, axis)
            print(f"{name:16s}{found.mean():8.2f}{np.percentile(found, 95):8.2f}{found.max():8.2f}")


if __name__ == "__main__":
    main()
