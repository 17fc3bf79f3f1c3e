"""The models of the papers, by their switches."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from velatura.model.base import SWITCHES, Body, Model
from velatura.optics.ggx import Direction

if TYPE_CHECKING:
    from velatura.model.context import Context
    from velatura.model.lobe_statistics import StackLobes
    from velatura.model.variance import Variance
    from velatura.stack import Material


@dataclass(frozen=True)
class PaperModel(Model):
    """A recursion of the papers (Belcour 2018, section 5; Weier & Belcour 2020; Yamaguchi et al. 2019), by the choices
    in which they, and their published code, differ: see `Model`."""

    closed_form: ClassVar[bool] = True

    name: str
    reflectance: str
    tir: str
    map: str = "belcour"
    scale: str = "shipped"
    channels: str = "mean"
    medium: str = "shipped"
    form: str = "forward"
    fetch: str = "averaged"
    lobes: str = "all"

    @property
    def surrogate(self) -> PaperModel:
        return self

    @property
    def without_tir(self) -> PaperModel:
        return dataclasses.replace(self, tir="off")

    @property
    def pointwise(self) -> PaperModel:
        return self

    def allowed(self, key: str) -> tuple[str, ...]:
        return SWITCHES[key]

    def body(self, material: Material, variance: type[Variance], context: Context) -> Body:
        from velatura.model import rotation_frame
        from velatura.model.papers import bsdf

        return rotation_frame.in_axes(material, variance, lambda own, kind: bsdf.body(own, self, kind, context))

    def statistics(self, material: Material, wi: Direction) -> StackLobes:
        from velatura.model.papers import statistics

        return statistics.added(material, self, wi)
