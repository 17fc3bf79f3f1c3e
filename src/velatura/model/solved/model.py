"""The model whose lobes are GGX in their own media, with energies that are solved for all directions at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import radians
from typing import TYPE_CHECKING, Any, ClassVar

from velatura.model.base import SWITCHES, Body, Model
from velatura.optics.ggx import Direction
from velatura.stack import BaseValues

if TYPE_CHECKING:
    from velatura.model.context import Context
    from velatura.model.lobe_statistics import StackLobes
    from velatura.model.solved.spectra import Spectra
    from velatura.model.solved.textures import Textured
    from velatura.model.variance import Variance
    from velatura.stack import Material

REFLECTANCES = "fgd", "fgd-multi"


@dataclass(frozen=True)
class SolvedModel(Model):
    """Adding on nodes of tangential momentum (docs/explanation/model.md). It is calibrated for one value of each switch
    but the reflectance and the form.

    `near` is the model in closed form that stands in for it, whose switches follow its own.
    """

    closed_form: ClassVar[bool] = False

    name: str
    reflectance: str
    near: Model
    form: str = "forward"
    tir: str = field(default="published", init=False)
    map: str = field(default="belcour", init=False)
    scale: str = field(default="shipped", init=False)
    channels: str = field(default="mean", init=False)
    medium: str = field(default="shipped", init=False)
    fetch: str = field(default="averaged", init=False)
    lobes: str = field(default="all", init=False)

    @property
    def surrogate(self) -> Model:
        return self.near.with_switches(reflectance=self.reflectance, form=self.form)

    @property
    def without_tir(self) -> Model:
        return self.surrogate.without_tir

    @property
    def pointwise(self) -> Model:
        return self.surrogate.with_switches(reflectance="fresnel")

    def allowed(self, key: str) -> tuple[str, ...]:
        return REFLECTANCES if key == "reflectance" else SWITCHES[key] if key == "form" else (getattr(self, key),)

    def body(self, material: Material, variance: type[Variance], context: Context) -> Body:
        from velatura import metals
        from velatura.model import rotation_frame
        from velatura.model.solved import smooth_metal, solve, whole_differences
        from velatura.model.solved.energies.wavelengths import WAVELENGTHS

        if not _is_solved(material):
            metal = metals.of(material, WAVELENGTHS)
            if metal:
                return smooth_metal.body(material, metal, self.pointwise, variance, context)
            return self.pointwise.body(material, variance, context)

        def solved(material: Material) -> Body:
            return rotation_frame.in_axes(material, variance, lambda own, kind: solve.solve(own, self, kind, context))

        return whole_differences.body(material, solved)

    def lit(self, material: Material, wi: Direction) -> Callable[[Any], Body]:
        if self.form != "forward" or not _is_solved(material):
            return super().lit(material, wi)
        from velatura.model import rotation_frame
        from velatura.model.context import Context
        from velatura.model.solved import solve
        from velatura.model.variance import variance_kind
        from velatura.optics import ggx

        frame = rotation_frame.frame(material)
        inside, kind = ggx.rotate(wi, radians(frame.degrees(material))), frame.kind(variance_kind(material))
        straight = solve.plain(frame.back(material).solid())
        found = solve.Solver.of(self, kind, Context(), straight).lit(straight, inside)
        return lambda which: frame.turned(found.body(which), material)

    def statistics(self, material: Material, wi: Direction) -> StackLobes:
        from velatura.model.solved import statistics

        return statistics.solved_lobes(material, self, wi)

    def over_wavelengths(
        self,
        material: Material,
        spectral: Callable[[], Material],
        places: Any,
        variance: type[Variance],
        context: Context,
    ) -> Spectra | None:
        from velatura.model.solved import spectra

        return spectra.solve(spectral(), places, self, variance, context) if _is_solved(material) else None

    def textured(
        self, material: Material, ranges: Any, symbolic: Any, variance: type[Variance], context: Context, known: Any
    ) -> Textured | None:
        from velatura.model.solved import textures

        if _is_bare(material):
            return None
        return textures.textured(material, ranges, symbolic, self, variance, context, known)


def _is_solved(material: Material) -> bool:
    """Whether a material with constants of a renderer spreads light, but for a diffuse base alone, which is exact."""
    from velatura.renderer.differentiated import plain

    return not _is_bare(material) and any(layer.spreads for layer in plain(material).layers)


def _is_bare(material: Material) -> bool:
    return isinstance(material.layers[0], BaseValues)
