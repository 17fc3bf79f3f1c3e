"""A BSDF on a flat patch, queried in bulk: NumPy arrays in, NumPy arrays out.

An answer that is no number, infinite or negative is noted for one law to judge; the others see 0 if it is not finite.
Every question is traced for whole arrays, so that a BSDF is compiled once for each of its functions and not once for
each direction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.renderer.packets import aligned

Array = NDArray[Any]

_BATCH = 2**16  # directions asked about at once
_WAVELENGTHS = (450.0, 530.0, 600.0, 680.0)  # nm, where the variant is spectral


class ProbeSamples(NamedTuple):
    """Samples of a BSDF: directions (n, 3), weights (n, channels), densities, indices, and whether they are of a smooth
    component, and of a kind that the flags have (n,)."""

    wo: Array
    weight: Array
    pdf: Array
    eta: Array
    delta: Array
    declared: Array


class Wrong(NamedTuple):
    """Values that are NaN, infinite or negative: their function, directions (n, 3), and the values (n,)."""

    function: str
    wi: Array
    wo: Array
    answer: Array


class Values(NamedTuple):
    """f(wi, wo) |cos theta_o| of shape (n, channels), and the density of wo (n,)."""

    value: Array
    pdf: Array


class Probe:
    """Queries one BSDF in the current variant.

    Args:
        bsdf: a `mi.BSDF`.
        uv: where on its textures it is asked.

    Attributes:
        transmits: whether light passes through.
        two_sided: whether it is lit from below as well.
        isotropic: whether no component has an azimuth.
        asked: how many answers it gave.
        wrong: those that are no number, infinite or negative.

    Raises:
        InvalidInput: a scalar variant is set, in which all this would take hours.
    """

    def __init__(self, bsdf: Any, uv: tuple[float, float] = (0.5, 0.5)) -> None:
        import drjit as dr

        self.mi = mi = kernel.mitsuba()
        if not dr.is_jit_v(mi.Float):
            raise InvalidInput(f"laws are checked in a vectorised variant, llvm_ad_rgb for one, not in {mi.variant()}")
        self.bsdf, self.uv, self.context = bsdf, uv, mi.BSDFContext()
        self.transmits = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Transmission)
        self.two_sided = self.transmits or mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
        self.isotropic = not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Anisotropic)
        self.asked = 0
        self.wrong: list[Wrong] = []

    def sample(self, wi: Array, u: Array) -> ProbeSamples:
        """Samples for directions (n, 3) and uniform numbers (n, 3); directions that have no length point upwards."""
        wo, weight, pdf, eta, delta, declared = _in_batches(self._sample, wi, u)
        unit = np.abs(np.linalg.norm(wo, axis=1) - 1) < 1e-3
        wo = np.where(unit[:, None], wo, (0.0, 0.0, 1.0))
        # Ignore the density of samples without weight
        lit = np.asarray(weight.any(axis=1))
        weight = self._noted("weight", wi, wo, weight)
        pdf = self._noted(
            "density of a sample", wi, wo, np.where(lit, pdf, np.nan_to_num(pdf, posinf=0, neginf=0)), lit
        )
        self._noted("length of a sample", wi, wo, np.where(unit, 1.0, np.nan), lit)
        return ProbeSamples(wo, weight * unit[:, None], pdf * unit, eta, delta, declared)

    def eval_pdf(self, wi: Array, wo: Array, offset: float = 0.0) -> Values:
        """Value and density from `eval_pdf`; where these are noisy, points some offset apart have other noise."""
        value, pdf = _in_batches(lambda wi, wo: self._eval_pdf(wi, wo, offset), wi, wo)
        return Values(self._noted("eval", wi, wo, value), self._noted("pdf", wi, wo, pdf))

    def eval_and_pdf(self, wi: Array, wo: Array) -> Values:
        """The same from `eval` and from `pdf`."""
        value, pdf = _in_batches(self._eval_and_pdf, wi, wo)
        return Values(self._noted("eval", wi, wo, value), self._noted("pdf", wi, wo, pdf))

    def _noted(self, function: str, wi: Array, wo: Array, answers: Array, count: Array | None = None) -> Array:
        """The values, 0 where they are not finite; invalid values that count are recorded."""
        rows = answers.reshape(len(wi), -1)
        bad = ~np.isfinite(rows) | (rows < 0)
        if count is not None:
            bad &= count[:, None]
        self.asked += rows.size
        if bad.any():
            which = np.flatnonzero(bad.any(axis=1))
            self.wrong.append(Wrong(function, wi[which], wo[which], rows[which, bad[which].argmax(axis=1)]))
        return np.where(np.isfinite(answers), answers, 0)

    # One batch

    @kernel.exclusive
    def _sample(self, wi: Array, u: Array) -> tuple[Array, ...]:
        import drjit as dr

        mi, (u1, u2, u3) = self.mi, map(self.floats, u.T)
        si, sample1, sample2 = self.interaction(wi), u1, mi.Point2f(u2, u3)
        bs, weight = self.bsdf.sample(self.context, si, sample1, sample2, True)
        weight, kind = mi.unpolarized_spectrum(weight), mi.UInt32(bs.sampled_type)
        delta, declared = mi.has_flag(kind, mi.BSDFFlags.Delta), kind & ~mi.UInt32(self.bsdf.flags()) == 0
        dr.eval(bs.wo, weight, bs.pdf, bs.eta, delta, declared)
        kinds = (_row(x).astype(bool) for x in (delta, declared))
        return _rows(bs.wo), _rows(weight), _row(bs.pdf), _row(bs.eta), *kinds

    @kernel.exclusive
    def _eval_pdf(self, wi: Array, wo: Array, offset: float) -> tuple[Array, ...]:
        return self._values(*self.bsdf.eval_pdf(self.context, self.interaction(wi, offset), self.vector(wo), True))

    @kernel.exclusive
    def _eval_and_pdf(self, wi: Array, wo: Array) -> tuple[Array, ...]:
        si, direction = self.interaction(wi), self.vector(wo)
        value = self.bsdf.eval(self.context, si, direction, True)
        return self._values(value, self.bsdf.pdf(self.context, si, direction, True))

    def _values(self, value: Any, pdf: Any) -> tuple[Array, ...]:
        import drjit as dr

        value = self.mi.unpolarized_spectrum(value)
        dr.eval(value, pdf)
        return _rows(value), _row(pdf)

    def interaction(self, wi: Array, offset: float = 0.0) -> Any:
        import drjit as dr

        mi = self.mi
        si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
        si.wi, si.uv, si.p = self.vector(wi), mi.Point2f(*self.uv), mi.Point3f(dr.opaque(mi.Float, offset), 0, 0)
        si.n, si.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1])
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)(*_WAVELENGTHS)
        return si

    def vector(self, directions: Array) -> Any:
        return self.mi.Vector3f(*map(self.floats, directions.T))

    def floats(self, values: Array) -> Any:
        """Numbers for the renderer, at an address for which every query has the same kernel."""
        return self.mi.Float(aligned(values))


def _in_batches(ask: Callable[[Array, Array], tuple[Array, ...]], a: Array, b: Array) -> tuple[Array, ...]:
    """Query rows of a and b, always the same number at a time: a kernel is compiled for one size."""
    n = len(a)
    filled = [np.concatenate([x, np.repeat(x[-1:], -n % _BATCH, axis=0)]) for x in (a, b)]
    answers = [ask(*(x[i : i + _BATCH] for x in filled)) for i in range(0, n, _BATCH)]
    return tuple(np.concatenate(parts)[:n] for parts in zip(*answers))


def _row(values: Any) -> Array:
    return np.broadcast_to(np.array(values, dtype=np.float64).reshape(-1), (_BATCH,))


def _rows(values: Any) -> Array:
    components = np.array(values, dtype=np.float64)
    return np.broadcast_to(components.reshape(len(components), -1), (len(components), _BATCH)).T
