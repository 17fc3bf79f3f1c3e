"""Programs that parameters are fitted for, the parameters that are found, and what their writers share."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from velatura.programs.closures import Array, ViewAndLight
from velatura.programs.parameters import RGB, Input, Values
from velatura.programs.surface import Alpha, Surface
from velatura.programs.values import Value
from velatura.results import Fields
from velatura.stack import Texture
from velatura.version import __version__

Range: TypeAlias = tuple[float, float]
Fitted: TypeAlias = dict[str, float | RGB]


@dataclass(frozen=True)
class Program:
    """A program's material: its formulas, the parameters of a surface, its file.

    coat_eta, coat_brushed, coat_colour, coat_depth: whether the coat has an index, a brushing, a colour, and one that
        deepens where light crosses it at an angle.
    turned, pane: whether brushing can be turned, and light pass without refraction.
    colour, roughness: the parameter that takes an image of a diffuse base's colour, where `metal` is less than .5, and
        of the root of the one interface's alpha; none if empty.
    maps: the parameters that take baked images, each with the image that it is in, and the channel there.
    images: endings of the files that it reads, which are then in sRGB; any where there are none.
    text: the text of a file, by the bake, the stack in JSON, and names of image files by parameter; these names are
        absolute if it may lie `anywhere`.
    """

    title: str
    parameters: tuple[Input, ...]
    value: Callable[[Values, ViewAndLight, bool], Array]
    start: Callable[[Surface], Fitted]
    text: Callable[[Bake, Any, dict[str, str]], str]
    coat_eta: bool = False
    coat_brushed: bool = False
    coat_colour: bool = False
    coat_depth: bool = False
    turned: bool = False
    pane: bool = False
    colour: str = ""
    roughness: str = ""
    maps: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    images: tuple[str, ...] = ()
    anywhere: bool = False

    def fitted(self, kind: str) -> dict[str, Range]:
        """The ranges of fitted parameters, by what they are of a surface."""
        return {each.name: each.fit[1:] for each in self.parameters if each.fit and each.fit[0] == kind}

    @property
    def metal(self) -> str:
        """The parameter that is the share of metal."""
        return next(iter(self.fitted("metal")))


@dataclass(frozen=True)
class Carried:
    """An image in place of a parameter: a factor times its linear texels, colours or one channel, or the `root` of
    that."""

    texture: Texture
    factor: float | RGB
    root: bool = False

    @property
    def channel(self) -> int:
        """The number of the channel."""
        return "rgba".index(self.texture.channel or "r")


@dataclass(frozen=True, repr=False)
class Bake(Fields):
    """Parameters of a program, the target, that come closest to a stack, and what is lost.

    For the N cosines of incidence `cos_theta`, in the target's own formulas against the model: total_variation (N,),
    the share of the reflected light in wrong places, as `compare` measures it; albedo, baked_albedo (3, N); passed,
    baked_passed (3, N), what leaves below. lost: what the program does not hold. images: in place of numbers, by
    parameter. thin: light passes without refraction. maps: how images were baked, in sentences; the loss then is the
    mean over the surface.
    """

    target: str
    title: str
    name: str
    model: str
    values: Fitted
    cos_theta: tuple[float, ...]
    total_variation: Array
    albedo: Array
    baked_albedo: Array
    passed: Array
    baked_passed: Array
    lost: tuple[str, ...]
    images: dict[str, Carried]
    thin: bool
    maps: tuple[str, ...] = ()

    def differing(self, parameters: tuple[Input, ...]) -> list[tuple[Input, float | RGB]]:
        """Parameters that differ from their defaults."""
        each = [(parameter, self.values[parameter.name]) for parameter in parameters]
        return [(parameter, value) for parameter, value in each if value != parameter.default]

    @property
    def comment(self) -> list[str]:
        """The lines at the head of a file."""
        return [f"Written by Velatura {__version__}.", *self.summary]

    @property
    def summary(self) -> list[str]:
        """The loss in sentences, then what is not held."""
        cosines, shares = (
            ", ".join(f"{x:{form}}" for x in each)
            for each, form in ((self.cos_theta, "g"), (100 * self.total_variation, ".1f"))
        )
        lines = [
            f"Parameters of {self.title} that come closest to {self.name or 'a material'} by the model {self.model}.",
            f"Loss in the formulas of {self.title}, at cosines of incidence {cosines}:",
            f"total variation: {shares} % of the reflected light is in wrong places",
            f"albedo: {_off(self.albedo, self.baked_albedo, self.cos_theta)}",
        ]
        if self.passed.any():
            lines.append(f"light that passes: {_off(self.passed, self.baked_passed, self.cos_theta)}")
        return [*lines, *self.maps, *(f"not held: {each}" for each in self.lost)]


def _off(true: Array, found: Array, cosines: tuple[float, ...]) -> str:
    """The mean and the greatest error of an energy, and where that is."""
    error = found - true
    channel, n = np.unravel_index(np.argmax(np.abs(error)), error.shape)
    where = f"{('red', 'green', 'blue')[channel]}, cosine {cosines[n]:g}"
    return f"{np.abs(error).mean():.3f} off in the mean, {error[channel, n]:+.3f} at most ({where})"


def own_maps(parameters: tuple[Input, ...], without: Container[str] = ()) -> dict[str, tuple[str, str]]:
    """Maps of a program whose parameters have an image each, `without` some that take none."""
    names = [each for each in parameters if each.name not in without]
    return {each.name: (each.name, "rgb" if each.is_colour else "r") for each in names}


# Parameters of surfaces -----------------------------------------------------------------------------------------------


def rgb(value: Value) -> RGB:
    """A colour of a surface of a stack."""
    red, green, blue = np.asarray(value, float).tolist()
    return red, green, blue


def product(a: Value, b: Value) -> RGB:
    """The product of two colours."""
    return rgb(tuple(np.multiply(rgb(a), rgb(b))))


def mean_alpha(alpha: Alpha) -> float:
    """One roughness for those along two axes."""
    return float(np.sqrt(np.mean(np.square(np.asarray(alpha, float)))))


def roughness(alpha: float) -> float:
    """The root of a roughness, as most programs have it."""
    return float(np.sqrt(np.clip(alpha, 0, 1)))


def burley(alpha: Alpha, name: str, anisotropic: str) -> Fitted:
    """Both parameters by whose `closures.burley` a surface has its roughness."""
    u, v = np.maximum(np.asarray(alpha, float), 1e-6)
    return {name: roughness(np.sqrt(u * v)), anisotropic: float(np.clip((1 - v / u) / 0.9, 0, 1))}
