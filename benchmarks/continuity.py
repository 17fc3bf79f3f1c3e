"""Jumps of the light of materials where one of their parameters changes.

    python benchmarks/continuity.py [--material NAME ...] [--parameter NAME ...] [--form forward] [--whole] [--steps 96]
        [--least .0005]

Every parameter of presets and of random stacks is scanned over its range, all others as they are. Quantities are
energies, reflected and passed, at four cosines, and values of the BSDF at a few directions. A step whose change differs
from that of the steps beside it is halved, down to 1e-8 of the range: what then still changes by more than `--least` is
a jump, a steep slope is not. Changes are shares of a quantity, but at least of .02 of the incident light, or of a
diffuse reflection of that much.

Directions are solved by themselves, or with `--whole`, and in the symmetric form, on the grid that a renderer has. A
row `jump` is the greatest of one step of a scan, with its place and the quantity, a row `jumps` their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rows import parsed, row

import velatura as vt
from velatura.benchmark import random_stacks
from velatura.model import named
from velatura.model.base import Model, Query
from velatura.model.context import Context
from velatura.model.variance import variance_kind
from velatura.stack import Interface, Material, Medium, Stack

Array = NDArray[np.floating]

PRESETS = (
    "anodised-titanium",
    "coated-brushed-aluminium",
    "coated-gold",
    "coated-lens",
    "crossed-brushing",
    "frosted-glass",
    "opal-glass",
    "pearl-lacquer",
    "scattering-medium-over-gold",
    "soap-on-varnish",
    "three-dielectrics-over-metal",
    "tinted-plate",
    "turned-brushing",
    "varnished-paint",
)
#: Kinds of `velatura.benchmark.random_stacks`, and the number of the stack
RANDOM = {"isotropic": 2, "turned": 3, "cloudy": 1, "clear": 1, "milky": 0, "lacquered": 0, "crossed": 0, "frosted": 2}
OWN = {
    "smooth coat": Stack([Interface(eta=1.5), Interface(eta=0.2, k=3.5, alpha=0.2)]),
    "bare glass": Stack([Interface(eta=1.5, alpha=0.3)]),
    "fog": Stack([Medium(depth=1.0, sigma_s=0.8, sigma_a=0.1, g=0.5), Interface(eta=1.3, alpha=0.2)]),
}

WAYS = "reflected", "passed"
COSINES, AZIMUTH = np.array([0.9, 0.5, 0.2, 0.08]), 0.3  # of light
LEAVING = ((0.1, 0.05), (-0.4, 0.2), (-0.85, 0.1), (-0.6, -0.6), (0.5, 0.3), (0.0, 0.88))  # momenta outside
BESIDE = (0.04, 0.02)  # another, from the mirror direction
FAINT = 0.02  # energy of which a change is a share at least
NARROW = 1e-8  # of the range, within which a change is a jump
CLOSE = 10.0 ** np.arange(-5, -2)  # of the range, from its lower end, where more steps are taken
MOST = 6  # steps that are halved in one scan, for energies, and for values
#: Ranges of parameters by the end of their names, and those of metals.
RANGES = {
    "alpha": (0.0, 1.0),
    "alpha_u": (0.0, 1.0),
    "alpha_v": (0.0, 1.0),
    "rotation": (0.0, 180.0),
    "eta": (1.0, 2.4),
    "k": (0.0, 8.0),
    "depth": (0.0, 5.0),
    "sigma_a": (0.0, 3.0),
    "sigma_s": (0.0, 3.0),
    "g": (-0.98, 0.98),
    "albedo": (0.0, 1.0),
    "thickness_nm": (0.0, 600.0),
}
METAL = {"eta": (0.05, 4.0)}


@dataclass(frozen=True)
class Scan:
    """A parameter of a stack, by its flat name, and the range that it is scanned over."""

    stack: Stack
    name: str
    low: float
    high: float

    def at(self, share: float) -> Stack:
        """The stack with a value of the parameter, by its place in the range."""
        return self.stack.replace(**{self.name: self.value(share)})

    def value(self, share: float) -> float:
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True)
class Jump:
    """A change within `NARROW` of a value of a parameter, as a share of a quantity."""

    value: float
    size: float
    quantity: str


def materials() -> dict[str, Stack]:
    """All that are scanned, by name."""
    found = {name: vt.load(name) for name in PRESETS}
    for name, number in RANDOM.items():
        found[name] = getattr(random_stacks, name)(np.random.default_rng([number, *name.encode()]), number)
    return found | OWN


def scans(stack: Stack) -> Iterator[Scan]:
    """Every parameter of a stack that makes a difference."""
    flat = stack.flat()
    for name in flat:
        layer, _, key = name.partition("_")
        key = name.rsplit("_", 1)[-1] if "film" in name and not name.endswith("_nm") else key
        key = "thickness_nm" if name.endswith("thickness_nm") else key
        if key not in RANGES:
            continue
        u, v = flat.get(f"{layer}_alpha_u"), flat.get(f"{layer}_alpha_v")
        if key == "rotation" and u == v:
            continue
        ranges = RANGES | (METAL if f"{layer}_k" in flat else {})
        if key == "alpha_u" and u == v:
            yield Scan(stack, f"{layer}_alpha", *ranges["alpha"])
        if key != "alpha_v" or u != v:
            yield Scan(stack, name, *ranges[key])


class Light:
    """The light of stacks by a model: quantities, by their `names`, and what changes of them are shares of."""

    def __init__(self, model: Model, whole: bool):
        self.model, self.whole = model, whole or model.form == "symmetric"
        sine = np.sqrt(1 - COSINES**2)
        self.wi = sine * np.cos(AZIMUTH), sine * np.sin(AZIMUTH), COSINES
        momenta = [
            [*LEAVING, (BESIDE[0] - x, BESIDE[1] - y) if x * x + y * y < 0.9 else (-0.9 * x, -0.9 * y)]
            for x, y in zip(*self.wi[:2])
        ]
        self.which = np.repeat(np.arange(len(COSINES)), len(momenta[0]))
        self.leaving = np.concatenate(momenta).T

    def __call__(self, stack: Stack) -> tuple[Array, Array]:
        """Quantities (Q,), and what changes of them are shares of."""
        material = Material.of(stack)
        if self.whole:
            every = at = self.model.body(material, variance_kind(material), Context())
        else:
            lit = self.model.lit(material, self.wi)
            every, at = lit(np.arange(len(COSINES))), lit(self.which)
        values, scales = [], []
        wi = tuple(each[self.which] for each in self.wi)
        for way in WAYS[: 1 + material.transmits]:
            n = 1.0 if way == WAYS[0] else float(np.mean(material.below) / np.mean(material.exterior))
            x, y = self.leaving / n
            z = np.sqrt(1 - x * x - y * y)
            asked = Query(reflection=way == WAYS[0], transmission=way != WAYS[0])
            energy = np.broadcast_to(every.albedo(self.wi, asked), (3, len(COSINES)))
            value = np.broadcast_to(at.eval_pdf(wi, (x, y, z if way == WAYS[0] else -z), asked)[0], (3, len(x)))
            least = np.maximum(energy, FAINT)
            values += [energy, value]
            scales += [least, np.maximum(value, least[:, self.which] * z / np.pi)]
        return np.concatenate([x.ravel() for x in values]), np.concatenate([x.ravel() for x in scales])

    @property
    def energetic(self) -> NDArray[np.bool_]:
        """Which quantities are energies."""
        one_side = np.repeat([True, False], [3 * len(COSINES), 3 * len(self.which)])
        return np.tile(one_side, 2)

    def name(self, number: int) -> str:
        """That of a quantity."""
        count = len(COSINES), len(self.which)
        side, number = divmod(number, 3 * sum(count))
        way = WAYS[side]
        if number < 3 * count[0]:
            return f"{way} at {COSINES[number % count[0]]:g}"
        place = (number - 3 * count[0]) % count[1]
        x, y = self.leaving[:, place]
        return f"{way} at {COSINES[self.which[place]]:g} to ({x:.2f}, {y:.2f})"


def jumps(scan: Scan, light: Light, steps: int, least: float) -> list[Jump]:
    """The jumps of a scan, the greatest ones if there are many."""
    shares = np.unique([CLOSE[0] / 10, *CLOSE, *np.linspace(0, 1, steps + 1)[1:]])
    if scan.low:
        shares = np.unique([0.0, *shares])
    known = {share: light(scan.at(share)) for share in shares.tolist()}

    def change(a: float, b: float, slope: Array | float = 0.0) -> Array:
        """Shares by which quantities change beyond a slope."""
        (here, one), (there, other) = known[a], known[b]
        return np.asarray(np.abs(there - here - slope * (b - a)) / np.minimum(one, other))

    # Find steps unlike those beside them
    values = np.array([known[share][0] for share in shares.tolist()])
    slopes = np.diff(values, axis=0) / np.diff(shares)[:, None]
    beside = 0.5 * (slopes[[1, *range(len(slopes) - 1)]] + slopes[[*range(1, len(slopes)), -2]])
    ends = list(zip(shares[:-1].tolist(), shares[1:].tolist()))
    unlike = np.array([change(*each, slope) for each, slope in zip(ends, beside)])

    # Halve them, for energies and for values, which may be steep beside these
    found = {}
    for kind in (light.energetic, ~light.energetic):
        kind = kind[: unlike.shape[1]]
        for step in np.argsort(-unlike[:, kind].max(axis=1))[:MOST]:
            (a, b), slope = ends[step], beside[step]
            while b - a > NARROW and change(a, b, slope)[kind].max() > least / 2:
                middle = 0.5 * (a + b)
                if middle not in known:
                    known[middle] = light(scan.at(middle))
                a, b = max((a, middle), (middle, b), key=lambda each: change(*each, slope)[kind].max())
            size = np.where(kind, change(a, b), 0)
            if b - a <= NARROW and size.max() > least:
                found[kind[0], b] = Jump(scan.value(b), float(size.max()), light.name(int(size.argmax())))
    return list(found.values())


def main() -> None:
    every = materials()
    options = parsed(
        __doc__,
        material=(list(every), "", list(every)),
        parameter=([""], "flat names, or ends of them"),
        form=("forward", "", ("forward", "symmetric")),
        whole=(False, "on the grid of directions that a renderer has"),
        steps=(96, "over the range of a parameter"),
        least=(5e-4, "share of the light that is a jump"),
    )
    light = Light(named("velatura", form=options.form), options.whole)
    for name in options.material:
        chosen = [scan for scan in scans(every[name]) if scan.name.endswith(tuple(options.parameter))]
        count = 0
        for scan in chosen:
            for jump in jumps(scan, light, options.steps, options.least):
                row("jump", f"{name}, {scan.name}", jump.size, "", f"at {jump.value:.9g}: {jump.quantity}")
                count += 1
        row("jumps", name, count, "", f"{len(chosen)} parameters")


if __name__ == "__main__":
    main()
