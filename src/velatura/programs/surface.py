"""A surface in the terms that uber-shaders share: the record between parameters of programs and stacks.

Programs differ in names and ranges of parameters. Readers turn these into a surface, from which `to_stack` makes
layers; `from_stack` sees surfaces in a stack, from which writers make parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from velatura.optics import fresnel
from velatura.programs.metals import of_f82_tint
from velatura.programs.values import Array, Value, rounded
from velatura.stack import RGB, Texture

INDICES = (0.1, 10.0)  # of dielectrics
BRIGHTEST = 0.95  # reflectance of a dielectric at the normal
WHITE = (1.0, 1.0, 1.0)

Alpha: TypeAlias = tuple[Value, Value]  # GGX roughness along two axes


@dataclass(frozen=True)
class Coat:
    """A coat.

    colour: the square of its transmittance along the normal.
    share: of the surface, that has it.
    darkening: 1 where bounces below it may darken the base, 0 where its colour is that of the coated base.
    """

    eta: float
    alpha: Alpha
    rotation: float = 0.0
    colour: Value = WHITE
    darkening: float = 1.0
    share: float = 1.0


NO_COAT = Coat(1.0, (0.0, 0.0))


@dataclass(frozen=True)
class Surface:
    """A base that is metal, diffuse below a dielectric, or clear, with a film on it and a coat above.

    Rotations are degrees from the tangent to the first axis, and indices are over the exterior.

    colour: reflectance of the metal at the normal; of what passes a dielectric base, the share that comes back.
    metalness, clear: shares of the base that are metal, and that light passes; 0 or 1 of what is read.
    eta: index of a dielectric base; specular: a factor on its reflectance at the normal, by colours.
    edge: the tint of a metal, which `index` takes with its colour for the index.
    tint: the transmittance of each crossing of a clear base, of a pane as a whole.
    film: index, and thickness in nanometres.
    by_sight: whether the program knows nothing of what a coat does to the reflectance below it, which base and coat
        then keep: the index is relative to the coat's.
    """

    alpha: Alpha
    rotation: float = 0.0
    colour: Value = WHITE
    metalness: float = 0.0
    clear: float = 0.0
    eta: float = 1.5
    specular: RGB = WHITE
    edge: RGB = WHITE
    index: Callable[[Array, Array], tuple[Array, Array]] = of_f82_tint
    tint: Value = WHITE
    pane: bool = False
    film: tuple[float, Value] | None = None
    coat: Coat = NO_COAT
    by_sight: bool = False

    @property
    def coated(self) -> bool:
        """Whether a coat reflects as one of a higher index than the exterior's."""
        return self.coat.eta > 1


@dataclass(frozen=True)
class Shares:
    """Shares of a surface: numbers, or images of them. All of a part of it are 0 or 1.

    cover: that is there at all. coat, film: that has a coat, and a film on the base. metal: whose base is metal.
    clear: of what is no metal, whose base light passes.
    """

    cover: float | Texture = 1.0
    coat: float | Texture = 0.0
    film: float | Texture = 0.0
    metal: float | Texture = 0.0
    clear: float | Texture = 0.0


def weighed(eta: float, outside: float, weight: float) -> float:
    """The index that reflects `weight` times as much at the normal, below a medium (OpenPBR 1.1, "Dielectric base")."""
    ratio = eta / outside
    epsilon = np.sign(ratio - 1) * np.sqrt(min(weight * fresnel.normal_incidence(ratio), BRIGHTEST))
    return rounded(float(outside * (1 + epsilon) / (1 - epsilon)))
