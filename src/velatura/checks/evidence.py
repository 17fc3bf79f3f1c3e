"""Evidence for the laws: values of a BSDF at a few directions of incidence, gathered once for all laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from velatura.checks.grid import HemisphereGrid, integrate
from velatura.checks.probe import Array, Probe, ProbeSamples, Values, Wrong

COSINES = (0.98, 0.8, 0.55, 0.3, 0.1)  # of incidence
SAMPLES = 2**16  # at each of them
PILOT = SAMPLES // 4  # samples that only shape the grid
PAIRS = 2**14
TURNED = (1.0, 1.0, 0.999, 0.8, 0.3)  # cosines of incidence, where layers are turned
TURN = 30.0  # degrees, of directions, where the BSDF is isotropic
EXTREMES = (1.0, 0.999, 0.1, 1e-2, 1e-4, 1e-6)  # cosines where formulas break
SNAPPED = 1e-12  # component that is 0, so that the mirror direction and the way back are exact

Progress = Callable[[int, int], None]
STEPS = 4


@dataclass(frozen=True)
class DrawnSamples:
    """Samples at D directions of incidence, N at each.

    Args:
        wi: directions of incidence (D, 3).
        samples: all of them, in the order of wi (D N, ...).
        asked, both: `eval` and `pdf`, and `eval_pdf`, at the directions sampled.
        arrived: samples that carry light, or would if the surface were not black (D, N).
        delta: those of them that a smooth component reflected or refracted (D, N).
        energy: weights as energy, since radiance over squared index is conserved (D, N, channels).
    """

    wi: Array
    samples: ProbeSamples
    asked: Values
    both: Values
    arrived: Array
    delta: Array
    energy: Array


@dataclass(frozen=True)
class Integrals:
    """Integrals over the sphere at D directions, with variances.

    Args:
        density, density_variance: of the pdf over every cell (D, cells).
        counts: samples in every cell, without the pilot's (D, cells).
        albedo, albedo_variance: of `eval`, without smooth components (D, channels).
        shape: of the cells, to look at them.
    """

    density: Array
    density_variance: Array
    counts: Array
    albedo: Array
    albedo_variance: Array
    shape: tuple[int, ...]


@dataclass(frozen=True)
class ReciprocalPairs:
    """Pairs of directions, half of them where the BSDF sends light, and f twice each way: noise differs, f does not.

    Args:
        solid_angle: |cos theta_o| over the density with which wo was drawn (n,).
        there, back: f(wi, wo) and f(wo, wi), brought to the same index (2, n, channels).
        expected: f(wi, wo) of the BSDF that this one should equal, where there is one (n, channels).
    """

    solid_angle: Array
    there: Array
    back: Array
    expected: Array | None


@dataclass(frozen=True)
class Extremes:
    """Answers at and beyond the edges: `values` for pairs (wi, wo), `samples` for directions `sampled`."""

    wi: Array
    wo: Array
    values: Values
    sampled: Array
    samples: ProbeSamples


@dataclass(frozen=True)
class TurnedLight:
    """Light (n, channels) from directions wi (n, 3), times solid angle, the same asked `again`, which differs by noise,
    and that of the BSDF whose layers are turned, for directions that are turned with them."""

    wi: Array
    light: Array
    again: Array
    turned: Array


@dataclass(frozen=True)
class Evidence:
    """All evidence of the laws; `asked` counts the values, and `wrong` holds those that are not finite or negative."""

    asked: int
    wrong: tuple[Wrong, ...]
    transmits: bool
    two_sided: bool
    lossless: bool
    drawn: DrawnSamples
    integrals: Integrals
    pairs: ReciprocalPairs
    extremes: Extremes
    expected: DrawnSamples | None
    turned: TurnedLight | None


def gather(
    probe: Probe,
    expected: Probe | None,
    turned: tuple[Probe, float] | None,
    lossless: bool,
    seed: int,
    progress: Progress | None = None,
) -> Evidence:
    """Query a BSDF, and the one that it should equal if there is one, for all evidence of the laws."""
    rng = np.random.default_rng(seed)
    report = progress or (lambda done, total: None)

    # Sample at every direction of incidence
    cosines = [*COSINES, *(-c for c in COSINES)] if probe.two_sided else COSINES
    wi = np.array([_direction(cos, 2.4 * k + 0.4) for k, cos in enumerate(cosines)])
    u = rng.random((len(wi) * SAMPLES, 3), dtype=np.float32)
    drawn = _draw(probe, wi, u)
    report(1, STEPS)

    # Integrate its values
    integrals = _integrate(probe, drawn, rng)
    report(2, STEPS)

    # Exchange directions, and go to the edges
    pairs = _pair(probe, expected, _index(drawn), rng)
    extremes = _extremes(probe, rng)
    report(3, STEPS)

    # Ask the other ones
    if turned is None and probe.isotropic:
        turned = probe, TURN
    by_turning = _turn(probe, *turned, rng) if turned else None
    other = _draw(expected, wi, u) if expected else None
    report(4, STEPS)
    return Evidence(
        probe.asked,
        tuple(probe.wrong),
        probe.transmits,
        probe.two_sided,
        lossless,
        drawn,
        integrals,
        pairs,
        extremes,
        other,
        by_turning,
    )


def _draw(probe: Probe, wi: Array, u: Array) -> DrawnSamples:
    each = np.repeat(wi, SAMPLES, axis=0)
    samples = probe.sample(each, u)
    asked, both = probe.eval_and_pdf(each, samples.wo), probe.eval_pdf(each, samples.wo)
    confirmed = (samples.pdf > 0) & np.isclose(samples.pdf, asked.pdf, rtol=1e-2)
    lit = samples.weight.max(axis=1) > 0
    across = (each[:, 2] * samples.wo[:, 2] < 0) & (not probe.transmits)
    arrived = (lit | (confirmed & ~samples.delta)) & ~across
    energy = samples.weight * np.square(samples.eta)[:, None] * lit[:, None]
    shape = (len(wi), SAMPLES)
    delta = (samples.delta & arrived).reshape(shape)
    return DrawnSamples(wi, samples, asked, both, arrived.reshape(shape), delta, energy.reshape(*shape, -1))


def _index(drawn: DrawnSamples) -> float:
    """Index below over index above, estimated from the samples that pass through."""
    wi = np.repeat(drawn.wi, SAMPLES, axis=0)
    wo, eta = drawn.samples.wo, drawn.samples.eta
    through = drawn.arrived.ravel() & (wi[:, 2] > 0) & (wo[:, 2] < 0)
    return float(np.median(eta[through])) if through.any() else 1.0


def _squared_index(index: float, wi: Array, wo: Array) -> Array:
    """Squared index on the side of wo over that on the side of wi."""
    return np.where(wi[..., 2] * wo[..., 2] > 0, 1.0, np.where(wi[..., 2] > 0, index**2, index**-2))


def _integrate(probe: Probe, drawn: DrawnSamples, rng: np.random.Generator) -> Integrals:
    # Lay the grids where the pilot's samples fall, on every hemisphere that light may reach
    wo, usable = drawn.samples.wo.reshape(*drawn.arrived.shape, 3), drawn.arrived & ~drawn.delta
    density = drawn.samples.pdf.reshape(drawn.arrived.shape)
    sides = [[1, -1] if probe.transmits else [int(np.sign(wi[2]))] for wi in drawn.wi]
    grids = [
        [HemisphereGrid.around(wi, wo[k, :PILOT][seen], density[k, :PILOT][seen], side) for side in sides[k]]
        for k, (wi, seen) in enumerate(zip(drawn.wi, usable[:, :PILOT]))
    ]
    counts = [[grid.count(wo[k, PILOT:][usable[k, PILOT:]]) for grid in grids[k]] for k in range(len(grids))]

    # Ask at all nodes at once
    nodes, areas = map(np.array, zip(*(grid.nodes(rng) for row in grids for grid in row)))
    shape = (len(drawn.wi), len(sides[0]), nodes.shape[1])
    wi = np.broadcast_to(drawn.wi[:, None, None], (*shape, 3)).reshape(-1, 3)
    nodes, areas = nodes.reshape(-1, 3), areas.reshape(-1, 1)
    value, pdf = probe.eval_pdf(wi, nodes)

    # Add up over cells, and over the sphere
    energy = value * _squared_index(_index(drawn), wi, nodes)[:, None] * areas
    answers = np.concatenate([pdf[:, None] * areas, energy], axis=1).reshape(*shape, -1)
    sums, variances = (
        np.array(part) for part in zip(*(zip(*(integrate(side) for side in direction)) for direction in answers))
    )
    cells = sums[..., 0].reshape(len(drawn.wi), -1)
    return Integrals(
        density=cells,
        density_variance=variances[..., 0].reshape(cells.shape),
        counts=np.array(counts).reshape(cells.shape),
        albedo=sums[..., 1:].sum(axis=(1, 2, 3)),
        albedo_variance=variances[..., 1:].sum(axis=(1, 2, 3)),
        shape=sums.shape[1:4],
    )


def _pair(probe: Probe, expected: Probe | None, index: float, rng: np.random.Generator) -> ReciprocalPairs:
    # Draw wi by the light that meets the surface, wo by the BSDF or evenly
    u = rng.random((3, PAIRS))
    wi = _directions(np.sqrt(1 - u[0] * (1 - 1e-4)), u[1])  # cosines from 0.01 on
    wi[:, 2] *= np.where((u[2] < 0.5) & probe.two_sided, -1, 1)
    v = rng.random((3, PAIRS))
    even = _directions(v[0], v[1])
    even[:, 2] *= np.sign(wi[:, 2]) * np.where((v[2] < 0.5) & probe.transmits, -1, 1)
    samples = probe.sample(wi, rng.random((PAIRS, 3), dtype=np.float32))
    sampled = (rng.random(PAIRS) < 0.5) & (samples.weight.max(axis=1) > 0) & (np.abs(samples.wo[:, 2]) > 1e-2)
    wo = np.where(sampled[:, None], samples.wo, even)

    # Ask each way, twice
    first, again = (probe.eval_pdf(wi, wo, offset) for offset in (0.0, 0.125))
    there = np.stack([first.value, again.value]) / np.abs(wo[:, 2:])
    there *= _squared_index(index, wi, wo)[:, None]
    back = np.stack([probe.eval_pdf(wo, wi, offset).value for offset in (0.25, 0.375)]) / np.abs(wi[:, 2:])
    density = 0.5 * first.pdf + 0.5 / (4 * np.pi if probe.transmits else 2 * np.pi)

    # Ask the other one
    theirs = None
    if expected:
        theirs = expected.eval_pdf(wi, wo).value / np.abs(wo[:, 2:]) * _squared_index(index, wi, wo)[:, None]
    return ReciprocalPairs(np.abs(wo[:, 2]) / density, there, back, theirs)


def _extremes(probe: Probe, rng: np.random.Generator) -> Extremes:
    heights = np.array([*EXTREMES, *(-c for c in EXTREMES)])
    azimuths = np.array([0.0, 0.3, 0.5, 0.8])  # turns; half a turn has the mirror direction, and none the way back
    wi, wo = (
        directions.reshape(-1, 3)
        for directions in np.broadcast_arrays(
            _directions(heights, np.zeros(len(heights)))[:, None, None],
            _directions(*np.meshgrid(heights, azimuths, indexing="ij"))[None],
        )
    )
    wo = np.where(np.abs(wo) < SNAPPED, 0, wo)
    sampled = np.repeat(_directions(heights, np.zeros(len(heights))), 64, axis=0)
    samples = probe.sample(sampled, rng.random((len(sampled), 3), dtype=np.float32))
    return Extremes(wi, wo, probe.eval_pdf(wi, wo), sampled, samples)


def _turn(probe: Probe, other: Probe, degrees: float, rng: np.random.Generator) -> TurnedLight:
    each = PAIRS // len(TURNED)
    wi = np.repeat([_direction(cos, 2.4 * k) for k, cos in enumerate(TURNED)], each, axis=0)
    samples = probe.sample(wi, rng.random((len(wi), 3), dtype=np.float32))
    # Half go evenly, for what the samples miss
    evenly = _directions(rng.random(len(wi)), rng.random(len(wi)))
    wo = np.where((rng.random(len(wi)) < 0.5)[:, None], samples.wo, evenly)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    here, again, there = (
        probe.eval_pdf(wi, wo),
        probe.eval_pdf(wi, wo, 0.125),
        other.eval_pdf(wi @ matrix.T, wo @ matrix.T),
    )
    density = (0.5 * here.pdf + 0.25 / np.pi)[:, None] * each
    return TurnedLight(wi, here.value / density, again.value / density, there.value / density)


def _direction(cos_theta: float, phi: float) -> Array:
    return _directions(np.array(cos_theta), np.array(phi / (2 * np.pi)))


def _directions(cos_theta: Array, turns: Array) -> Array:
    sin_theta, phi = np.sqrt(1 - cos_theta**2), 2 * np.pi * turns
    return np.stack(np.broadcast_arrays(sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta), axis=-1)
