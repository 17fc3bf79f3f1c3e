"""Recursions over the layers of a stack, and the properties that follow. A named model names its recursion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from velatura.model.variance import Variance
from velatura.optics.ggx import Direction

if TYPE_CHECKING:  # recursions use records that are prepared for them
    from velatura.model.context import Context
    from velatura.model.lobe_statistics import StackLobes
    from velatura.model.models import Model
    from velatura.model.papers.bsdf import Body
    from velatura.model.solved.textures import Textured
    from velatura.stack import Material


class Recursion:
    """A recursion over the layers.

    Attributes:
        closed_form: an interface that has a given lobe follows in closed form (Bati et al. 2021). Else materials are
            solved for all directions (`velatura.model.solved.solve`).
    """

    closed_form: ClassVar[bool]

    def reflectances(self) -> tuple[str, ...] | None:
        """Its reflectances, if all other switches but the form have one value; None if all may have any."""
        return None

    def solves(self, material: Material) -> bool:
        """Whether a material with constants of a renderer is solved for all directions at once."""
        return False

    def unsolved(self, model: Model) -> Model:
        """The model by which materials are prepared that are not solved."""
        return model

    def body(self, material: Material, model: Model, variance: type[Variance], context: Context) -> Body:
        """A material as a BSDF, with constants of a renderer."""
        from velatura.model.papers import bsdf

        return bsdf.body(material, model, variance, context)

    def textured(self, material: Material, *values: Any) -> Textured | None:
        """A material with textures, by the other values of `velatura.model.solved.textures.textured`; None where it
        has to be prepared at every point."""
        return None

    def statistics(self, material: Material, model: Model, wi: Direction) -> StackLobes:
        """The lobes of a material with values in NumPy, for directions wi, (N,) each."""
        from velatura.model.papers import statistics

        return statistics.added(material, model, wi)


@dataclass(frozen=True)
class Adding(Recursion):
    """The recursion of the papers (Belcour 2018, section 5; Weier & Belcour 2020; Yamaguchi et al. 2019)."""

    closed_form = True


ADDING = Adding()


@dataclass(frozen=True)
class InOwnMedia(Recursion):
    """Adding on nodes of tangential momentum, for lobes in their own media (`velatura.model.solved.solve`)."""

    closed_form = False

    def reflectances(self) -> tuple[str, ...]:
        return "fgd", "fgd-multi"

    def solves(self, material: Material) -> bool:
        from velatura.model.solved import solve

        return not _is_bare(material) and any(layer.spreads for layer in solve.plain(material).layers)

    def unsolved(self, model: Model) -> Model:
        from velatura.model.solved import solve

        return solve.geometry(model)

    def body(self, material: Material, model: Model, variance: type[Variance], context: Context) -> Body:
        from velatura.model.solved import rotation_frame, solve

        if not self.solves(material):
            return super().body(material, self.unsolved(model), variance, context)
        frame = rotation_frame.frame(material)
        solved = solve.solve(frame.back(material), model, frame.kind(variance), context)
        return frame.turned(solved, material)

    def textured(self, material: Material, *values: Any) -> Textured | None:
        from velatura.model.solved import textures

        return None if _is_bare(material) else textures.textured(material, *values)

    def statistics(self, material: Material, model: Model, wi: Direction) -> StackLobes:
        from velatura.model.solved import statistics

        return statistics.solved_lobes(material, model, wi)


def _is_bare(material: Material) -> bool:
    """Whether a material is a diffuse base alone, which is exact as it is."""
    return [layer.kind for layer in material.layers] == ["diffuse"]
