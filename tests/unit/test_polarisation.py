"""Polarised light: facets against `tmm` and against electric fields in space, and the walk against both.

Fields are the independent account: a vector in space needs no frame, and turns and mirrors with the light. Comparisons
of walks are at 4.5 standard errors (a false alarm in 150 000), about 300 of them: they fail by chance for one choice of
seeds in 500. The seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import tmm

from velatura.optics import fresnel, ggx, microsurface, polarisation, refraction
from velatura.optics.polarisation import Mueller, Polarisation
from velatura.reference import distribution, statistics, stokes
from velatura.reference.batches import ends
from velatura.stack import Diffuse, Interface, Layer, Medium, Stack

SIGMAS = 4.5
ROUNDING = 2e-5  # of sums in single precision
WAVELENGTH = 500.0  # nm

Array = np.ndarray


# Facets

INDICES = {"into glass": 1.5, "out of glass": 1 / 1.5, "into metal": 0.2 + 3.9j, "out into metal": 0.9 + 1.4j}


def amplitudes(cosine: Array, index: complex) -> tuple[Array, Array]:
    """Of s and p, by `optics.fresnel`."""
    if np.imag(index):
        pair = fresnel.conductor_amplitudes(cosine, np.real(index), np.imag(index))
        return pair[0][0] + 1j * pair[0][1], pair[1][0] + 1j * pair[1][1]
    eta = float(np.real(index))
    cos_t = fresnel.cos_transmitted(cosine, eta)
    pairs = fresnel.dielectric_amplitudes(cosine, cos_t, eta), fresnel.total_amplitudes(cosine, eta)
    s, p = (np.where(cos_t > 0, a[0] + 1j * a[1], b[0] + 1j * b[1]) for a, b in zip(*pairs))
    return s, p


@pytest.mark.parametrize("name", INDICES)
def test_amplitudes_are_those_of_tmm(name: str) -> None:
    index = INDICES[name]
    cosine = np.linspace(0.01, 1, 200)
    angle = np.arccos(cosine)
    # `tmm` chooses between an angle and its opposite, and so takes scalars
    within = [tmm.snell(1, index, a) for a in angle]
    for found, kind in zip(amplitudes(cosine, index), "sp"):
        expected = [tmm.interface_r(kind, 1, index, a, t) for a, t in zip(angle, within)]
        np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("kappa", [0.0, 1.4])
def test_amplitudes_have_the_unpolarised_reflectance(kappa: float) -> None:
    cosine = np.linspace(0, 1, 50)
    s, p = fresnel.conductor_amplitudes(cosine, 0.9, kappa)
    found = polarisation.mueller(s, p)
    np.testing.assert_allclose(0.5 * (found.s + found.p), fresnel.conductor(cosine, 0.9, kappa), atol=1e-12)


@dataclass
class Field:
    """Two fields (3, n), of light along w that was polarised along x and y: together they are unpolarised light."""

    w: Array
    e: tuple[Array, Array]

    def meet(self, h: Array, s: Array, p: Array, onwards: Array) -> Field:
        """Beyond a facet of normal h, with these amplitudes."""
        across = unit(np.cross(self.w, h, axis=0))
        before, after = np.cross(self.w, across, axis=0), np.cross(onwards, across, axis=0)
        return Field(onwards, tuple(s * dot(e, across) * across + p * dot(e, before) * after for e in self.e))

    def stokes(self, x: Array) -> Array:
        """I, Q, U and V, (4, n), in the frame of x."""
        y = np.cross(self.w, x, axis=0)
        return 0.5 * np.sum([_stokes(dot(e, x), dot(e, y)) for e in self.e], axis=0)


def _stokes(x: Array, y: Array) -> Array:
    cross = 2 * x * np.conj(y)
    return np.array([abs(x) ** 2 + abs(y) ** 2, abs(x) ** 2 - abs(y) ** 2, cross.real, cross.imag])


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v, axis=0)


def dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=0)


def facing(w: Array, rng: np.random.Generator) -> Array:
    """Random normals that light along w meets."""
    h = unit(rng.normal(size=w.shape))
    return -h * np.sign(dot(w, h))


def turn(v: Any, angle: float) -> Any:
    return ggx.rotate(tuple(v), angle)


MAPS: dict[str, tuple[Callable[[Array], Array], Callable[[Polarisation], Polarisation]]] = {
    "as it is": (lambda v: v, lambda light: light),
    "in a mirror": (lambda v: v * [[1], [1], [-1]], lambda light: light.mirrored(np.array(True))),
    "turned": (lambda v: np.array(turn(v, 0.7)), lambda light: light.seen_by(lambda x: turn(x, 0.7))),
    "turned around": (lambda v: -v, lambda light: light.inverted),
}


@pytest.mark.parametrize("name", MAPS)
def test_light_from_facet_to_facet_has_the_parameters_of_its_fields(name: str) -> None:
    """Metal, then total reflection, refraction and metal, each seen in other coordinates."""
    rng, count = np.random.default_rng(1), 500
    seen, turned = MAPS[name]
    w = unit(rng.normal(size=(3, count)))
    light = polarisation.unpolarised(tuple(w), np.ones(count))
    x = np.array(light.x)
    field, intensity = Field(w, (x, np.cross(w, x, axis=0))), np.ones(count)
    for index in (0.2 + 3.9j, 0.5, 1.5, 0.9 + 1.4j):
        h = facing(field.w, rng)
        cosine = -dot(field.w, h)
        s, p = amplitudes(cosine, index)
        onwards = field.w + 2 * cosine * h
        matrix = polarisation.mueller((s.real, s.imag), (p.real, p.imag))
        if index == 1.5:
            onwards = np.array(refraction.refract(tuple(-field.w), tuple(h), index))
            matrix = polarisation.complement(matrix)
            s, p = np.sqrt(1 - s**2), np.sqrt(1 - p**2)
        # The same event in other coordinates, and back
        there = turned(light).at(tuple(seen(field.w)), tuple(seen(h)))
        intensity = intensity * there.share(matrix)
        there = there.sent(matrix)
        back = {"turned": lambda light: light.seen_by(lambda x: turn(x, -0.7))}.get(name, turned)
        light = back(there)
        field = field.meet(h, s, p, onwards)
    x = np.array(polarisation.horizontal(tuple(field.w)))
    light = light.along(tuple(field.w), tuple(x))
    found = intensity * np.array([np.ones(count), light.q, light.u, light.v])
    np.testing.assert_allclose(found, field.stokes(x), atol=1e-7)
    assert np.abs(found[3]).max() > 0.05


def test_a_facet_that_is_met_at_the_normal_has_no_plane() -> None:
    matrix = Mueller(0.3, 0.3, -0.3, 0.0)
    light = Polarisation((1.0, 0.0, 0.0), 0.3, 0.4, 0.5).at((0.0, 0.0, -1.0), (0.0, 0.0, 1.0))
    after = light.sent(matrix)
    assert (light.q, light.u, light.v) == (0.3, 0.4, 0.5)
    # Right is left after reflection, and so is the side to which a field leans
    np.testing.assert_allclose((after.q, after.u, after.v), (0.3, -0.4, -0.5))


# Walks through smooth stacks

COAT = Interface(eta=1.5)
METAL = Interface(eta=0.2, k=3.9)


def near(found: Array, expected: Array | float, error: Array) -> None:
    assert np.all(np.abs(found - expected) < SIGMAS * error + ROUNDING), f"{found} should be {expected} within {error}"


def summed(lobes: list[Array], errors: list[Array]) -> tuple[Array, Array]:
    return np.sum(lobes, axis=0), np.sqrt(np.sum(np.square(errors), axis=0))


def polarisations(total: Array) -> tuple[Array, Array]:
    """Energies (N,) of light that came as s and as p, each over its own, of one colour, of a smooth isotropic stack."""
    return total[0, 0] + total[1, 0], total[0, 0] - total[1, 0]


def exact(indices: list[complex], depths: list[float], cosine: float, kind: str) -> tuple[float, float]:
    """Reflectance and transmittance of a smooth stack, by `tmm`, incoherent."""
    thickness = 1e6
    absorbing = [n + 1j * tau * WAVELENGTH / (4 * np.pi * thickness) for n, tau in zip(indices, [0, *depths, 0])]
    lengths = [np.inf, *[thickness] * (len(indices) - 2), np.inf]
    found = tmm.inc_tmm(kind, absorbing, lengths, ["i"] * len(indices), np.arccos(cosine), WAVELENGTH)
    return found["R"], found["T"]


@pytest.mark.parametrize("surface", [COAT, Interface(eta=1.5, k=1.2)])
def test_one_interface_polarises_as_fresnel_says(surface: Interface) -> None:
    """Every path carries the same, so that the ratio has no noise; at Brewster's angle all light is s."""
    cosine = np.array([1.0, 0.8, 1 / np.sqrt(1 + 1.5**2), 0.3])
    found = stokes(Stack([surface]), cosine, phi=[0.0, 1.0, 2.0, -0.5], paths=20_000)
    s, p = (np.abs(r) ** 2 for r in amplitudes(cosine, 1.5 + 1j * (surface.k or 0)))
    reflected = found.reflected[0]
    np.testing.assert_allclose(reflected[1, 0] / reflected[0, 0], (s - p) / (s + p), atol=1e-4)
    np.testing.assert_allclose(reflected[2:], 0, atol=1e-6)
    assert found.standard_error is not None
    near(reflected[0, 0], 0.5 * (s + p), found.standard_error.reflected[0][0, 0])
    if found.transmitted is not None:
        passed = found.transmitted
        np.testing.assert_allclose(passed[1, 0] / passed[0, 0], (p - s) / (2 - s - p), atol=1e-4)


#: Indices from above, optical depths, cosine, and by what part the unpolarised walk is off, to .003
COSTS = [
    ([1, 1.5, 0.2 + 3.9j], [0.0], (1.0, 0.5, 0.2), (0.0, 0.0, 0.0)),
    ([1, 1.5, 0.2 + 3.9j], [0.3], (1.0, 0.5, 0.2), (0.0, -0.001, -0.007)),
    ([1, 1.33, 1.8, 1.4, 2 + 3j], [0.0, 0.0, 0.0], (1.0, 0.5, 0.2), (0.0, 0.015, 0.024)),
    ([1, 2.0, 1 + 1j], [0.0], (1.0, 0.5, 0.2), (0.0, 0.035, 0.026)),
    ([1, 1.5, 1], [0.0], (1.0, 0.5, 0.2), (0.0, 0.078, 0.040)),
]


def stack_of(indices: list[complex], depths: list[float]) -> Stack:
    layers: list[Layer] = []
    for n, tau in zip(indices[1:], [*depths, 0.0]):
        metal = np.imag(n) != 0
        layers.append(Interface(eta=float(np.real(n)), k=float(np.imag(n)) if metal else None))
        if tau:
            layers.append(Medium(depth=tau, sigma_a=1.0))
    return Stack(layers)


@pytest.mark.parametrize(("indices", "depths", "cosines", "costs"), COSTS)
def test_what_leaving_out_polarisation_costs(
    indices: list[complex], depths: list[float], cosines: tuple[float, ...], costs: tuple[float, ...]
) -> None:
    stack = stack_of(indices, depths)
    both = np.array([[exact(indices, depths, c, kind)[0] for c in cosines] for kind in "sp"])
    # With polarisation: both kinds of light, apart and together
    found = stokes(stack, cosines, paths=200_000)
    assert found.standard_error is not None
    total, error = summed(found.reflected, found.standard_error.reflected)
    near(total[0, 0], both.mean(axis=0), error[0, 0])
    for energy, expected in zip(polarisations(total), both):
        near(energy, expected, error[0, 0] + error[1, 0])
    # Without
    plain = statistics(stack, cosines, paths=200_000)
    assert plain.standard_error is not None
    energy, noise = summed(plain.energy, plain.standard_error.energy)
    off = energy[0] / both.mean(axis=0) - 1
    assert np.all(np.abs(off - costs) < SIGMAS * noise[0] / energy[0] + 0.003), off


def test_random_smooth_stacks_are_those_of_tmm() -> None:
    """Both kinds of light, reflected and transmitted, total reflection inside included."""
    rng = np.random.default_rng(7)
    for _ in range(10):
        count = int(rng.integers(1, 4))
        indices = [1.0, *rng.uniform(1.1, 2.2, count)]
        opaque = rng.uniform() < 0.4
        indices[-1] = complex(rng.uniform(0.2, 2), rng.uniform(0.5, 4)) if opaque else indices[-1]
        depths = list(rng.choice([0.0, 0.4], count - 1))
        cosine = float(rng.uniform(0.1, 0.9))
        found = stokes(stack_of(indices, depths), cosine, phi=rng.uniform(0, 6), paths=100_000)
        error = found.standard_error
        assert error is not None
        total, noise = summed(found.reflected, error.reflected)
        for which, kind in enumerate("sp"):
            reflected, transmitted = exact(indices, depths, cosine, kind)
            near(polarisations(total)[which], reflected, noise[0, 0] + noise[1, 0])
            if not opaque:
                assert found.transmitted is not None and error.transmitted is not None
                passed = error.transmitted
                near(polarisations(found.transmitted)[which], transmitted, passed[0, 0] + passed[1, 0])


def test_media_and_diffuse_bases_depolarise() -> None:
    """What leaves a diffuse base under an interface is p, as it was refracted out; a base alone leaves no trace."""
    found = stokes(Stack([Diffuse(albedo=0.5)]), 0.4, paths=1000)
    np.testing.assert_array_equal(found.reflected[0][1:], 0)
    found = stokes(Stack([Medium(depth=1.0, sigma_s=1.0, g=0.5), Diffuse(albedo=0.5)]), 0.4, paths=1000)
    np.testing.assert_array_equal(found.reflected[0][1:], 0)
    found = stokes(Stack([COAT, Diffuse(albedo=0.5)]), 0.4, paths=200_000)
    assert found.standard_error is not None
    base, error = found.reflected[1][:, 0, 0], found.standard_error.reflected[1][:, 0, 0]
    assert base[1] < -0.02 * base[0]
    near(base[2:], 0.0, error[2:])
    # All that is unpolarised has the energies of the unpolarised walk
    plain = statistics(Stack([COAT, Diffuse(albedo=0.5)]), 0.4, paths=200_000)
    assert plain.standard_error is not None
    np.testing.assert_allclose(base[0], plain.energy[1][0], atol=SIGMAS * 1.5 * plain.standard_error.energy[1][0, 0])


def test_statistics_and_distributions_are_of_the_same_paths() -> None:
    stack = Stack([COAT, Medium(depth=0.3, sigma_a=(0.1, 0.5, 2.0)), Interface(eta=1.0, k=1.0, alpha=0.2)])
    found = stokes(stack, [0.9, 0.4], 0.5, paths=20_000, seed=3)
    lobes = statistics(stack, [0.9, 0.4], 0.5, paths=20_000, seed=3, polarised=True)
    grids = distribution(stack, [0.9, 0.4], 0.5, paths=20_000, seed=3, polarised=True).reflected
    np.testing.assert_allclose(lobes.energy, [lobe[0] for lobe in found.reflected], rtol=1e-6)
    np.testing.assert_allclose(grids.sum(axis=(2, 3)), np.sum(lobes.energy, axis=0), rtol=1e-6)
    assert found.transmitted is None


# Walks through rough stacks, against fields

Surfaces = list[tuple[complex, float, float, float]]  # the index below, two roughnesses and a turn


@dataclass
class Lights:
    """Light along w (3, n) in a slab, each with one field e (3, n) of length 1 and a weight."""

    w: Array
    e: Array
    weight: Array
    slab: Array

    def only(self, where: Array) -> Lights:
        return Lights(*(part[..., where] for part in vars(self).values()))

    def stokes(self) -> Array:
        x = np.array(polarisation.horizontal(tuple(self.w)))
        return self.weight * _stokes(dot(self.e, x), dot(self.e, np.cross(self.w, x, axis=0)))


def joined(parts: list[Lights]) -> Lights:
    return Lights(*(np.concatenate(column, axis=-1) for column in zip(*(vars(part).values() for part in parts))))


def unpolarised(rng: np.random.Generator, wi: Array, count: int) -> Lights:
    """Fields in any direction across -wi."""
    w = np.repeat(-wi[:, None], count, axis=1)
    first = unit(np.cross(w, [[0.3], [0.4], [0.5]], axis=0))
    angle = rng.uniform(0, 2 * np.pi, count)
    e = np.cos(angle) * first + np.sin(angle) * np.cross(w, first, axis=0)
    return Lights(w, e.astype(complex), np.ones(count), np.zeros(count, int))


def met(rng: np.random.Generator, light: Lights, h: Array, n_in: complex, n_out: complex) -> tuple[Lights, Array]:
    """Light reflected or refracted by facets of normals h, and where it is reflected."""
    cosine, index = -dot(light.w, h), n_out / n_in
    before = Field(light.w, (light.e, light.e))
    s, p = amplitudes(cosine, index)
    after = before.meet(h, s, p, light.w + 2 * cosine * h)
    w, e = after.w, after.e[0]
    share = np.sum(np.abs(e) ** 2, axis=0)
    reflected = np.ones(len(share), bool)
    if not np.imag(index):
        reflected = rng.uniform(size=len(share)) < share
        t_s, t_p = (np.sqrt(np.maximum(1 - np.abs(r) ** 2, 0)) for r in (s, p))
        onwards = np.array(refraction.refract(tuple(-light.w), tuple(h), float(np.real(index))))
        w, e = np.where(reflected, w, onwards), np.where(reflected, e, before.meet(h, t_s, t_p, onwards).e[0])
        share = np.ones_like(share)
    e = e / np.maximum(np.linalg.norm(e, axis=0), 1e-12)
    return Lights(w, e, light.weight * share, light.slab), reflected


def walked(surfaces: Surfaces, wi: Array, count: int) -> Lights:
    """What leaves where light meets one facet of a surface at a time."""
    rng = np.random.default_rng(5)
    light, left = unpolarised(rng, wi, count), []
    indices = [1.0, *(n for n, *_ in surfaces)]
    while light.w.shape[1]:
        parts = []
        for k in np.unique(light.slab):
            for down in (False, True):
                here = light.only((light.slab == k) & ((light.w[2] < 0) == down))
                beyond = k + 1 if down else k - 1
                _, *alpha, rotation = surfaces[k if down else k - 1]
                # Meet a normal that is seen, with the surface upside down for light from below
                up = np.array([[1], [1], [1 if down else -1]])
                seen = ggx.sample_visible(turn(-here.w * up, rotation), *alpha, *rng.uniform(size=here.w[:2].shape))
                h = np.array(turn(seen, -rotation)) * up
                after, reflected = met(rng, here, h, indices[k], indices[beyond])
                # Light that goes where it cannot has met a second facet, and is lost
                onwards = ((after.w[2] > 0) == down) == reflected
                out = turn((*after.w[:2], np.abs(after.w[2])), rotation)
                after.weight = after.weight * np.where(onwards, ggx.masking(out, *alpha), 0)
                after.slab = np.where(reflected, k, beyond)
                parts.append(after)
        light = joined(parts)
        # End faint paths by chance
        survival = np.minimum(4 * light.weight, 1)
        light.weight = np.maximum(light.weight, 0.25)
        light = light.only(rng.uniform(size=len(survival)) < survival)
        leaves = np.where(light.w[2] > 0, light.slab == 0, light.slab == len(surfaces))
        left.append(light.only(leaves))
        light = light.only(~leaves)
    return joined(left)


def flown(surfaces: Surfaces, wi: Array, count: int) -> Lights:
    """What leaves one surface whose facets scatter light to each other; `slab` is 1 for light below it."""
    rng = np.random.default_rng(6)
    ((n, alpha_u, alpha_v, rotation),) = surfaces
    alpha = alpha_u, alpha_v
    light, rank, left = unpolarised(rng, np.array(turn(wi, rotation)), count), np.ones(count), []
    while light.w.shape[1]:
        flip = 1 - 2 * light.slab
        rank = microsurface.fly(tuple(light.w * flip), rank, *alpha, rng.uniform(size=len(rank)))
        leaves = rank > 1
        left.append(light.only(leaves))
        light, rank, flip = light.only(~leaves), rank[~leaves], flip[~leaves]
        h = np.array(ggx.sample_visible(tuple(-light.w * flip), *alpha, *rng.uniform(size=light.w[:2].shape))) * flip
        parts, ranks = [], []
        for below in (0, 1):
            here = light.slab == below
            after, reflected = met(rng, light.only(here), h[:, here], *((n, 1.0) if below else (1.0, n)))
            after.slab = np.where(reflected, below, 1 - below)
            parts.append(after)
            ranks.append(np.where(reflected, rank[here], 1 - rank[here]))
        light, rank = joined(parts), np.concatenate(ranks)
    out = joined(left)
    return Lights(np.array(turn(out.w, -rotation)), np.array(turn(out.e, -rotation)), out.weight, out.slab)


ROUGH: dict[str, tuple[Surfaces, bool]] = {
    "metal": ([(1 + 1j, 0.2, 0.6, 0.5)], False),
    "coated metal": ([(1.8, 0.3, 0.3, 0.0), (1 + 1j, 0.1, 0.5, 0.7)], False),
    "pane": ([(1.6, 0.15, 0.5, 0.4), (1.2, 0.3, 0.3, 0.0)], False),
    "metal, between facets": ([(1 + 1j, 0.5, 0.9, 0.5)], True),
    "glass, between facets": ([(1.9, 0.5, 0.9, 0.5)], True),
}


@pytest.mark.parametrize("name", ROUGH)
def test_rough_stacks_are_those_of_fields(name: str) -> None:
    """All four parameters, in each quarter of the upper and the lower hemisphere."""
    surfaces, often = ROUGH[name]
    cosine, phi, paths = 0.35, 0.3, 150_000
    wi = np.array([np.sqrt(1 - cosine**2) * np.cos(phi), np.sqrt(1 - cosine**2) * np.sin(phi), cosine])
    layers = [
        Interface(
            eta=float(np.real(n)),
            k=float(np.imag(n)) if np.imag(n) else None,
            alpha=(u, v),
            rotation=float(np.degrees(turned)),
        )
        for n, u, v, turned in surfaces
    ]
    found = ends(Stack(layers), wi, paths, 2, often, polarised=True)
    assert found.stokes is not None
    fields = (flown if often else walked)(surfaces, wi, paths)
    accounts = [(found.w, np.concatenate([found.weight[None], found.stokes])[:, 0]), (fields.w, fields.stokes())]
    skewed = 0.0
    for places in np.ndindex(2, 2, 2):
        means, errors = [], []
        for w, parameters in accounts:
            here = parameters[:, np.all((w > 0) == np.array(places, bool)[:, None], axis=0)]
            means.append(here.sum(axis=1) / paths)
            errors.append(np.sqrt(np.sum(here**2, axis=1)) / paths)
        near(means[0], means[1], np.hypot(*errors))
        skewed = max(skewed, abs(means[1][2]) / errors[1][2] if here.size else 0.0)
    assert skewed > 10  # U is seen
