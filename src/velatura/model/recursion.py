"""Recursions over the layers of a stack, and the properties that follow. A named model names its recursion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from velatura.model.calibration import Calibration
from velatura.model.variance import Covariance, Isotropic, PerAxis, Variance
from velatura.optics.ggx import Direction

if TYPE_CHECKING:  # recursions use records that are prepared for them
    from velatura.model.adding import Lobe
    from velatura.model.bsdf import Body
    from velatura.model.context import Context
    from velatura.model.lobe_statistics import StackLobes
    from velatura.model.models import Model
    from velatura.model.prepare import Prepared
    from velatura.model.textured import Textured
    from velatura.stack import Material


class Recursion(ABC):
    """A recursion over the layers.

    Attributes:
        has_gain: lobes are drawn by a factor with which they have their energy, the first one as the reflection by
            facets that it is; so forward lobes are lossless, and the symmetric form is balanced.
        from_lowest: total internal reflection depends on the lowest index above, else on that of the medium above.
        closed_form: an interface that has a given lobe follows in closed form (Bati et al. 2021).
        solved: uniform materials are solved for all directions (`velatura.model.solution`).
    """

    has_gain: ClassVar[bool]
    from_lowest: ClassVar[bool]
    closed_form: ClassVar[bool]
    solved: ClassVar[bool]

    @abstractmethod
    def lobes(self, prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
        """The reflected lobes, one per interface from the top, and the lobe transmitted below the last layer.

        `wi` points away from the surface. Where nothing passes, the transmitted lobe has energy 0.
        """

    @abstractmethod
    def lobe_kind(self, variance: type[Variance]) -> type[Variance]:
        """The kind of variance of lobes, given that of the interfaces."""

    def reflectances(self) -> tuple[str, ...] | None:
        """Reflectances for which it is calibrated; None if all switches may have any value."""
        return None

    def solves(self, material: Material) -> bool:
        """Whether a material with constants of a renderer is solved for all directions at once."""
        return False

    def unsolved(self, model: Model) -> Model:
        """The model by which materials are prepared that are not solved."""
        return model

    def body(self, material: Material, model: Model, variance: type[Variance], context: Context) -> Body:
        """A material as a BSDF, with constants of a renderer."""
        from velatura.model import bsdf

        return bsdf.body(material, model, variance, context)

    def textured(self, material: Material, *values: Any) -> Textured | None:
        """A material with textures, by the other values of `velatura.model.textured.textured`; None where it has to be
        prepared at every point."""
        return None

    def statistics(self, material: Material, model: Model, wi: Direction) -> StackLobes:
        """The lobes of a material with values in NumPy, for directions wi, (N,) each."""
        from velatura.model import stack_lobes

        return stack_lobes.added(material, model, wi)


@dataclass(frozen=True)
class Adding(Recursion):
    """The recursion of the papers (Belcour 2018, section 5; Weier & Belcour 2020; Yamaguchi et al. 2019)."""

    has_gain = False
    from_lowest = False
    closed_form = True
    solved = False

    def lobes(self, prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
        from velatura.model import adding

        return adding.lobes(prepared, wi)

    def lobe_kind(self, variance: type[Variance]) -> type[Variance]:
        return variance


ADDING = Adding()


@dataclass(frozen=True)
class Momentum(Recursion):
    """Widths in tangential momentum, with constants by reflectance (`velatura.model.momentum`)."""

    calibrations: Mapping[str, Calibration] = field(hash=False)

    has_gain = True
    from_lowest = True
    closed_form = False
    solved = True

    def lobes(self, prepared: Prepared, wi: Direction) -> tuple[list[Lobe], Lobe]:
        from velatura.model import momentum

        return momentum.lobes(prepared, self.calibrations[prepared.model.reflectance], wi)

    def lobe_kind(self, variance: type[Variance]) -> type[Variance]:
        # Those of isotropic interfaces have axes in the plane of incidence
        return PerAxis if variance is Isotropic else Covariance

    def reflectances(self) -> tuple[str, ...]:
        return tuple(self.calibrations)

    def solves(self, material: Material) -> bool:
        from velatura.model import solution

        return bool(material.interfaces) and any(layer.spreads for layer in solution.plain(material).layers)

    def unsolved(self, model: Model) -> Model:
        from velatura.model import solution

        return solution.geometry(model)

    def body(self, material: Material, model: Model, variance: type[Variance], context: Context) -> Body:
        from velatura.model import solution

        if not self.solves(material):
            return super().body(material, self.unsolved(model), variance, context)
        return solution.solve(material, model, variance, context)

    def textured(self, material: Material, *values: Any) -> Textured | None:
        from velatura.model import textured

        return textured.textured(material, *values) if material.interfaces else None

    def statistics(self, material: Material, model: Model, wi: Direction) -> StackLobes:
        from velatura.model import solved_lobes  # loads SciPy

        return solved_lobes.solved_lobes(material, model, wi)
