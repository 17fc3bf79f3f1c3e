"""Random stacks of every shape, from what a user might write to the ends of what is accepted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.stack import Diffuse, Interface, Layer, Medium, Stack, names

BASES = ("dielectric", "thin", "metal", "named", "mirror", "diffuse")
METALS, GLASSES = names()


def random_stack(rng: np.random.Generator, absurd: bool = False, most: int = 4, base: str | None = None) -> Stack:
    """A stack of up to `most` dielectrics, media between them and above the first, over a base (None: any).

    Every other diffuse base lies under a medium and no interface: chalk, dust, matt paint.
    `absurd`: every value may lie anywhere in the range that is accepted, most often near its ends.
    """
    draw = _Absurd(rng) if absurd else _Tame(rng)
    base = base or str(rng.choice(BASES))
    transmits = base in ("dielectric", "thin")
    layers: list[Layer] = []
    turned = rng.random() < 0.3  # else all interfaces share their axes
    uneven = 0.0 if rng.random() < 0.5 else 0.5  # share of anisotropic interfaces
    for _ in range(rng.integers(1 if transmits else 0, most + 1)):
        if rng.random() < 0.35:
            layers.append(draw.accepted(draw.medium))
        layers.append(draw.accepted(lambda: Interface(eta=draw.dielectric(layers), **draw.surface(uneven, turned))))
    if not transmits and rng.random() < 0.35:
        layers.append(draw.accepted(draw.medium))
    if base == "metal":
        layers.append(
            draw.accepted(lambda: Interface(eta=draw.metal(), k=draw.extinction(), **draw.surface(uneven, turned)))
        )
    elif base in ("named", "mirror"):
        metal = "mirror" if base == "mirror" else str(rng.choice(METALS))
        layers.append(draw.accepted(lambda: Interface(conductor=metal, **draw.surface(uneven, turned))))
    elif base == "diffuse":
        layers.append(Diffuse(albedo=draw.albedo()))
        if rng.random() < 0.5:
            layers = [draw.accepted(draw.medium), layers[-1]]
    return draw.accepted(lambda: Stack(layers, exterior=draw.exterior(), thin=base == "thin"))


def in_range(rng: np.random.Generator, lossless: bool = False, brushed: bool = False) -> Stack:
    """A stack of up to three interfaces: of an index in 1.05 to 2.5, over a metal, a mirror, glass, a pane or a diffuse
    base, every alpha in 0 to .8 and the axes of brushed ones at most 8 times apart, with media that absorb or scatter
    above any layer. Of diffuse bases every other one lies under no interface, unless some are to be `brushed`."""
    alpha = lambda: 0.0 if rng.random() < 0.15 else float(rng.uniform(0.01, 0.8))  # noqa: E731

    def surface(**index: Any) -> Interface:
        along = alpha()
        if not (brushed or rng.random() < 0.4):
            return Interface(alpha=along, **index)
        across = min(along * 8 ** float(rng.uniform(-1, 1)), 0.8)
        return Interface(alpha=(along, across), rotation=float(rng.uniform(0, 180)), **index)

    def medium() -> Medium:
        absorbs = 0.0 if lossless else float(rng.uniform(0, 1))
        return Medium(
            depth=float(rng.uniform(0, 2)),
            sigma_a=absorbs,
            sigma_s=float(rng.uniform(0, 2)),
            g=float(rng.uniform(-0.5, 0.9)),
        )

    kinds = ["mirror", "glass", "pane", "diffuse"] + ([] if lossless else ["metal"])
    kind = str(rng.choice(kinds))
    matt = kind == "diffuse" and not brushed and rng.random() < 0.5
    layers: list[Layer] = []
    for _ in range(0 if matt else rng.integers(1, 4)):
        layers += [*([medium()] if rng.random() < 0.3 else []), surface(eta=float(rng.uniform(1.05, 2.5)))]
    if matt or rng.random() < 0.3:
        layers.append(medium())
    if kind == "diffuse":
        layers.append(Diffuse(albedo=1.0 if lossless else float(rng.uniform(0, 1))))
    elif kind == "metal":
        layers.append(surface(eta=float(rng.uniform(0.2, 2.0)), k=float(rng.uniform(1.5, 5.0))))
    else:
        layers.append(surface(conductor="mirror") if kind == "mirror" else surface(eta=float(rng.uniform(1.05, 2.5))))
    return Stack(layers, thin=kind == "pane")


def textured(stack: Stack, rng: np.random.Generator, image: str) -> Stack:
    """The stack with one or two of its values from an image in colour."""
    names = [name for name in stack.flat() if name != "exterior"]
    chosen = rng.choice(names, size=min(len(names), int(rng.integers(1, 3))), replace=False)
    values = {
        str(name): {"texture": image, "scale": rng.uniform(0.1, 1.5), "offset": rng.uniform(0, 0.5)} for name in chosen
    }
    return stack.replace(**values)


def drawn_anew(stack: Stack, rng: np.random.Generator) -> Stack:
    """The stack with other numbers, whose kernels are nearly the same: those that are 0 or 1, names, and the exterior
    stay, and so do grey colours and axes that are alike."""
    draw = _Tame(rng)
    alpha = lambda: draw.any(lambda: draw.uniform(0.02, 0.6), lambda: 10 ** draw.uniform(-2.3, 0))  # noqa: E731
    numbers: dict[str, Callable[[], float]] = {
        "eta": lambda: draw.any(lambda: draw.uniform(1, 2.5), lambda: draw.uniform(1.2, 1.8)),
        "k": lambda: draw.uniform(0.5, 6),
        "alpha_u": alpha,
        "alpha_v": alpha,
        "rotation": lambda: draw.uniform(-180, 180),
        "depth": lambda: draw.any(lambda: draw.uniform(0.1, 2), lambda: draw.uniform(0.01, 0.1)),
        "sigma_a": lambda: draw.uniform(0.01, 2),
        "sigma_s": lambda: draw.uniform(0.01, 2),
        "g": lambda: draw.any(lambda: draw.uniform(-0.9, 0.95), lambda: draw.uniform(0.5, 0.98)),
        "albedo": lambda: draw.uniform(0.01, 1),
    }
    flat, found = stack.flat(), dict[str, Any]()
    for name, value in flat.items():
        key = name.partition("_")[2]
        if key not in numbers or not isinstance(value, float | tuple) or set(np.ravel(value)) <= {0.0, 1.0}:
            continue
        along = name.replace("alpha_v", "alpha_u")
        if along in found and flat[along] == value:
            found[name] = found[along]
        else:
            found[name] = tuple(numbers[key]() for _ in value) if isinstance(value, tuple) else numbers[key]()
    return stack.replace(**found)


class _Tame:
    """Values as users give them, the special ones among them."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def accepted(self, make: Callable[[], Any]) -> Any:
        """A result of values that are drawn until they are accepted."""
        while True:
            try:
                return make()
            except InvalidInput:
                continue

    def any(self, *choices: Callable[[], Any]) -> Any:
        return choices[self.rng.integers(len(choices))]()

    def colour(self, number: Callable[[], float]) -> Any:
        return tuple(number() for _ in range(3)) if self.rng.random() < 0.4 else number()

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def exterior(self) -> float:
        return self.any(lambda: 1.0, lambda: 1.0, lambda: 1.0, lambda: 1.33, lambda: self.uniform(1, 1.8))

    def dielectric(self, above: list[Layer]) -> Any:
        before = [layer.eta for layer in above if isinstance(layer, Interface)]
        return self.any(
            lambda: self.uniform(1, 2.5),
            lambda: self.uniform(1.2, 1.8),
            lambda: self.colour(lambda: self.uniform(1.3, 1.7)),
            lambda: str(self.rng.choice(GLASSES)),
            lambda: before[-1] if before else 1.0,
            lambda: 1.0,
        )

    def metal(self) -> Any:
        return self.colour(lambda: self.uniform(0.1, 3))

    def extinction(self) -> Any:
        return self.colour(lambda: self.any(lambda: self.uniform(0, 6), lambda: self.uniform(2, 5), lambda: 0.0))

    def alpha(self) -> float:
        return self.any(
            lambda: self.uniform(0.02, 0.6),
            lambda: self.uniform(0, 1),
            lambda: 10 ** self.uniform(-3, 0),
            lambda: self.any(lambda: 0.0, lambda: 0.0, lambda: 1.0),
        )

    def surface(self, uneven: float, turned: bool) -> dict[str, Any]:
        if self.rng.random() >= uneven:
            return {"alpha": self.alpha()}
        return {"alpha": (self.alpha(), self.alpha()), "rotation": self.rotation() if turned else 0.0}

    def rotation(self) -> float:
        return self.any(lambda: self.uniform(-180, 180), lambda: 90.0, lambda: self.uniform(-720, 720))

    def medium(self) -> Medium:
        absorbing, scattering = (self.rng.random() < share for share in (0.7, 0.4))
        return Medium(
            depth=self.any(lambda: 1.0, lambda: self.uniform(0, 2), lambda: self.uniform(0, 0.1)),
            sigma_a=self.colour(lambda: self.uniform(0, 2)) if absorbing else 0.0,
            sigma_s=self.colour(lambda: self.uniform(0, 2)) if scattering else 0.0,
            g=self.any(lambda: self.uniform(-0.9, 0.95), lambda: self.uniform(0.5, 0.98), lambda: 0.0),
        )

    def albedo(self) -> Any:
        return self.any(lambda: self.colour(lambda: self.uniform(0, 1)), lambda: 1.0, lambda: 0.0)


class _Absurd(_Tame):
    """Values from the whole range; those beyond it are drawn again."""

    def positive(self) -> float:
        """A number above 0, of any size."""
        return 10 ** self.any(lambda: self.uniform(-4, 4), lambda: self.uniform(-1, 1), lambda: self.uniform(-40, 40))

    def exterior(self) -> float:
        return self.any(super().exterior, self.positive)

    def dielectric(self, above: list[Layer]) -> Any:
        return self.any(lambda: super(_Absurd, self).dielectric(above), lambda: self.colour(self.positive))

    def metal(self) -> Any:
        return self.colour(self.positive)

    def extinction(self) -> Any:
        return self.colour(lambda: self.any(self.positive, lambda: 0.0))

    def alpha(self) -> float:
        tiny = lambda: 10 ** self.uniform(-30, -1)  # noqa: E731
        return self.any(super().alpha, tiny, lambda: 1 - tiny())

    def rotation(self) -> float:
        return self.any(super().rotation, lambda: self.positive() * self.rng.choice([-1.0, 1.0]))

    def medium(self) -> Medium:
        return Medium(
            depth=self.any(lambda: 1.0, lambda: 0.0, self.positive),
            sigma_a=self.colour(lambda: self.any(lambda: 0.0, self.positive)),
            sigma_s=self.colour(lambda: self.any(lambda: 0.0, self.positive)),
            g=self.any(lambda: 0.0, lambda: self.uniform(-1, 1), self._near_one),
        )

    def _near_one(self) -> float:
        return float(self.rng.choice([-1.0, 1.0]) * (1 - 10 ** self.uniform(-15, 0)))

    def albedo(self) -> Any:
        return self.colour(lambda: self.any(lambda: 0.0, lambda: 1.0, lambda: self.uniform(0, 1)))
