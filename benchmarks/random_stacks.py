"""How rough models say that the base of a stack looks, against random walks through stacks drawn at random.

    python benchmarks/random_stacks.py [--stacks 90] [--paths 300000] [--seed 0] [--store STORE]

Walks are a sweep; STORE keeps them, and one that was interrupted goes on.

Stacks have one to three dielectrics, of an index in 1.1 to 2.2, over a metal of eta in 0.2 to 2 and k in 1 to 5; every
alpha lies in 0.01 to 0.5. Of the lobe of the metal, the equivalent alpha at four cosines of incidence is compared with
that of every named model, and with that of two roughness maps for which all else is the same. Printed: the mean of
|log(alpha / true alpha)|, and in parentheses that of the logarithm itself, the bias.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rows import parsed

import velatura as vt
from velatura.stack import Interface, Stack

COSINES = (1.0, 0.75, 0.5, 0.3)
PLAIN: dict[str, Any] = {"model": "belcour2018", "reflectance": "fresnel", "tir": "off", "scale": "shipped"}
ROWS: dict[str, dict[str, Any]] = {
    **{f"{name} map, fresnel, no TIR": {**PLAIN, "map": name} for name in ("belcour", "weier")},
    **{model.name: {"model": model.name} for model in vt.MODELS},
}


def random_stack(rng: np.random.Generator) -> Stack:
    """Dielectrics over a metal, as described above."""
    count = rng.integers(1, 4)
    coats = [Interface(eta=rng.uniform(1.1, 2.2), alpha=rng.uniform(0.01, 0.5)) for _ in range(count)]
    return Stack([*coats, Interface(eta=rng.uniform(0.2, 2.0), k=rng.uniform(1.0, 5.0), alpha=rng.uniform(0.01, 0.5))])


def walked(stack: Stack, seed: int, paths: int, walks: int) -> dict[str, Any]:
    """The roughness of the metal's lobe, and its standard error; `walks` is their seed, the same for all stacks."""
    found = vt.reference.statistics(stack, COSINES, paths=paths, seed=walks)
    assert found.standard_error
    return {"alpha": found.alpha[-1][0], "error": found.standard_error.alpha[-1][0]}


def main() -> None:
    options = parsed(__doc__, stacks=90, paths=300_000, seed=0, store=(Path, "keeps the walks"))

    # Walk
    rng = np.random.default_rng(options.seed)
    stacks = [random_stack(rng) for _ in range(options.stacks)]
    space = vt.Space(material=stacks[0], vary={"material": {"values": stacks}})
    with tempfile.TemporaryDirectory() as folder:
        store = options.store or Path(folder, "walks.zarr")
        truth = vt.sweep(space, walked, store=store, chunk=1, paths=options.paths, walks=options.seed).load()
    alphas, noise = truth.alpha.values, truth.error.values / truth.alpha.values
    print(f"{options.stacks} stacks, {options.paths} paths each; the truth's noise {noise.mean():.4f}, relative")

    # Compare
    print(f"{'cosine of incidence':36s}" + "".join(f"{cosine:18g}" for cosine in COSINES))
    for name, choices in ROWS.items():
        modelled = np.array([vt.lobes(stack, COSINES, **choices).alpha[-1][0] for stack in stacks])
        errors = np.log(np.maximum(modelled, 1e-3) / alphas)
        cells = (f"{size:.3f} ({bias:+.3f})" for size, bias in zip(abs(errors).mean(axis=0), errors.mean(axis=0)))
        print(f"{name:36s}" + "".join(f"{cell:>18s}" for cell in cells))


if __name__ == "__main__":
    main()
