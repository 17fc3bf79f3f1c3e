"""A model's lobes as evaluated, in the terms of the reference: sampled, so that lobes of any width are resolved."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from velatura.comparison.result import Account
from velatura.errors import InvalidInput
from velatura.light.square_bins import grids
from velatura.model import Model, variance_kind
from velatura.model.base import Body, Query
from velatura.model.context import Context
from velatura.model.lobe_statistics import StackLobes
from velatura.model.papers import adding, bsdf, mixture
from velatura.model.papers.diffuse_base import Base
from velatura.model.registry import stack_lobes
from velatura.optics.directions import directions
from velatura.optics.ggx import Direction
from velatura.reference import WalkedLobe
from velatura.renderer.low_discrepancy import at_nodes, square
from velatura.stack import Material, Stack

Array = NDArray[np.floating]

SAMPLES = 2**19  # of each lobe: enough to be less noisy than the truth
LIT_SAMPLES = 2**17  # of a lobe in the symmetric form, which adds up the layers for each of them
BASE_SAMPLES = 2**17  # of a diffuse base, which is smooth


@dataclasses.dataclass(frozen=True)
class LightPoints:
    """Light that leaves: points (2, n) on the projected disc and their energies (3, n)."""

    points: Array
    energy: Array


def account(stack: Stack, cos_theta: Sequence[float], model: Model) -> Account:
    """The lobes of a model, and their values when they are evaluated.

    Raises:
        InvalidInput: a texture where a number is needed, or a model with a lobe for each channel.
    """
    if model.channels == "separate":
        raise InvalidInput("channels=separate: only for lobes and inverse, since the truth has one roughness a lobe")
    material = Material.of(stack).solid()
    body = model.body(material, variance_kind(material), Context())
    remainder: Array | float = 0.0
    if isinstance(body, bsdf.Lobed):
        columns = [_column(body, wi) for wi in directions(cos_theta, 0.0)]
    else:
        statistics = stack_lobes(stack, cos_theta, 0.0, model)
        remainder = 0.0 if stack.base else statistics.remainder
        columns = [_drawn(body, stack, statistics, j, wi) for j, wi in enumerate(directions(cos_theta, 0.0))]

    names = [field.name for field in dataclasses.fields(WalkedLobe)]
    rows = zip(*(lobes for lobes, _ in columns))
    lobes = tuple(WalkedLobe(**{n: np.stack([getattr(x, n) for x in row], axis=-1) for n in names}) for row in rows)
    reflected, transmitted = (lobes[:-1], lobes[-1:]) if stack.transmits else (lobes, ())
    light = np.stack([grid for _, grid in columns], axis=1)
    return Account(reflected, transmitted, light.sum(axis=(2, 3)), light, remainder)


def _column(body: bsdf.Lobed, incident: Array) -> tuple[list[WalkedLobe], Array]:
    """The lobes of one direction, and the distribution (3, bins, bins) of reflected light."""
    x, y, z = incident[:, None]
    wi: Direction = (x, y, z)
    each, _ = adding.lobes(body.above, wi)
    seen = bsdf.scattered(body, wi)
    lights = [_sampled(body, lobe, wi, k) for k, lobe in enumerate(seen.reflected)]
    # A model that merges lobes still has one for each interface
    apart = lights if len(lights) == len(each) else [_sampled(body, lobe, wi) for lobe in each]
    lobes = [_described(lobe, light) for lobe, light in zip(each, apart)]
    if seen.base:
        lights.append(_sampled_base(seen.base))
        lobes.append(_lobe(seen.base.energy, (np.nan, np.nan), np.nan, lights[-1]))
    if seen.transmitted:
        lobes.append(_described(seen.transmitted, _sampled_below(body, seen.transmitted, wi)))
    return lobes, np.sum([distribution(light) for light in lights], axis=0)


def _drawn(body: Body, stack: Stack, statistics: StackLobes, j: int, incident: Array) -> tuple[list[WalkedLobe], Array]:
    """The same as `_column` of a body that is solved, by its components.

    The remainder is the light of a diffuse base, if there is one, and else in no lobe.
    """
    x, y, z = incident[:, None]
    wi: Direction = (x, y, z)
    u = at_nodes(1, LIT_SAMPLES)

    def light(part: int | None) -> LightPoints:
        each = [k == part for k in range(count + 1)]
        asked = Query(each if part is not None else False, part is None, radiance=False)
        wo, _ = body.sample(wi, *u, asked)
        return _light(wo, *body.eval_pdf(wi, wo, asked))

    count = len(statistics.energy)
    lights = [light(k) for k in range(count + 1)]
    lobes = [
        _lobe(energy[:, j, None], (alpha[0, j], alpha[1, j]), rotation[j], seen)
        for energy, alpha, rotation, seen in zip(statistics.energy, statistics.alpha, statistics.rotation, lights)
    ]
    if stack.base:
        lobes.append(_lobe(statistics.remainder[:, j, None], (np.nan, np.nan), np.nan, lights[-1]))
    if passed := statistics.transmitted:
        alpha = passed.alpha[0, j], passed.alpha[1, j]
        lobes.append(_lobe(passed.energy[:, j, None], alpha, passed.rotation[j], light(None)))
    return lobes, np.sum([distribution(each) for each in lights], axis=0)


def _sampled(body: bsdf.Lobed, lobe: adding.Lobe, wi: Direction, place: int | None = None) -> LightPoints:
    """A lobe as it is evaluated; one that is smooth, in its one direction.

    `place` is its place among the lobes that the symmetric form evaluates, None for a lobe that it does not.
    """
    if np.all(np.maximum(*lobe.roughness[:2]) == 0):
        return LightPoints(-np.stack(wi[:2]), _colour(lobe.energy))
    if body.above.model.form == "forward" or place is None:
        wo = mixture.sample([lobe], None, wi, 0.0, *square(SAMPLES))
        return _light(wo, *mixture.eval_pdf([lobe], None, wi, wo))
    wo = mixture.sample([lobe], None, wi, 0.0, *square(LIT_SAMPLES))
    lit = bsdf.exchangeable(body, wi, wo)[0][place]
    return _light(wo, *mixture.eval_pdf([lobe], None, wi, wo, [lit]))


def _sampled_below(body: bsdf.Lobed, lobe: adding.Lobe, wi: Direction) -> LightPoints:
    """The transmitted lobe as it is evaluated, as energy."""
    if np.all(np.maximum(*lobe.roughness[:2]) == 0):
        return LightPoints(-np.stack(wi[:2]) / body.eta, _colour(lobe.energy))
    asked = Query(reflection=False, radiance=False)
    wo, _ = body.sample(wi, 0.0, *square(LIT_SAMPLES), asked)
    return _light(wo, *body.eval_pdf(wi, wo, asked))


def _light(wo: Direction, value: Array, density: Array) -> LightPoints:
    count = len(density)
    energy = np.where(density > 0, value / np.where(density > 0, density, 1), 0) / count
    return LightPoints(np.stack(wo[:2]), _colour(energy, count))


def _sampled_base(base: Base) -> LightPoints:
    """Directions by the cosine law, uniform on the disc."""
    u1, u2 = square(BASE_SAMPLES)
    radius, phi = np.sqrt(u1), 2 * np.pi * u2
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi)])
    value = base.value((points[0], points[1], np.sqrt(1 - u1)))
    return LightPoints(points, _colour(np.pi * value / BASE_SAMPLES, BASE_SAMPLES))


def _described(lobe: adding.Lobe, light: LightPoints) -> WalkedLobe:
    alpha_u, alpha_v, rotation = (np.broadcast_to(x, 1)[0] for x in lobe.roughness)
    return _lobe(lobe.energy, (alpha_u, alpha_v), rotation, light)


def _lobe(energy: Array, alpha: tuple[float, float], rotation: float, light: LightPoints) -> WalkedLobe:
    """Moments on the disc weigh by the mean of the colours, as the truth's do; NaN where there is no light."""
    grey = light.energy.mean(axis=0)
    share = grey / (grey.sum() or np.nan)
    mean = light.points @ share
    x, y = light.points - mean[:, None]
    covariance = np.stack([x * x, x * y, y * y]) @ share
    return WalkedLobe(_colour(energy)[:, 0], np.array(alpha), np.array(rotation), mean, covariance)


def distribution(light: LightPoints) -> Array:
    """Energies (3, bins, bins) over the projected disc."""
    return grids(light.points, light.energy)[:, 0]


def _colour(energy: Array, count: int = 1) -> Array:
    return np.broadcast_to(energy, (3, count))


def along(lobe: WalkedLobe, true: WalkedLobe) -> WalkedLobe:
    """A model's lobe with its roughness along the axes of the true lobe, or along its own where those are not known."""
    turn = np.nan_to_num(true.rotation - lobe.rotation)
    cos2, sin2 = np.cos(turn) ** 2, np.sin(turn) ** 2
    u2, v2 = lobe.alpha**2
    return dataclasses.replace(lobe, alpha=np.sqrt([u2 * cos2 + v2 * sin2, u2 * sin2 + v2 * cos2]))
