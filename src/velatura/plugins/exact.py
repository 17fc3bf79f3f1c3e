"""The form `exact` of `layered`: directions by the model, values by an unbiased estimate of the random walk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from velatura.binding import Asked, Binding, Image, PointBSDF
from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.model.base import Body, Query
from velatura.model.guards import ALPHA_MIN
from velatura.plugins import bodies, spectral
from velatura.plugins.layered import EXACT, LayeredStack
from velatura.reference.layers import MATCHED
from velatura.reference.plugin import Settings, WalkedPoint, WalkedStack

_MAX_DEPTH = 1000
_SPREAD = 0.02  # share of samples that are drawn by the cosine, for light where the model has hardly any

#: Laws of `velatura.checks` that walks do not keep, and this does, since its samples are those of the model; and those
#: that it does not. It is reciprocal, but few pairs of directions have most of its noise, which is far from normal.
KEPT = frozenset({"normalisation", "chi-square", "weights"})
NOT_KEPT = frozenset({"spread", "reciprocity"})


class ExactStack(LayeredStack):
    """One stack: sampled by a model, and seldom by the cosine; evaluated by walks.

    Wholly smooth, uniform stacks are those of the model, which is exact there. Other interfaces are at least as rough
    as the model has them.
    """

    def __init__(self, mi: Any, model: Model, binding: Binding) -> None:
        settings = Settings(0, _MAX_DEPTH, model.microsurface, least_alpha=ALPHA_MIN, either_end=True)
        self.walked = WalkedStack(mi, settings, binding)
        super().__init__(mi, model, binding)

    @property
    def exceptions(self) -> frozenset[str]:
        return super().exceptions if self.delta else (self.walked.exceptions - KEPT) | NOT_KEPT

    def _update(self, before: bodies.Bodies | None) -> None:
        super()._update(before)
        self.walked.update()
        if self.delta:
            return
        if self.transmits and self._is_straight():
            raise InvalidInput(
                f"form={EXACT}: no interface bends light, which passes straight; layered_reference has that"
            )
        self.kinds, self.components = self.walked.kinds, self.walked.components

    def _is_straight(self) -> bool:
        """Whether interfaces are known to bend no light, as between media of equal index."""
        seen = self.binding.with_constants()
        index = [layer.eta for layer in seen.interfaces]
        if any(isinstance(eta, Image) for eta in index):
            return False
        means = np.array([np.mean(np.array(eta)) for eta in (seen.exterior, *index)])
        return bool(np.all(np.abs(means[1:] / means[:-1] - 1) < MATCHED))

    def at(self, si: Any, asked: Asked, active: Any) -> PointBSDF:
        if self.delta:
            point = super().at(si, asked, active)
            walked = WalkedPoint(self.walked, si, {}, asked.radiance)
            polarises = self.mi.is_polarized and self.walked.layers(si, active, si.wi.z < 0).polarises
            return SmoothPoint(point, walked) if polarises else point
        wanted = dict(zip(self.kinds, asked.components))
        passing = wanted.get(self.mi.BSDFFlags.GlossyTransmission, False)
        reflecting = sum(asked.components) > passing
        body = self.bodies.at(si, active).at_direction(tuple(si.wi))
        walked = WalkedPoint(self.walked, si, wanted, asked.radiance)
        return ExactPoint(self, body, Query(reflecting, passing, asked.radiance), walked)


@dataclass(frozen=True)
class SmoothPoint(PointBSDF):
    """A smooth stack at a surface point in a polarised variant: the samples of a model, with Mueller matrices."""

    model: PointBSDF
    walked: WalkedPoint

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        bs, weight = self.model.draw(sample1, sample2, active)
        squeezed = bs.eta * bs.eta if self.walked.radiance else 1.0
        matrix = self.walked.smooth(bs.wo) / (squeezed * dr.maximum(bs.pdf, 1e-9))
        value = dr.select(active & (bs.pdf > 0), matrix, 0)
        # Gradients are those of the model
        if dr.grad_enabled(weight):
            value = weight + dr.detach(value - weight)
        return bs, value

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]:
        return self.model.eval_pdf(wo, active)


@dataclass(frozen=True)
class ExactPoint(PointBSDF):
    """A stack at a surface point, for light from one direction; `asked` are the sides that samples are drawn for."""

    stack: ExactStack
    body: Body
    asked: Query
    walked: WalkedPoint

    def draw(self, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        mi, kinds, wi = self.stack.mi, self.stack.kinds, self.walked.si.wi
        bs = dr.zeros(mi.BSDFSample3f)
        # By the model
        rest = dr.maximum(sample1 - _SPREAD, 0) / (1 - _SPREAD)
        drawn, eta = self.body.sample(tuple(wi), rest, sample2.x, sample2.y, self.asked)
        # Or by the cosine, on the sides that are asked for
        spread, through = sample1 < _SPREAD, sample1 < _SPREAD * self._through
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        wo.z = dr.select(through ^ (wi.z < 0), -wo.z, wo.z)
        bs.wo = dr.select(spread, wo, mi.Vector3f(*drawn))
        bs.eta = dr.select(spread, dr.select(through, self.walked.eta, 1) if self.asked.transmission else 1, eta)
        first = next((k for k, kind in enumerate(kinds) if self.walked.asked[kind]), 0)
        passed = wi.z * bs.wo.z < 0
        bs.sampled_component = dr.select(passed, mi.UInt32(len(kinds) - 1), mi.UInt32(first))
        bs.sampled_type = dr.select(passed, mi.UInt32(+kinds[-1]), mi.UInt32(+kinds[first]))
        return bs, None

    @property
    def _through(self) -> float:
        """Chance that a sample by the cosine passes."""
        return self.asked.transmission / max(self.asked.transmission + bool(self.asked.reflection), 1)

    def eval_pdf(self, wo: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        mi, wi = self.stack.mi, self.walked.si.wi
        of_model, pdf = self.body.eval_pdf(tuple(wi), tuple(wo), self.asked)
        to_side = dr.select(wi.z * wo.z < 0, self._through, 1 - self._through)
        pdf = (1 - _SPREAD) * pdf + _SPREAD * to_side * dr.abs(wo.z) / dr.pi
        lit = active & (self.stack.transmits | (wi.z > 0))
        with dr.suspend_grad():
            value = self.walked.eval(wo, active)
        # No gradient passes the loop of a walk
        of_model = mi.depolarizer(spectral.carried(mi, of_model)) & active
        if dr.grad_enabled(of_model):
            value = of_model + dr.detach(value - of_model)
        return value, dr.select(lit, pdf, 0)
