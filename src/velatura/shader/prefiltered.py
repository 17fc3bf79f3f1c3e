"""The light of a material by prefiltered environments: for light from each direction, every part's energy, the mean
direction in which it leaves, its width, and its skewness.

An engine blurs its environment by a GGX lobe seen along the normal (Karis 2013), of roughness alpha
(`kernel_variance`). A part of the model is then that blur about its own mean direction. It takes the alpha by which the
blur is as wide as the part is across its axis of least width; along the other axis several blurs lie side by side, of
which those on one side are nearer to each other and narrower, as third moments ask. Widths are second moments on the
sphere, which are finite for GGX.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model, variance_kind
from velatura.model.base import Body, Query
from velatura.model.context import Context
from velatura.model.guards import ALPHA_MIN
from velatura.model.variance import Isotropic
from velatura.optics.ggx import Direction
from velatura.optics.phase import tangents
from velatura.renderer import directional_grid
from velatura.renderer.low_discrepancy import at_nodes, repeated
from velatura.stack import Material

Array = NDArray[np.floating]

LINE, PLANE = (64,), (32, 17)  # nodes over the cosine, and the azimuth where an interface is brushed
COS_MIN, COS_MAX = 0.02, 1 - 1e-6  # of directions at nodes, which all have an azimuth
SAMPLES = 1024  # of a part at a node
FAINT = 1e-4  # energy, below which a part is left out
ROUND = 0.3  # elongation, up to which one blur serves
MOST_SKEW, MOST_GROWTH = 2.0, 2.0  # of the blurs along the longer axis
ALPHAS = np.concatenate([[0.0], np.geomspace(ALPHA_MIN, 1.0, 100)])


@dataclass(frozen=True)
class Prefiltered:
    """Parts over direction, from above and, where the material transmits, from below: `rows` (sides, nodes, parts, 12).

    Of each part: energy, a colour; the mean direction across the normal, in the plane of incidence and beside it, over
    the sine of the direction of light; the root of alpha; and the variance that the longer axis has beyond the shorter,
    times cosine and sine of twice its angle from the first of the `tangents`. Then vectors along that axis, in those
    tangents: the skewness of the blurs' places, and the growth of a blur's variance with its place, both in units of
    the root of that variance. `passes` says which parts leave on the other side.
    """

    rows: Array
    shape: tuple[int, ...]
    passes: Sequence[bool]

    @property
    def elongation(self) -> Array:
        """Greatest spread along the longer axis over the width of the blur, of each part; (parts,)."""
        roughness, more = self.rows[..., 5], np.hypot(self.rows[..., 6], self.rows[..., 7])
        bright = self.rows[..., :3].max(axis=-1) > 0.1 * self.rows[..., :3].max()
        ratio = np.sqrt(more / np.maximum(np.interp(roughness**2, ALPHAS, VARIANCES), VARIANCES[1]))
        return np.asarray(np.where(bright, ratio, 0).max(axis=(0, 1)))


def kernel_variance(alpha: float) -> float:
    """Variance of the blur along a tangent: of z / (1 + a^2 - (1 - a^2) z)^2 over cosines z from its axis."""
    # In powers of the sine of half the angle, so that narrow blurs have nodes
    s = np.geomspace(1e-9, 0.5, 4000)
    z = 1 - 2 * s
    weight = z / (2 * alpha**2 + (1 - alpha**2) * 2 * s) ** 2
    return float(0.5 * np.trapezoid(weight * (1 - z * z), s) / np.trapezoid(weight, s))


VARIANCES = np.array([0.0, *map(kernel_variance, ALPHAS[1:])])


def prefiltered(material: Material, model: Model) -> Prefiltered:
    """The parts of a material with values in NumPy: every interface's light, the remainder, and what passes."""
    isotropic = variance_kind(material) is Isotropic
    shape = LINE if isotropic else PLANE
    x, y, z = (np.ravel(w) for w in directional_grid.directions(shape, None))
    z = np.clip(z, COS_MIN, COS_MAX)
    scale = np.sqrt((1 - z * z) / (x * x + y * y))
    body = model.body(material, variance_kind(material), Context())
    count = len(model.statistics(material, (x[:1] * scale[:1], y[:1] * scale[:1], z[:1])).energy)
    reflected = [Query([k == j for j in range(count + 1)], False) for k in range(count + 1)]
    asked = [*reflected, *([Query(False, True, radiance=False)] if material.transmits else [])]
    sides = [1.0, -1.0] if material.transmits else [1.0]
    rows = np.array([[_moments(body, (x * scale, y * scale, side * z), each) for each in asked] for side in sides])
    kept = np.nonzero(rows[..., :3].max(axis=(0, 2, 3)) > FAINT)[0]
    kept = kept if len(kept) else np.arange(1)
    # At the normal the ratio of two small numbers is noise
    turns = prod(shape[1:])
    rows[..., -turns:, 3:5] = rows[..., -2 * turns : -turns, 3:5]
    return Prefiltered(rows[:, kept].transpose(0, 2, 1, 3), shape, [bool(asked[k].transmission) for k in kept.tolist()])


def _moments(body: Body, wi: Direction, asked: Query) -> Array:
    """The numbers of a part at directions (N,): (N, 12)."""
    nodes = len(wi[0])
    u = at_nodes(nodes, SAMPLES)
    repeat = tuple(repeated(x, SAMPLES) for x in wi)
    wo, _ = body.sample(repeat, *u, asked)
    value, density = body.eval_pdf(repeat, wo, asked)
    weight = np.where(density > 0, value / np.where(density > 0, density, 1), 0)
    weight = np.broadcast_to(weight, (3, nodes * SAMPLES)).reshape(3, nodes, SAMPLES)
    energy = weight.mean(axis=-1)
    w = np.array(np.broadcast_arrays(*wo)).reshape(3, nodes, SAMPLES)
    share = weight.mean(axis=0)
    share = share / np.maximum(share.sum(axis=-1, keepdims=True), 1e-12)

    # The mean, in the plane of incidence
    sine = np.hypot(wi[0], wi[1])
    c, s = (wi[0] / sine)[:, None], (wi[1] / sine)[:, None]
    w = np.stack([c * w[0] + s * w[1], c * w[1] - s * w[0], w[2]])
    mean = (w * share).sum(axis=-1)
    length = np.linalg.norm(mean, axis=0)
    upwards = np.array([0.0, 0.0, 1.0])[:, None]
    mean = np.where(length > 1e-6, mean / np.maximum(length, 1e-6), upwards)

    # Variances about it
    along = [np.einsum("an,ans->ns", np.stack(t), w) for t in tangents((mean[0], mean[1], mean[2]))]
    xx, xy, yy = ((along[a] * along[b] * share).sum(axis=-1) for a, b in ((0, 0), (0, 1), (1, 1)))
    half, cross = 0.5 * (xx - yy), xy
    radius = np.hypot(half, cross)
    least = np.maximum(0.5 * (xx + yy) - radius, 0)
    alpha = np.interp(least, VARIANCES, ALPHAS)

    # Third moments: a blur whose variance grows along the axis gives three times what it takes across it
    angle = 0.5 * np.arctan2(cross, half)
    axis = np.array([np.cos(angle), np.sin(angle)])
    a = axis[0][:, None] * along[0] + axis[1][:, None] * along[1]
    b = axis[0][:, None] * along[1] - axis[1][:, None] * along[0]
    aaa, abb = (share * a**3).sum(axis=-1), (share * a * b * b).sum(axis=-1)
    blur = np.maximum(np.interp(alpha, ALPHAS, VARIANCES), 1e-12)
    beyond = np.sqrt(np.maximum(2 * radius, ROUND**2 * blur))
    skewness = np.clip((aaa - 3 * abb) / beyond**3, -MOST_SKEW, MOST_SKEW)
    growth = np.clip(abb / (blur * beyond), -MOST_GROWTH, MOST_GROWTH)
    shape = [*(skewness * axis), *(growth * axis)]
    return np.stack([*energy, mean[0] / sine, mean[1] / sine, np.sqrt(alpha), 2 * half, 2 * cross, *shape], axis=-1)


def texture(found: Prefiltered) -> Array:
    """Texels, float32 of shape (height, width, 4): a column for each cosine; for each side, part, and half of its
    numbers a line, or one for each azimuth."""
    sides, _, parts, numbers = found.rows.shape
    cosines = found.shape[0]
    turns = prod(found.shape[1:])
    grid = found.rows.reshape(sides, cosines, turns, parts, numbers // 4, 4)
    return np.ascontiguousarray(grid.transpose(0, 3, 4, 2, 1, 5), np.float32).reshape(-1, cosines, 4)
