"""Whether every refusal of inverse design has a way out and a reason that can be right, and how long it takes.

    python benchmarks/refusals.py [--wishes 200] [--seed 0] [--model velatura]

Random wishes of one to three lobes, of any energies, blurs, forms and fixed values, that have no stack. Each must have
a nearest target, which is solved when it is fed back, and whose material can be written; and its reason must be one
that such a lobe can have.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

from velatura.errors import VelaturaError
from velatura.inverse import Infeasible, Target, invert_stack, stacks
from velatura.inverse.explain import infeasible
from velatura.model import DEFAULT, named


def wish(rng: np.random.Generator, most: int = 3) -> Target:
    """A random target of some lobes, feasible or not."""
    lobes = []
    count = int(rng.integers(1, most + 1))
    for n in range(count):
        last = n == count - 1
        energy = float(np.exp(rng.uniform(np.log(0.005), 0))) * rng.uniform(0.05, 1, 3)
        grey = rng.uniform() < (0.6 if n == 0 else 0.3)
        lobe: dict[str, object] = {
            "energy": float(energy[0]) if grey else tuple(map(float, energy)),
            "alpha": 0.0 if rng.uniform() < 0.3 else float(rng.uniform(0, 0.6)),
            "interfaces": int(rng.integers(1, 3)),
            "base": "conductor" if last and rng.uniform() < 0.5 else "dielectric",
        }
        if rng.uniform() < 0.15:
            entries = [float(rng.uniform(1, 3)), *[None] * (int(str(lobe["interfaces"])) - 1)]
            lobe["fixed"] = {"eta": entries}
        elif rng.uniform() < 0.1:
            lobe["fixed"] = {"alpha": [*[None] * (int(str(lobe["interfaces"])) - 1), float(rng.uniform(0, 0.5))]}
        lobes.append(lobe)
    return Target(lobes)


def refused(
    count: int, seed: int, model: str = DEFAULT, most: int = 3
) -> Iterator[tuple[Target, Infeasible, tuple[float, float]]]:
    """Random wishes without a stack, their refusals, and the seconds of the search and of the explanation."""
    rng = np.random.default_rng(seed)
    while count:
        target, start = wish(rng, most), time.process_time()
        if stacks.search(target, named(model)):
            continue
        count, begin = count - 1, time.process_time()
        refusal = infeasible(target, named(model))
        yield target, refusal, (begin - start, time.process_time() - begin)


def wrong(target: Target, refusal: Infeasible, model: str = DEFAULT) -> str | None:
    """What is wrong with a refusal; None where nothing is."""
    if refusal.constraint != "sum":
        lobe = target.lobes[refusal.lobe - 1]
        last, first = lobe.interfaces - 1, refusal.lobe == 1
        fixed = {key: any(entry is not None for entry in entries) for key, entries in lobe.fixed}
        possible = {
            "energy": lobe.base == "dielectric" and lobe.fixed.of("eta", last) is None,
            "bright": lobe.base == "conductor",
            "upper": lobe.interfaces == 2 and (fixed["eta"] or fixed["alpha"]),  # either settles the upper index
            "absorption": lobe.fixed.of("eta", last) is not None,
            "colour": (first and lobe.interfaces == 1) or fixed["tau"],
            "metal": lobe.base == "conductor",
            "blur": not first or lobe.interfaces == 2,
            "index": fixed["eta"] or fixed["k"],
            "fixed": fixed["alpha"],
            "unmet energy": True,
            "unmet blur": True,
        }
        if not possible[refusal.constraint]:
            return f"a reason that cannot be: {refusal.constraint}"
    for direction in refusal.directions:
        try:
            invert_stack(direction.target, model).stack.to_dict()
        except VelaturaError as error:
            return f"{direction.words} is not possible: {error}"
    return None if refusal.directions else "no way out"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wishes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--model", default=DEFAULT)
    options = parser.parse_args()

    faults, reasons, kinds, seconds = 0, Counter[str](), Counter[str](), []
    for target, refusal, took in refused(options.wishes, options.seed, options.model):
        seconds.append(took)
        reasons[refusal.constraint] += 1
        if refusal.directions:
            kinds[" ".join(w for w in refusal.directions[0].what.split() if not w.isdigit())] += 1
        fault = wrong(target, refusal, options.model)
        if fault:
            faults += 1
            print(f"{fault}\n  {refusal}\n  {target.to_dict()['lobes']}")
    print(f"{options.model}: {faults} of {options.wishes} refusals are at fault")
    print("reasons:", dict(reasons.most_common()))
    print("nearest:", dict(kinds.most_common()))
    for name, took in zip(("search", "explanation"), np.transpose(seconds)):
        typical, most = np.quantile(took, [0.5, 0.95])
        print(f"{name}, processor: median {typical:.2f} s, 95 % below {most:.2f} s, at most {took.max():.2f} s")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
