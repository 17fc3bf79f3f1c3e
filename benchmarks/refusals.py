"""Whether every refusal of inverse design has a way out and a reason that can be right, and how long it takes.

    python benchmarks/refusals.py [--wishes 200] [--seed 0] [--model velatura]

Random wishes of one to three lobes, of any energies, blurs, forms and fixed values, that have no stack. Each must have
a nearest target, which is solved when it is fed back, and whose material can be written. No two ways out are the same.
The reason must be the true one: the lobes down to the one that it names have a stack once just what it names is lifted.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np
from rows import parsed

from velatura.errors import VelaturaError
from velatura.inverse import Infeasible, Target, invert, invert_stack, solution
from velatura.inverse.explain import infeasible
from velatura.inverse.lobes.target import BLUR
from velatura.model import DEFAULT, named

OF_FIXED = ("absorption", "excess", "index", "fixed", "upper")  # reasons that freeing what is fixed lifts
DIMMER, BRIGHTER = ("energy", "bright", "unmet energy"), ("metal", "mirror", "upper")  # or another energy
LIFTED = ("absorption", "colour", "energy", "metal", "blur")  # of which each lifts something else
STEPS = 12  # by which what a reason names is changed


def wish(rng: np.random.Generator, most: int = 3, interfaces: int = 2) -> Target:
    """A random target of some lobes, of up to so many interfaces each, feasible or not."""
    lobes = []
    count = int(rng.integers(1, most + 1))
    for n in range(count):
        last = n == count - 1
        energy = float(np.exp(rng.uniform(np.log(0.005), 0))) * rng.uniform(0.05, 1, 3)
        grey = rng.uniform() < (0.6 if n == 0 else 0.3)
        lobe: dict[str, object] = {
            "energy": float(energy[0]) if grey else tuple(map(float, energy)),
            "alpha": 0.0 if rng.uniform() < 0.3 else float(rng.uniform(0, 0.6)),
            "interfaces": int(rng.integers(1, interfaces + 1)),
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
        if invert.search(target, named(model)):
            continue
        count, begin = count - 1, time.process_time()
        refusal = infeasible(target, named(model))
        yield target, refusal, (begin - start, time.process_time() - begin)


def lifted(target: Target, n: int, reason: str) -> Iterator[Target]:
    """The lobes of a target down to the n-th, with just what a reason names changed, by more and more."""
    whole = target.model_copy(update={"lobes": target.lobes[: n + 1]})
    lobe = whole.lobes[n]
    colour = np.array(lobe.colour)
    if reason in OF_FIXED and lobe.fixed != lobe.fixed.films_alone:
        yield whole.with_lobe(n, fixed=lobe.fixed.films_alone)
    ends = {DIMMER: 1e-3, BRIGHTER: 1 / max(colour.max(), 1e-3)}
    for scale in (x for reasons, end in ends.items() if reason in reasons for x in np.geomspace(1, end, STEPS)):
        yield whole.with_lobe(n, energy=tuple((scale * colour).tolist()))
    for bound in np.geomspace(colour.max(), colour.min() + 1e-6, STEPS) if reason in DIMMER else ():
        yield whole.with_lobe(n, energy=tuple(np.minimum(colour, bound).tolist()))
    if reason == "colour":
        for energy in np.geomspace(colour.min() + 1e-6, colour.max(), STEPS):
            yield whole.with_lobe(n, energy=float(energy))
    if reason in ("blur", "unmet blur"):
        for variance in BLUR.variance(lobe.roughness) + np.geomspace(1e-4, 4, STEPS):
            yield whole.with_variance(n, float(variance))


def possible(target: Target, n: int, reason: str, model: str) -> bool:
    """Whether the first lobes have a stack, by the nearest model in closed form, once what a reason names is lifted."""
    adder = named(model).surrogate
    return any(solution.in_closed_form(other, adder) for other in lifted(target, n, reason))


def wrong(target: Target, refusal: Infeasible, model: str = DEFAULT) -> str | None:
    """The fault of a refusal; None without one."""
    if refusal.constraint != "sum" and not possible(target, refusal.lobe - 1, refusal.constraint, model):
        # Several may be in the way; then it is wrong only if lifting another one is enough
        others = [key for key in LIFTED if possible(target, refusal.lobe - 1, key, model)]
        if others:
            return f"a reason that is not the true one: {refusal.constraint}, not {' or '.join(others)}"
    if len({direction.words for direction in refusal.directions}) < len(refusal.directions):
        return "the same way out twice"
    for direction in refusal.directions:
        try:
            invert_stack(direction.target, model).stack.to_dict()
        except VelaturaError as error:
            return f"{direction.words} is not possible: {error}"
    return None if refusal.directions else "no way out"


def main() -> int:
    options = parsed(__doc__, wishes=200, seed=0, model=DEFAULT)

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
