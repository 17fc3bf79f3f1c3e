"""Roughness of the lobe of an interface in its own medium, and of the veil about it that a medium scatters.

Facets of slope m move tangential momentum by 2 n cos(theta) m in a reflection, and by (n_2 cos(theta_2) - n_1
cos(theta_1)) m in a refraction, to first order. So a lobe has the tensor of its interface and, twice each, for the way
in and out, those of the interfaces above it, in units of its own moves; they add in the space of a^q, between Cauchy
(q = 1) and Gauss (q = 2), as the long tails of GGX ask for. Facets that are seen at a slant are those that face the
light: the cosine at which it meets them grows with their roughness.

Visible facets of a brushed coat that lies askew to the plane of incidence move light to one side, and so turn the lobes
below it.

What first order leaves open is in `CORRECTION`: light that goes back and forth, and that total reflection picks out.
It turns above all on how much brighter a lobe is than it would be if its light met each interface once.
Lobes of metals whose facets are long along an axis have `BRUSHED_CORRECTION` in its place, and turn little with the
plane of incidence, and are parted into light that meets the metal once, and light that coats throw back to it. Where
facets cross brushed ones above, the lobe is parted into one about the mirror direction and a tail along its own facets.

Tensors live in the frame of the plane of incidence (x in the plane, y across it), so that they turn with the layers.
Values are NumPy's, for directions (M,).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model import fitted
from velatura.model.guards import ALPHA_MIN
from velatura.model.rough_interface import Facets, brushed
from velatura.model.solved.energies.adding import Part
from velatura.model.solved.energies.brushing import crossing, long, thrown_back
from velatura.model.solved.energies.media import Slab
from velatura.model.solved.guards import COS_OF_WIDTHS_MIN, WIDTH_ALPHA_MAX
from velatura.model.solved.lobes import refracted_lobe
from velatura.model.solved.lobes.refracted_lobe import Reflectance, RefractedLobe
from velatura.model.variance import Roughness
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction

Array = NDArray[np.floating]

NEARLY_STRAIGHT = 0.2  # radians; by how much light of a veil is turned at most, in one event
SHARE_MIN = HenyeyGreenstein(0.05).within(NEARLY_STRAIGHT)  # of media that have a veil
HALVINGS = 30  # of an angle, to a part of 10^9
COARSE = 144  # normals
MOST_PARTED = 2.0  # logarithm of the change of a width where a lobe is parted
AXES = (0.0, 0.5 * np.pi)  # of a tensor
LEAST_STEP = 0.02  # of the logarithm of the index, that counts at all
LEAST_TURN = 1e-3  # step times alpha, of facets that turn light


@dataclass(frozen=True)
class Tensor:
    """Squares of widths: entries in the frame of the plane of incidence."""

    xx: Array
    xy: Array
    yy: Array

    @classmethod
    def of(cls, facets: Facets, phi: Array) -> Tensor:
        u, v = (max(alpha, ALPHA_MIN) ** 2 for alpha in (facets.alpha_u, facets.alpha_v))
        c, s = np.cos(facets.rotation - phi), np.sin(facets.rotation - phi)
        return cls(u * c * c + v * s * s, (u - v) * c * s, u * s * s + v * c * c)

    @classmethod
    def turned(cls, u: Array, v: Array, angle: Array) -> Tensor:
        """Tensor of widths along axes, the first at an angle from the plane."""
        c, s = np.cos(angle), np.sin(angle)
        return cls(u * u * c * c + v * v * s * s, (u * u - v * v) * c * s, u * u * s * s + v * v * c * c)

    def stretched(self, x: Array, y: Array) -> Tensor:
        """Tensor of widths that are longer by x in the plane, and by y across it."""
        return Tensor(self.xx * x * x, self.xy * x * y, self.yy * y * y)

    @property
    def angle(self) -> Array:
        """Angle of the first axis from the plane."""
        half = 0.5 * (self.xx - self.yy)
        turned = np.hypot(half, self.xy) > 1e-9 * (self.xx + self.yy)
        return np.asarray(0.5 * np.arctan2(np.where(turned, self.xy, 0.0), np.where(turned, half, 1.0)))

    def width(self, angle: Array) -> Array:
        """Width in a direction at an angle from the plane."""
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray(np.sqrt(np.maximum(self.xx * c * c + 2 * self.xy * c * s + self.yy * s * s, 0)))

    @property
    def size(self) -> Array:
        """Width on average over directions."""
        return np.asarray(np.sqrt(0.5 * (self.xx + self.yy)))

    def scaled(self, along: Array, across: Array) -> Tensor:
        """Tensor of widths that are longer along its axes."""
        return Tensor.turned(along * self.width(self.angle), across * self.width(self.angle + AXES[1]), self.angle)

    def mixed(self, other: Tensor, share: Array | float) -> Tensor:
        """The tensor with a share of another one."""
        return Tensor(*(x + share * (y - x) for x, y in zip(vars(self).values(), vars(other).values())))

    def roughness(self, phi: Array) -> Roughness:
        """Roughness in the frame of the stack; `phi` is the azimuth of the plane."""
        u, v = (np.minimum(self.width(self.angle + turn), WIDTH_ALPHA_MAX) for turn in AXES)
        return Roughness(u, v, self.angle + phi)

    def straight(self) -> Roughness:
        """Roughness in the plane and across it, where these are its axes."""
        u, v = (np.minimum(self.width(np.asarray(turn)), WIDTH_ALPHA_MAX) for turn in AXES)
        return Roughness(u, v, 0.0)


def _sum(parts: Sequence[Tensor]) -> Tensor:
    """Sum of tensors: powers q of widths add along the axes of the sum of squares."""
    squares = Tensor(*(np.sum([getattr(part, entry) for part in parts], axis=0) for entry in ("xx", "xy", "yy")))
    angle = squares.angle
    u, v = (np.sum([part.width(angle + turn) ** fitted.Q for part in parts], axis=0) ** (1 / fitted.Q) for turn in AXES)
    return Tensor.turned(u, v, angle)


@dataclass(frozen=True)
class _Coat:
    """An interface above others, of a tensor, with its indices, the cosine above it, and what it lets pass there."""

    tensor: Tensor
    n: float
    n_below: float
    cosine: Array
    passed: Array
    facets: Facets

    @property
    def contrast(self) -> float:
        return abs(float(np.log(self.n_below / self.n)))

    @property
    def leaving(self) -> Reflectance:
        """Share that it lets pass, at cosines outside."""
        if self.facets.films is None:
            return _Outlet(self.n, self.n_below / self.n)
        return lambda cos_theta: np.asarray(ops.mean(self.facets.passing(_cosine(cos_theta, self.n, 0.0))))

    @functools.cached_property
    def moved(self) -> Tensor:
        """Displacement of momentum in a refraction."""
        x, y = (
            np.sqrt(np.maximum(self.n_below**2 - (1 - cos2) * self.n**2, COS_OF_WIDTHS_MIN**2)) - self.n * np.sqrt(cos2)
            for cos2 in _steeper(self.cosine, np.sqrt(self.tensor.xx), fitted.STEEPNESS)
        )
        return self.tensor.stretched(np.abs(x), np.abs(y))

    @functools.cached_property
    def aside(self) -> Array:
        """Momentum across the plane of incidence that light gains, in the mean over visible normals, on its way in.

        A hemisphere of normals, seen from w, has a mean of about 2/3 w; facets of a tensor are one that is stretched.
        """
        cos2 = self.cosine * self.cosine
        below = np.sqrt(np.maximum(self.n_below**2 - (1 - cos2) * self.n**2, COS_OF_WIDTHS_MIN**2))
        sine = np.sqrt(1 - cos2)
        slope = 2 / 3 * self.tensor.xy * sine / np.sqrt(self.tensor.xx * sine * sine + cos2)
        return np.asarray((self.n * self.cosine - below) * slope)


@dataclass(frozen=True)
class _Outlet:
    """Share of light that a dielectric of relative index eta below a medium of index n lets out, at cosines outside."""

    n: float
    eta: float

    def __call__(self, cos_theta: Value) -> Value:
        return 1 - fresnel.dielectric(_cosine(cos_theta, self.n, 0.0), self.eta)


@dataclass(frozen=True)
class _Facet:
    """Reflectance of a dielectric of relative index eta, by the square of the cosine."""

    eta: float

    def __call__(self, cos2: Value) -> Value:
        return fresnel.dielectric(ops.sqrt(cos2), self.eta)


def stepped(steps: Sequence[float], least: float = LEAST_STEP) -> list[int]:
    """Numbers of the interfaces that make a step of the index, for the steps of the logarithm of all: slight ones
    beside greater ones do not count."""
    most = max(steps, default=0.0)
    return [k for k, step in enumerate(steps) if step > fitted.SLIGHT_STEP * most] if most > least else []


def first_step(steps: Sequence[float]) -> int | None:
    """Number of the interface that shapes light on its way out: the outermost step; None without one."""
    return next(iter(stepped(steps)), None)


class Tail(NamedTuple):
    """The wider part of a lobe, with its share of the light, (M,)."""

    tensor: Tensor
    share: Array


class Width(NamedTuple):
    """The roughness of a lobe, that of what its tail leaves of it, and the tail, None where it has none."""

    tensor: Tensor
    near: Tensor
    tail: Tail | None


def tensors(found: Sequence[Part], cos_theta: Array, phi: Array, energies: Array) -> list[Tensor]:
    """Roughness of the lobe of each interface as a whole; arguments as `each`."""
    return [width.tensor for width in each(found, cos_theta, phi, energies)]


def each(found: Sequence[Part], cos_theta: Array, phi: Array, energies: Array) -> list[Width]:
    """Widths of the lobe of each interface in the medium above it, from the top, in the plane of incidence.

    Args:
        found: the layers, as `energies.adding.parts` has them.
        cos_theta, phi: of the directions, (M,).
        energies: of the lobes (K, M), means over colours.
    """
    result: list[Width] = []
    coats: list[_Coat] = []
    share = np.ones((1, len(cos_theta)))
    for part in found:
        if isinstance(part, Slab):
            share = share * np.exp(-2 * (part.tau_a + part.tau_s)[:, None] / _cosine(cos_theta, part.n))
        if not isinstance(part, Facets):
            continue
        n = float(ops.mean(part.above))
        cosine = _cosine(cos_theta, n)
        own = Tensor.of(part, phi)
        if coats:
            first = _turned_aside(_first_order(own, coats, n, cosine), coats, n, cosine)
            seen = features(part, first, own, coats, cos_theta, share, energies[len(result)])
            facets = [*(coat.facets for coat in coats), part]
            width = _parted(_corrected(first, seen), own, seen, crossing(facets))
            if apart := thrown_back(facets):
                width = _by_order(width, first, _again(own, coats, n, cosine), cos_theta, seen, apart)
            result.append(width)
        else:
            result.append(Width(own, own, None))
        if not part.opaque:
            assert part.below is not None
            passed = part.passing(cosine)
            coats.append(_Coat(own, n, float(ops.mean(part.below)), cosine, passed, part))
    return result


def _first_order(own: Tensor, coats: Sequence[_Coat], n: float, cosine: Array) -> Tensor:
    def total(x: Array, y: Array) -> Tensor:
        return _sum([own, *_both_ways(coats, n * x, n * y)])  # model.md, Eq. 6

    simple = total(cosine, cosine)
    return total(*(np.sqrt(cos2) for cos2 in _steeper(cosine, np.sqrt(simple.xx), fitted.OWN_STEEPNESS)))


def _both_ways(coats: Sequence[_Coat], x: Array, y: Array) -> list[Tensor]:
    """Tensors of what coats add on the way in and out, of a lobe whose facets move momentum by 2 x and 2 y."""
    return [coat.moved.stretched(0.5 / x, 0.5 / y) for coat in coats] * 2


def _turned_aside(first: Tensor, coats: Sequence[_Coat], n: float, cosine: Array) -> Tensor:
    """The tensor of a lobe whose light brushed coats have moved across the plane of incidence: sheared, so that light
    as far from the mirror's direction as the lobe is wide lies aside by that move."""
    aside = sum(coat.aside for coat in coats) / (2 * n * cosine)
    shear = aside / np.sqrt(first.xx)
    return Tensor(first.xx, first.xy + shear * first.xx, first.yy + 2 * shear * first.xy + aside * aside)


def features(
    part: Facets, first: Tensor, own: Tensor, coats: Sequence[_Coat], cos_theta: Array, share: Array, energy: Array
) -> dict[str, Array]:
    """Features of the correction, (M,) each, or (2, M) for the axes; `share` is what media let pass."""
    n, opener = coats[-1].n_below, coats[first_step([coat.contrast for coat in coats]) or 0]
    share = share * opener.passed
    for coat in coats:
        share = share * (1 if coat is opener else coat.passed**2)
    cosine = _cosine(cos_theta, n)
    sin2 = 1 - cos_theta * cos_theta
    wi = np.sqrt(sin2), np.zeros_like(sin2), cos_theta
    lobe = RefractedLobe(1.0, first.roughness(np.zeros_like(sin2)), n, None, opener.leaving)
    reflected, below = part.reflectance(cosine), 1.0
    if part.opaque:
        let_out = refracted_lobe.integral(lobe, wi, COARSE)
        expected = ops.mean(reflected * share) * let_out
    else:
        assert part.below is not None
        below = float(ops.mean(part.below)) / n

        def coated(cos2: Array) -> Array:
            return np.asarray(ops.mean(part.reflectance(np.sqrt(cos2))))

        facets = _Facet(below) if part.films is None else coated
        let_out, both = refracted_lobe.integrals_of_facets(replace(lobe, facets=facets), wi, COARSE)
        reflected = both / np.maximum(let_out, 1e-9)
        expected = both * ops.mean(share)
    brighter = np.log(np.maximum(energy, 1e-9) / np.maximum(expected, 1e-9))
    moved = max((coat.tensor.size * coat.contrast for coat in coats), key=np.max)
    axes = np.array([first.width(first.angle + turn) for turn in AXES])
    of_coats = 1 - np.minimum(np.array([own.width(first.angle + turn) for turn in AXES]) / axes, 1) ** fitted.Q
    return {
        "1": np.ones_like(sin2),
        "steps": np.full_like(sin2, sum(coat.contrast for coat in coats)),
        "brighter": np.clip(brighter, -1.5, 2.0),
        "slant": sin2,
        "size": np.log(axes),
        "coats": of_coats,
        "across": of_coats[::-1],
        "ratio": np.log(axes / axes[::-1]),
        "rough": moved,
        "falling": np.full_like(sin2, np.log(max(coat.n_below for coat in coats) / n)),
        "index": np.full_like(sin2, n - 1),
        "reflected": np.ones_like(sin2) if part.opaque else reflected,
        "rarer": np.full_like(sin2, max(1 - below, 0.0)),
        "near": np.minimum((1 - cosine * cosine) / below**2, 1) * (not part.opaque),
        "lost": 1 - let_out / np.maximum(opener.leaving(cos_theta), 1e-3),
        "metal": np.full_like(sin2, float(part.opaque)),
        "brushed": _brushed(part, own, coats, n * cosine) * part.opaque,
    }


def _brushed(part: Facets, own: Tensor, coats: Sequence[_Coat], height: Array) -> Array:
    """How long facets are along an axis, from 0 to 1: a mean over those that make the width of a lobe."""
    squares = np.array([own.size**2, *(2 * (coat.moved.size / (2 * height)) ** 2 for coat in coats)])
    brushed = [part.brushed, *(coat.facets.brushed for coat in coats)]
    return np.asarray(np.tensordot(brushed, squares, axes=1) / squares.sum(axis=0))


def _corrected(first: Tensor, seen: dict[str, Array]) -> Tensor:
    """The tensor with its axes scaled, and then the components in the plane and across it.

    What long facets make lies along them, in any plane of incidence; only what coats add to it turns with the plane.
    """
    shape = 2, *first.xx.shape
    each = {name: np.broadcast_to(x, shape) for name, x in seen.items()}
    products = np.array([each[a] * each[b] for (a, b), _, _ in fitted.CORRECTION])
    along, to_difference = np.transpose([numbers for _, *numbers in fitted.CORRECTION])
    axes = np.tensordot(along, products, axes=1)
    apart = np.tensordot(to_difference, products.mean(axis=1), axes=1) * seen["slant"]
    of_brushed = sum(number * each[a] * each[b] for (a, b), number in fitted.BRUSHED_CORRECTION)
    fades, turns = fitted.COATS_MAKE
    axes = axes + seen["brushed"] * (1 - each["coats"] ** fades) * (of_brushed - axes)
    apart = apart * (1 - seen["brushed"] * (1 - each["coats"].max(axis=0)) ** turns)
    fading = seen["steps"] / (seen["steps"] + fitted.CORRECTION_FADE)
    u, v, x = (np.exp(np.clip(fading * each, -fitted.CORRECTION_MAX, fitted.CORRECTION_MAX)) for each in (*axes, apart))
    return first.scaled(u, v).stretched(x, 1 / x)


def _parted(tensor: Tensor, own: Tensor, seen: dict[str, Array], crossed: float) -> Width:
    """A lobe of crossed facets as two: a sum of tails along different axes is no ellipse.

    One step of momentum is that of a facet of the lobe's own interface, along its axes; smaller ones, of the interfaces
    above, broaden what lies near the mirror direction more than the tail.
    """
    if not crossed:
        return Width(tensor, tensor, None)

    def scaled(angle: Array, numbers: Mapping[str, float]) -> Tensor:
        axes = np.array([tensor.width(angle + turn) for turn in AXES])
        coats = 1 - np.minimum(np.array([own.width(angle + turn) for turn in AXES]) / axes, 1) ** fitted.Q
        by_axis = {**seen, "coats": coats, "slanted coats": seen["slant"] * coats}
        change = crossed * sum(number * by_axis[name] for name, number in numbers.items())
        u, v = axes * np.exp(np.clip(change, -MOST_PARTED, MOST_PARTED))
        return Tensor.turned(u, v, angle)

    near, tail = scaled(tensor.angle, fitted.NEAR_MIRROR), scaled(own.angle, fitted.TAIL)
    share = crossed / (1 + np.exp(-sum(number * seen[name] for name, number in fitted.TAIL_ODDS.items())))
    return Width(tensor, near, Tail(tail, share))


def _again(own: Tensor, coats: Sequence[_Coat], n: float, cosine: Array) -> Tensor:
    """Tensor, to first order, of light that meets the facets of an interface twice, and in between those of a coat from
    inside, each as often as it makes a part of all steps of the index."""
    steps = np.array([coat.facets.step for coat in coats])
    shares = (steps / max(steps.sum(), LEAST_STEP)) ** (1 / fitted.Q)
    met = [coat.tensor.stretched(share, share) for coat, share in zip(coats, shares)]
    return _sum([own, own, *met, *_both_ways(coats, n * cosine, n * cosine)])


def _by_order(
    parted: Width, first: Tensor, again: Tensor, cos_theta: Array, seen: dict[str, Array], apart: float
) -> Width:
    """A lobe of long facets below coats as two: light that meets them once, and light that coats throw back to them.

    The first is as wide as first order has it below smooth coats, and a little wider below rough ones, which at
    grazing angles also turn it across the plane of incidence.
    """
    coats = seen["coats"].max(axis=0)
    once = first.scaled(*(np.exp((wider + fitted.ONCE_ROUGH * seen["rough"]) * coats) for wider in fitted.ONCE))
    across = np.exp(fitted.ONCE_ACROSS * coats * (1 - cos_theta) ** 2)
    once = once.stretched(1 / across, across)
    again = again.scaled(*(np.exp(wider + fitted.AGAIN_COATS * coats) for wider in fitted.AGAIN_WIDER))
    brighter, slant = np.maximum(seen["brighter"], 0), seen["slant"]
    share = -apart * np.expm1(-brighter * (fitted.AGAIN_SHARE[0] - fitted.AGAIN_SHARE[1] * slant * slant))
    near = parted.near.mixed(once, apart)
    if parted.tail:
        tensor, of_axes = parted.tail
        again, share = tensor.mixed(again, ops.divide(share, share + of_axes)), share + of_axes
    return Width(parted.tensor, near, Tail(again, share))


def steeper(alpha_u: Value, alpha_v: Value, of_metal: tuple[Value, Value] | None) -> Value:
    """Share of sin^2 by which the square of the cosine grows at which light that leaves meets facets that are brushed,
    or above a brushed metal of roughnesses `of_metal`, in any dialect."""
    of_own, of_others = fitted.LEAVING_STEEPNESS
    steepness = of_own * brushed(alpha_u, alpha_v)
    if of_metal:
        steepness = ops.maximum(steepness, of_others * long(brushed(*of_metal)))
    return ops.minimum(0.5 * steepness * (alpha_u * alpha_u + alpha_v * alpha_v), 1.0)


def veil(found: Sequence[Part], k: int, cos_theta: Array, tensor: Tensor) -> Tensor:
    """The tensor of the light of interface k that the media above it scatter by little.

    At small angles Henyey and Greenstein's function is a Cauchy distribution, for which widths of events add; of the
    light of the veil, each has been scattered at least once.
    """
    n = [float(ops.mean(part.above)) for part in found if isinstance(part, Facets)][k]
    mean, width = np.zeros_like(cos_theta), np.zeros_like(cos_theta)
    above = 0
    for part in found:
        above += isinstance(part, Facets)
        if above > k or not isinstance(part, Slab):
            continue
        cosine = _cosine(cos_theta, part.n)
        events = 2 * nearly_straight(part.phase) * ops.mean(part.tau_s) / cosine
        mean = mean + events
        width = width + events * _of_event(part.phase) * part.n * cosine / (n * _cosine(cos_theta, n))
    width = width / np.maximum(-np.expm1(-mean), np.finfo(float).tiny)  # model.md, Eq. 7
    scattered = Tensor(width**2, np.zeros_like(width), width**2)
    return _sum([tensor, scattered])


@functools.lru_cache(256)
def nearly_straight(phase: PhaseFunction) -> float:
    """Share of the scattered light of a medium that is deflected by little, and stays in a veil; none of what hardly
    has a peak forwards."""
    share = phase.within(NEARLY_STRAIGHT)
    return share if share > SHARE_MIN else 0.0


@functools.lru_cache(256)
def _of_event(phase: PhaseFunction) -> float:
    """Width in slopes of one event of a veil: half the median angle."""
    share = 0.5 * nearly_straight(phase)
    low, high = 0.0, NEARLY_STRAIGHT
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if phase.within(middle) < share else (low, middle)
    return 0.25 * (low + high) if share > 0 else 0.0


def _cosine(cos_theta: Value, n: Value, least: float = COS_OF_WIDTHS_MIN) -> Value:
    """Inside, by Snell's law."""
    return ops.sqrt(1 - (1 - cos_theta * cos_theta) / (n * n), least**2)


def _steeper(cosine: Array, width: Array, steepness: Sequence[float]) -> list[Array]:
    """Mean squares of the cosine at which light meets facets that face it."""
    cos2 = cosine * cosine
    return [np.minimum(cos2 + k * (1 - cos2) * width * width, 1) for k in steepness]
