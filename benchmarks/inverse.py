"""How exact inverse design is, and how fast.

    python benchmarks/inverse.py [--targets 10000] [--physical 300] [--models velatura ...] [--parts exactness ...]

Exactness is a round trip: random targets of one to three lobes, those that have a stack, are inverted, written as
materials, and read by `vt.lobes`. For a model without a closed form they are those of the nearest model that has one;
which of these it refuses is counted. Lobes that `velatura` reads of random stacks are targets, too, of which
none may be refused; so are those of rough interfaces (`--parts rough`), and those of the paper's figures
(`--parts figures`). Times are the best of several runs.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from rows import counted, parsed, row

from velatura.figures.bati2021_targets import FIGURES
from velatura.inverse import Above, Choice, EquivalenceClass, Target, invert, invert_stack
from velatura.inverse.lobes import equivalence, interface, pair
from velatura.inverse.lobes.partial_stack import Array, Layers, join, take
from velatura.inverse.local.dragged import seen
from velatura.model import DEFAULT, MODELS, Model, named
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Isotropic, Roughness
from velatura.stack import Film, Interface, Layer, Medium, Stack

EXACT = 1e-6  # of energies and variances, at normal incidence
CONFIGURATION, PAIRS, REACH = 5e-3, 2e5, 50e-3  # seconds, targets a second, seconds
LEAST_STEP = 0.08  # of the logarithm of the index, of random stacks
SMOOTH, ROUGH = ((1.1, 2.2), (0.01, 0.15)), ((1.8, 2.6), (0.25, 0.4))  # indices and first roughnesses of these
BRUSHED = 0.25  # share of them
COATED, FILMED = (
    0.5,
    ("velatura", "bati2021"),
)  # share of interfaces with films, and models that are asked for such stacks
NODES, FINE = equivalence.NODES, 4 * equivalence.NODES  # on which sets of indices are looked for, and truly are
CHUNK = 4096  # targets at once: what the caches of a core hold

#: Parts of random stacks, what those are, and options of `physical_targets`.
SETS: tuple[tuple[str, str, dict[str, bool]], ...] = (
    ("physical", "stacks", {}),
    ("rough", "stacks of rough interfaces", {"rough": True}),
    ("films", "stacks with films", {"coated": True}),
)
PARTS = ("physical", "rough", "films", "exactness", "narrow", "speed", "figures")

#: One to three lobes: of one interface or a pair, the last one dielectric or a metal.
KINDS = (
    ("single",),
    ("pair",),
    ("metal",),
    ("pair over metal",),
    ("single", "metal"),
    ("single", "pair"),
    ("pair", "single"),
    ("pair", "pair"),
    ("single", "single", "metal"),
    ("single", "pair", "metal"),
    ("single", "single", "pair over metal"),
)

#: The same of rough interfaces, each with a lobe of its own, so that the stack itself is an answer.
ROUGH_KINDS = (("single", "metal"), ("single", "single"), ("single", "single", "metal"), ("single", "single", "single"))

# Exactness -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Inverted:
    """N targets by lobe, energies (3, N) and variances (N,), and the interfaces that give them."""

    kinds: tuple[str, ...]
    energies: list[np.ndarray]
    variances: list[np.ndarray]
    layers: list[Layers]

    def __len__(self) -> int:
        return self.variances[0].size

    def take(self, index: np.ndarray) -> Inverted:
        energies, variances = [e[:, index] for e in self.energies], [s[index] for s in self.variances]
        return Inverted(self.kinds, energies, variances, [take(part, index, len(self)) for part in self.layers])


def draw(kinds: Sequence[str], model: Model, count: int, rng: np.random.Generator) -> Inverted:
    """Random targets, `count` of them, and what those are inverted to that have a stack."""
    above = Above.nothing(model)
    found = Inverted(tuple(kinds), [], [], [])
    variance, feasible = np.zeros(count), np.ones(count, bool)
    for n, kind in enumerate(kinds):
        # Ask for a lobe that is more blurred than those above, of what energy they let through
        through = np.broadcast_to(np.min(np.atleast_2d(above.state.t_0i * above.state.t_i0), axis=0), (count,))
        share = rng.uniform(0.25, 0.7, count) if "metal" in kind else rng.uniform(0.01, 0.12, count)
        grey = n == 0 and kind == "single"  # nothing above it absorbs
        energy = share * through * (np.ones((3, count)) if grey else rng.uniform(0.7, 1, (3, count)))
        alpha = np.where(rng.random(count) < 0.3, 0.0, rng.uniform(0, 0.15, count)) if n == 0 else rng.uniform(0, 0.2)
        variance = 2.5 * variance + above.f.variance(alpha)
        found.energies.append(energy)
        found.variances.append(variance)

        # Invert it
        choice = Choice("conductor" if "metal" in kind else "dielectric", tint=rng.random(count), absorbs=not grey)
        wanted = Isotropic(variance)
        if "pair" in kind:
            eta_1 = np.exp(rng.uniform(0, 0.6, (1, count)))
            parts = [*pair.solve(above, energy, wanted, eta_1, 0.0, choice)]
        else:
            parts = [interface.solve(above, energy, wanted, choice)]
        found.layers.extend(part.layers for part in parts)
        for part in parts:
            feasible &= part.layers.feasible
        above = parts[-1].below
    return found.take(np.flatnonzero(feasible))


def asked(found: Inverted, n: int, model: Model) -> Target:
    """One of the targets."""
    return Target(
        {
            "energy": tuple(energy[:, n].tolist()),
            "alpha": float(MAPS[model.map].roughness(variance[n])),
            "interfaces": 2 if "pair" in kind else 1,
            "base": "conductor" if "metal" in kind else "dielectric",
        }
        for kind, energy, variance in zip(found.kinds, found.energies, found.variances)
    )


def met(found: Inverted, model: Model) -> Inverted:
    """The same targets, inverted for a model without a closed form, those that have a stack."""
    index, layers = [], []
    for n in range(len(found)):
        solution = invert.search(asked(found, n, model), model)
        if solution and not solution.reached:
            index.append(n)
            layers.append(solution.layers)
    kept = found.take(np.array(index, int))
    return replace(kept, layers=[join(parts, [1] * len(parts)) for parts in zip(*layers)])


def deviations(found: Inverted, model: Model) -> Array:
    """The largest differences of energy and of variance between what was asked for and the material's lobes, (2, N)."""
    apart = np.zeros((2, len(found)))
    for n in range(len(found)):
        read = stack_lobes(Stack([layer for part in found.layers for layer in part.written(n)]), 1.0, model=model)
        first = 0
        for k, kind in enumerate(found.kinds):
            own = slice(first, first := first + (2 if "pair" in kind else 1))
            total = np.sum(read.energy[own], axis=0)[:, 0]
            # Of channels that have variances of their own, one has what was asked for
            blurs = [np.min(np.abs(s[..., 0, 0] - found.variances[k][n])) for s in read.covariance[own]]
            apart[:, n] = np.maximum(apart[:, n], [np.abs(total - found.energies[k][:, n]).max(), np.max(blurs)])
    return apart


@dataclass
class Exactness:
    """Targets that were inverted, the largest deviations of these, those beyond the bound, and those refused."""

    done: int = 0
    energy: float = 0.0
    variance: float = 0.0
    beyond: list[Target] = field(default_factory=list)
    refused: int = 0


def exactness(model: Model, targets: int, seed: int = 0) -> Exactness:
    """Errors of as many targets as are asked for, of all kinds alike."""
    rng, result = np.random.default_rng(seed), Exactness()
    for n, kinds in enumerate(KINDS):
        wanted = targets // len(KINDS) + (n < targets % len(KINDS))
        while wanted > 0:
            drawn = draw(kinds, model, min(3 * wanted + 8, CHUNK), rng)
            drawn = drawn.take(np.arange(min(len(drawn), wanted)))
            found = drawn if model.closed_form else met(drawn, model)
            result.refused += len(drawn) - len(found)
            apart = deviations(found, model)
            energy, variance = apart.max(axis=1, initial=0)
            result.energy, result.variance = max(result.energy, energy), max(result.variance, variance)
            result.beyond += [asked(found, n, model) for n in np.flatnonzero((apart > EXACT).any(axis=0))]
            wanted, result.done = wanted - len(found), result.done + len(found)
    return result


def physical(
    kinds: Sequence[str], rng: np.random.Generator, model: Model, coated: bool = False, rough: bool = False
) -> Target:
    """The lobes of a random stack, rougher from lobe to lobe, as a model reads them: of a pair, their mean blur.

    A quarter of the stacks without films is brushed, each interface along axes of its own.

    coated: with films on one of its interfaces at least, which the target fixes. rough: of indices and roughnesses
    where the lobes of models differ most.
    """
    brushed = not coated and rng.random() < BRUSHED
    indices, (least, most) = ROUGH if rough else SMOOTH
    layers: list[Layer] = []
    places = sum(1 + ("pair" in kind) for kind in kinds)
    films = [_films(rng) if rng.random() < COATED else () for _ in range(places)] if coated else [()] * places
    if coated and not any(films):
        films[int(rng.integers(places))] = _films(rng)
    each = iter(films)
    lobes, eta, alpha = [], 1.0, 0.0
    for n, kind in enumerate(kinds):
        if n or rough or rng.random() < 0.7:
            alpha += float(rng.uniform(least, most)) if n == 0 else float(rng.uniform(0.01, 0.15))
        count, metal = 1 + ("pair" in kind), "metal" in kind
        own, turn = alpha, 0.0
        if brushed:
            own = tuple((alpha * np.exp(rng.uniform(-0.7, 0.7, 2))).clip(0, 1).tolist())
            turn = float(rng.choice([0.0, 90.0, rng.uniform(0, 180)]))
        for k in range(count):
            if layers and rng.random() < 0.6:
                layers.append(Medium(sigma_a=tuple(rng.uniform(0, 0.4, 3).tolist())))
            if metal and k == count - 1:
                index = rng.uniform(0.3, 2, 3)
                extinction = index * rng.uniform(1.2, 4, 3)
                metal_index = {"eta": tuple(index.tolist()), "k": tuple(extinction.tolist())}
                layers.append(Interface(**metal_index, alpha=own, rotation=turn, films=next(each)))
            else:
                above = eta
                while abs(np.log(eta / above)) < LEAST_STEP:
                    eta = float(rng.uniform(*indices))
                layers.append(Interface(eta=eta, alpha=own, rotation=turn, films=next(each)))
        base = "conductor" if metal else "dielectric"
        coats = [x or None for x in (layer.films for layer in layers if isinstance(layer, Interface))][-count:]
        fixed = {"films": coats} if any(coats) else {}
        lobe = {"energy": 0.1, "alpha": own, "interfaces": count, "base": base, "fixed": fixed}
        lobes.append({**lobe, "rotation": turn} if turn else lobe)
    return seen(Stack(layers), Target(lobes), model)


def _films(rng: np.random.Generator) -> tuple[Film, ...]:
    """One film or two, of glass to titania, of up to half a micrometre together."""
    count = 1 + int(rng.random() < 0.25)
    return tuple(
        Film(eta=float(rng.uniform(1.35, 2.4)), thickness_nm=float(rng.uniform(15, 500 / count))) for _ in range(count)
    )


def physical_targets(
    count: int, model: Model, seed: int = 0, coated: bool = False, rough: bool = False
) -> Iterator[Target]:
    """Such targets, of all kinds in turn."""
    rng, kinds = np.random.default_rng(seed), ROUGH_KINDS if rough else KINDS
    return (physical(kinds[n % len(kinds)], rng, model, coated, rough) for n in range(count))


def of_stacks(targets: Iterator[Target], model: Model) -> tuple[list[Target], list[Array], list[float]]:
    """Lobes of random stacks: the refused ones, what stacks of the others miss of energies and variances, (2,) each,
    and the seconds of processor time of each."""
    refused, missed, seconds = list[Target](), list[Array](), list[float]()
    for target in targets:
        start = time.process_time()
        found = invert.search(target, model)
        seconds.append(time.process_time() - start)
        if found is None:
            refused.append(target)
            continue
        has = [seen(found.stack, target, model).lobes, target.lobes]
        energy = np.subtract(*([lobe.colour for lobe in lobes] for lobes in has))
        variance = np.subtract(
            *([MAPS[model.map].variance(np.array(lobe.axes[:2])) for lobe in lobes] for lobes in has)
        )
        missed.append(np.array([np.abs(energy).max(), np.abs(variance).max()]))
    return refused, missed, seconds


def stated(name: str, targets: Iterator[Target], model: Model) -> bool:
    """Print how lobes of random stacks are met; whether any are refused."""
    refused, missed, seconds = of_stacks(targets, model)
    energy, variance = np.max(missed, axis=0)
    print(
        f"lobes of random {name}, {model.name}: {len(refused)} of {len(seconds)} refused, energy to {energy:.1e}, "
        f"variance to {variance:.1e}, {sum((x > EXACT).any() for x in missed)} beyond {EXACT:g}; processor time "
        f"{np.median(seconds):.2f} s at the median, {np.quantile(seconds, 0.95):.1f} s at the 95th percentile, "
        f"{max(seconds):.1f} s at most",
        flush=True,
    )
    for target in refused:
        print(" ", target.to_dict()["lobes"])
    return bool(refused)


def width(members: EquivalenceClass, scale: float, nodes: int) -> float:
    """Width of the set of first indices of a class with other energies, as looked for on some nodes."""
    equivalence.NODES = nodes
    return sum(high / low - 1 for low, high in replace(members, energy=scale * members.energy).indices_1())


def narrow(count: int = 60, seed: int = 0) -> list[tuple[float, bool]]:
    """Widths, as shares of the index, of sets of first indices of rough pairs with almost as much energy as any has.

    And whether they are found. Their truth is the same search on more nodes.
    """
    rng, found = np.random.default_rng(seed), list[tuple[float, bool]]()
    while len(found) < count:
        above, s = Above.nothing(named("bati2021")), 0.0
        if rng.random() < 0.6:
            alpha = np.array([rng.uniform(0, 0.15)])
            coat = Layers("dielectric", np.array([[rng.uniform(1.2, 1.8)]]), None, Roughness(alpha, alpha, 0.0), 0.0)
            s, (above, _) = 2.5 * float(above.f.variance(alpha)[0]), above.below(coat)
        choice = Choice("conductor" if rng.random() < 0.3 else "dielectric", tint=rng.random())
        colour = rng.uniform(0.02, 0.15) * rng.uniform(0.5, 1, (3, 1)) * (4 if choice.kind == "conductor" else 1)
        members = EquivalenceClass(above, colour, s + float(above.f.variance(rng.uniform(0.02, 0.3))), 2, choice)
        inside, outside = 1.0, 20.0
        if not width(members, inside, FINE) or width(members, outside, FINE):
            continue
        for _ in range(40):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if width(members, middle, FINE) else (inside, middle)
        for share in 10 ** rng.uniform(-11, -2, 6):
            scale = inside + (1 - inside) * share
            if true := width(members, scale, FINE):
                found.append((true, width(members, scale, NODES) > 0))
    return found


# Speed ---------------------------------------------------------------------------------------------------------------


def best(function: Callable[[], object], runs: int, clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds of the quickest run."""
    times = []
    for _ in range(runs):
        start = clock()
        function()
        times.append(clock() - start)
    return min(times)


def figures(model: Model) -> dict[str, float]:
    """Seconds of processor time for the lobes of every target of the paper's figures."""
    targets = {name: Target(lobes) for name, lobes in FIGURES.items()}
    return {name: best(partial(invert.search, target, model), 3, time.process_time) for name, target in targets.items()}


def configuration() -> float:
    """Seconds for one configuration of figure 17: two rough, coloured pairs of given indices, red over blue."""
    target = {
        "lobes": [
            {"energy": [0.052, 0.025, 0.025], "variance": 0.014, "interfaces": 2, "fixed": {"eta": [1.15, 1.85]}},
            {"energy": [0.025, 0.045, 0.05], "variance": 0.028, "interfaces": 2, "fixed": {"eta": [1.45, 3.3]}},
        ]
    }
    return best(lambda: invert_stack(target, "bati2021"), 100)


def pairs(count: int = 1 << 17) -> float:
    """Rough, coloured pairs of given first index inverted in a second, in two threads."""
    rng = np.random.default_rng(0)
    energy = rng.uniform(0.05, 0.15) * rng.uniform(0.5, 1, (3, count))
    variance, eta = rng.uniform(0.005, 0.1, count), np.exp(rng.uniform(0, 0.3, (1, count)))
    above, parts = Above.nothing(named("bati2021")), [slice(n, n + CHUNK) for n in range(0, count, CHUNK)]

    def one(part: slice) -> object:
        return pair.solve(above, energy[:, part], Isotropic(variance[part]), eta[:, part], 0.0, Choice())

    with ThreadPoolExecutor(2) as pool:
        return count / best(lambda: list(pool.map(one, parts)), 3)


def reach() -> float:
    """Seconds for the equivalence class of a rough pair of three colours, at 256 x 256 indices (figure 12)."""
    above, axis = Above.nothing(named("bati2021"), 1.5), np.linspace(1, 4, 256)
    members = EquivalenceClass(above, np.array([[0.07], [0.12], [0.15]]), 0.01, 2)
    return best(lambda: members.grid(axis, axis), 10)


def main() -> int:
    options = parsed(
        __doc__,
        targets=(10_000, "of the round trip, for each model"),
        physical=(300, "random stacks whose lobes are asked for"),
        models=(list, "by default all for the round trip, else those that it concerns"),
        seed=0,
        parts=(list, "all unless named", PARTS),
    )
    parts = options.parts or PARTS
    failed = False

    given = [*map(named, options.models)] if options.models else None
    for part, name, kind in SETS:
        for model in given or map(named, FILMED if part == "films" else [DEFAULT]) if part in parts else ():
            targets = physical_targets(options.physical, model, options.seed, **kind)
            failed |= stated(name, counted(targets, options.physical, name), model) and part != "films"

    variants = [named("bati2021", channels="separate"), named("bati2021", reflectance="fresnel")]
    models = given or [*MODELS, *variants]
    for model in models if "exactness" in parts else ():
        found = exactness(model, options.targets, options.seed)
        failed |= bool(found.beyond)
        name = f"{model.name} ({model.reflectance}, tir {model.tir}, {model.channels})"
        print(
            f"{name}: {found.done} targets, energy to {found.energy:.1e}, variance to {found.variance:.1e}, "
            f"{len(found.beyond)} beyond {EXACT:g}; {found.refused} others refused",
            flush=True,
        )
        for target in found.beyond:
            print(" ", target.to_dict()["lobes"])

    if "narrow" in parts:
        sets = narrow(seed=options.seed)
        for exponent in range(-8, -1):
            own = [seen for size, seen in sets if 10.0**exponent <= size < 10.0 ** (exponent + 1)]
            print(f"sets of 1e{exponent} to 1e{exponent + 1} of the index: {sum(own)} of {len(own)} found")

    for model in given or [named(DEFAULT)] if "figures" in parts else ():
        taken = figures(model)
        slowest = max(taken, key=lambda name: taken[name])
        row("figures", f"targets, {model.name}", [*taken.values()], remark=f"{slowest} takes {taken[slowest]:.3f} s")

    if "speed" in parts:
        print(f"load when times are taken: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        seconds, rate, grid = configuration(), pairs(), reach()
        row("speed", "one configuration of figure 17", 1e3 * seconds, "ms", f"bound {1e3 * CONFIGURATION:g} ms")
        row("speed", "rough coloured pairs", rate, "a second", f"on two cores; bound {PAIRS:g}")
        row("speed", "class of three channels, 256 x 256", 1e3 * grid, "ms", f"goal {1e3 * REACH:g} ms")
        failed |= seconds > CONFIGURATION or rate < PAIRS
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
