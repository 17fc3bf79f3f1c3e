"""The laws that every BSDF must keep, and their tests.

A law looks at the evidence and may be wrong by chance with the probability `alarm` at most, shared out among its tests
(Sidak). What only rounding decides has a bound of its own, below.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter
from scipy.special import chdtrc, chdtri, ndtri

from velatura.checks.evidence import PILOT, SAMPLES, DrawnSamples, Evidence
from velatura.checks.probe import Array
from velatura.checks.report import Finding

GAIN = 2e-3  # of energy, which tables and single precision may err by
OFF = 1e-2  # two numbers that should be equal are not where they differ by this share
FEW = 2e-3  # samples that may be off, where single precision is at its end
DARK = 1e-8  # light between two directions that rounding makes
ONE_WAY = 1e-2  # relative error of reciprocity, weighted by the light
CHANGE = 5e-3  # of energy, between a BSDF and the one that it should equal
BLURRED = 2e-3  # relative standard error of the integral of a pdf that the cells do not resolve
HEAVY = 3.0  # weight of a sample
SHIFT = 2e-2  # of the light, where layers are turned
CROWD = 10.0  # samples expected in a cell of a chi-square test, else it is pooled with others


@dataclass(frozen=True)
class Law:
    """A law: its name, its statement in one sentence, and the judgement of evidence (None: nothing to judge)."""

    name: str
    says: str
    judge: Callable[[Evidence, float], Finding | None]


# Numbers


def finite(evidence: Evidence, alarm: float) -> Finding:
    """Count values that are NaN, infinite or negative."""
    wrong = sorted(evidence.wrong, key=lambda answers: len(answers.answer), reverse=True)
    count = sum(len(answers.answer) for answers in wrong)
    detail = f"{evidence.asked} answers, grazing and below the surface too"
    if wrong:
        example = wrong[0]
        detail += f"; most of {example.function}, as {example.answer[0]:g} {_at(example.wi[0])}"
    everywhere = {"cosine of incidence": [a.wi[:, 2] for a in wrong], "cosine of exitance": [a.wo[:, 2] for a in wrong]}
    data = {name: np.concatenate([*cosines, []]) for name, cosines in everywhere.items()}
    return Finding("finite", count == 0, count, 0, detail, data)


def sides(evidence: Evidence, alarm: float) -> Finding:
    """Find the largest value where there may be no light."""
    extremes = evidence.extremes

    def dark(wi: Array, wo: Array) -> Array:
        through, unlit = wi[:, 2] * wo[:, 2] < 0, wi[:, 2] < 0
        return np.asarray((through & (not evidence.transmits)) | (unlit & (not evidence.two_sided)))

    forbidden = dark(extremes.wi, extremes.wo)
    seen = np.maximum(extremes.values.value.max(axis=1), extremes.values.pdf) * forbidden
    sampled = extremes.samples.weight.max(axis=1) * dark(extremes.sampled, extremes.samples.wo)
    value = float(max(seen.max(), sampled.max()))
    lit = "both sides" if evidence.two_sided else "above"
    detail = f"lit from {lit}, {'transmits' if evidence.transmits else 'opaque'}; {forbidden.sum()} pairs must be dark"
    data = {"cosine of incidence": extremes.wi[:, 2], "eval or pdf": seen}
    return Finding("sides", value <= 0, value, 0, detail, data)


# Energy


def energy(evidence: Evidence, alarm: float) -> Finding:
    """Compare the mean weight of samples with 1."""
    albedo, error = _mean(evidence.drawn.energy)
    bound = 1 + GAIN + _sigmas(alarm, albedo.size) * error
    at = _worst(albedo - bound)
    detail = f"albedo {_range(albedo)} by sampling, standard error {error.max():.1g}; highest {_where(evidence, at)}"
    data = {"cosine of incidence": evidence.drawn.wi[:, 2], "albedo": albedo.max(axis=1), "bound": bound.max(axis=1)}
    return Finding("energy", _within(albedo, bound), float(albedo[at]), float(bound[at]), detail, data)


def white_furnace(evidence: Evidence, alarm: float) -> Finding:
    """Integrate `eval` under light from everywhere, and add what smooth components reflect."""
    albedo, sigma = _in_furnace(evidence)
    bound = 1 + GAIN + _sigmas(alarm, albedo.size) * sigma
    at = _worst(albedo - bound)
    sampled = _range(_mean(evidence.drawn.energy)[0])
    detail = f"albedo {_range(albedo)} by quadrature, {sampled} by sampling; highest {_where(evidence, at)}"
    return Finding(
        "white furnace", _within(albedo, bound), float(albedo[at]), float(bound[at]), detail, _furnace_data(evidence)
    )


def lossless(evidence: Evidence, alarm: float) -> Finding | None:
    """Look for loss in the furnace, where nothing absorbs."""
    if not evidence.lossless:
        return None
    albedo, sigma = _in_furnace(evidence)
    bound = GAIN + _sigmas(alarm, albedo.size) * sigma
    at = _worst(1 - albedo - bound)
    detail = f"albedo {_range(albedo)} by quadrature; most is lost {_where(evidence, at)}"
    passed = _within(1 - albedo, bound)
    return Finding("lossless", passed, float(1 - albedo[at]), float(bound[at]), detail, _furnace_data(evidence))


def _in_furnace(evidence: Evidence) -> tuple[Array, Array]:
    """Directional albedo (D, channels) by quadrature, and its standard error."""
    smooth, error = _mean(evidence.drawn.energy * evidence.drawn.delta[..., None])
    integrals = evidence.integrals
    return integrals.albedo + smooth, np.sqrt(integrals.albedo_variance + error**2)


def _furnace_data(evidence: Evidence) -> dict[str, Array]:
    albedo = _in_furnace(evidence)[0]
    return {"cosine of incidence": evidence.drawn.wi[:, 2], "lowest": albedo.min(axis=1), "highest": albedo.max(axis=1)}


def albedo(evidence: Evidence, alarm: float) -> Finding:
    """Compare the mean weight of samples with the integral of `eval`."""
    drawn, integrals = evidence.drawn, evidence.integrals
    sampled, error = _mean(drawn.energy * ~drawn.delta[..., None])
    difference = np.abs(sampled - integrals.albedo)
    sigma = np.sqrt(error**2 + integrals.albedo_variance)
    bound = GAIN + _sigmas(alarm / 2, difference.size) * sigma
    at = _worst(difference - bound)
    detail = f"{sampled[at]:.4f} by sampling, {integrals.albedo[at]:.4f} by quadrature {_where(evidence, at)}"
    data = {
        "cosine of incidence": drawn.wi[:, 2],
        "by sampling": sampled.max(axis=1),
        "by quadrature": integrals.albedo.max(axis=1),
    }
    return Finding("albedo", _within(difference, bound), float(difference[at]), float(bound[at]), detail, data)


# Densities


def normalisation(evidence: Evidence, alarm: float) -> Finding:
    """Compare the integral of the pdf with the share of samples that it describes."""
    drawn, integrals = evidence.drawn, evidence.integrals
    share, error = _mean(drawn.arrived & ~drawn.delta)
    integral, variance = integrals.density.sum(axis=1), integrals.density_variance.sum(axis=1)
    difference = np.abs(integral - share)
    bound = GAIN + _sigmas(alarm / 2, len(share)) * np.sqrt(error**2 + variance)
    at = _worst(difference - bound)
    detail = (
        f"integral {_range(integral)}, samples drawn {_range(share)}; "
        f"{integral[at]:.4f} for {share[at]:.4f} {_where(evidence, at)}"
    )
    data = {"cosine of incidence": drawn.wi[:, 2], "integral": integral, "samples": share}
    return Finding("normalisation", _within(difference, bound), float(difference[at]), float(bound[at]), detail, data)


def chi_square(evidence: Evidence, alarm: float) -> Finding:
    """Compare samples in every cell with those that the pdf lets expect, where the cells resolve the pdf."""
    integrals, n = evidence.integrals, SAMPLES - PILOT
    sides = (len(integrals.counts), integrals.shape[0], -1)
    # An edge that nodes miss in one cell shows in the next one
    grids = integrals.density_variance.reshape(len(integrals.counts), *integrals.shape)
    about = maximum_filter(grids, size=(1, 1, 3, 3), mode="nearest")
    seen = [x.reshape(sides) for x in (integrals.counts, n * integrals.density, n * n * about)]
    # Leave out a side on which the cells do not resolve the pdf, however small its share
    counts, expected, _ = (x.sum(axis=2) for x in seen)
    variance = n * n * integrals.density_variance.reshape(sides).sum(axis=2)
    blurred = np.sqrt(variance) > BLURRED * np.maximum(counts, expected)
    counts, expected, variance = (np.where(blurred[..., None], 0.0, x).reshape(len(x), -1) for x in seen)
    statistics, freedoms = np.array([_chi_square(*row) for row in zip(counts, expected, variance)]).T
    smallest = _share(alarm, len(statistics))
    critical = chdtri(freedoms, smallest)
    at = _worst(statistics / freedoms - critical / freedoms)[0]
    p_value = chdtrc(freedoms[at], statistics[at])
    detail = f"{freedoms[at]:.0f} cells, p-value {p_value:.2g}, at least {smallest:.1g} {_where(evidence, (at,))}"
    if blurred.any():
        detail += f"; too sharp for the cells at {blurred.any(axis=1).sum()} of {len(blurred)} directions"
    pull = (counts[at] - expected[at]) / np.sqrt(np.maximum(expected[at] + variance[at], 1))
    pictures = {"samples": counts[at], "expected": expected[at], "difference in standard deviations": pull}
    data = {name: picture.reshape(-1, integrals.shape[-1]) for name, picture in pictures.items()}
    value, bound = (float(x[at] / freedoms[at]) for x in (statistics, critical))
    return Finding("chi-square", _within(statistics, critical), value, bound, detail, data)


def _chi_square(counts: Array, expected: Array, variance: Array) -> tuple[float, int]:
    """Pearson's statistic and its degrees of freedom; `variance` is that of the integrals behind `expected`."""
    order = np.argsort(-expected)
    counts, expected, variance = counts[order], expected[order], variance[order]
    # Pool rare cells: those of the tail, in order, until they hold enough samples
    crowds = np.searchsorted(-expected, -CROWD)
    pool = np.minimum(np.arange(len(expected)), crowds) + (np.cumsum(expected * (expected < CROWD)) // CROWD).astype(
        int
    )
    counts, expected, variance = (np.bincount(pool, weights=x) for x in (counts, expected, variance))
    kept = (expected > 0) | (counts > 0)
    spread = np.maximum(expected + variance, 1e-3)  # one sample where none is expected is strong evidence, not proof
    return float((np.square(counts - expected) / spread)[kept].sum()), max(int(kept.sum()), 1)


def agreement(evidence: Evidence, alarm: float) -> Finding:
    """Count samples for which the functions of the BSDF contradict each other."""
    drawn = evidence.drawn
    asked, both, samples = drawn.asked, drawn.both, drawn.samples
    off = {
        "pdf and sample": _differ(asked.pdf, samples.pdf),
        "pdf and eval_pdf": _differ(asked.pdf, both.pdf),
        "eval and eval_pdf": _any(_differ(asked.value, both.value)),
        "kind of sample and flags": ~samples.declared,
    }
    return _count_off("agreement", drawn, off)


def weights(evidence: Evidence, alarm: float) -> Finding:
    """Count samples whose weight is not eval over pdf."""
    drawn = evidence.drawn
    value = drawn.samples.weight * drawn.samples.pdf[:, None]
    return _count_off("weights", drawn, {"weight times density and eval": _any(_differ(value, drawn.asked.value))})


def spread(evidence: Evidence, alarm: float) -> Finding:
    """Find the largest weight of a sample, as energy."""
    drawn = evidence.drawn
    heaviest = drawn.energy.max(axis=2)
    at = _worst(heaviest)
    usual = np.quantile(heaviest, 0.999)
    detail = f"of {heaviest.size} samples, 999 of 1000 below {usual:.3g}; heaviest {_at(drawn.wi[at[0]])}"
    data = {"cosine of incidence": drawn.wi[:, 2], "largest weight": heaviest.max(axis=1)}
    value = float(heaviest[at])
    return Finding("spread", value <= HEAVY, value, HEAVY, detail, data)


def _count_off(law: str, drawn: DrawnSamples, off: dict[str, Array]) -> Finding:
    looked_at = drawn.arrived & ~(drawn.delta & drawn.samples.declared.reshape(drawn.delta.shape))
    count = looked_at.sum()
    shares = {
        name: float((wrong.reshape(looked_at.shape) & looked_at).sum() / max(count, 1)) for name, wrong in off.items()
    }
    worst = max(shares, key=lambda name: shares[name])
    detail = f"{count} samples; off by more than {OFF:.0%}: " + ", ".join(f"{n} {s:.2g}" for n, s in shares.items())
    by_angle = (off[worst].reshape(looked_at.shape) & looked_at).mean(axis=1)
    data = {"cosine of incidence": drawn.wi[:, 2], f"{worst} differ": by_angle}
    return Finding(law, shares[worst] <= FEW, shares[worst], FEW, detail, data)


# Directions


def reciprocity(evidence: Evidence, alarm: float) -> Finding:
    """Compare f(wi, wo) with f(wo, wi), weighted by the light that is exchanged.

    Two evaluations each way: where `eval` is noisy their noise is independent, so that the mean of the product of two
    differences is the square of the true one.
    """
    pairs = evidence.pairs
    light, back = pairs.there * pairs.solid_angle[:, None], pairs.back * pairs.solid_angle[:, None]
    difference, mean = light - back, (light + back) / 2
    products = difference[0] * difference[1]
    scale = max((mean[0] * mean[1]).sum(), DARK * DARK * mean[0].size)
    value = float(np.sqrt(max(products.sum(), 0) / scale))
    # Say more where there is no noise
    relative = np.abs(difference[0]) / np.maximum(np.maximum(light[0], back[0]), 1e-30)
    carries = mean[0] > 1e-3 * mean[0].mean()
    average = np.abs(difference[0]).sum() / max(mean[0].sum(), 1e-30)
    noisy = not np.array_equal(light[0], light[1], equal_nan=True)
    sigmas = products.sum() / max(np.sqrt(np.square(products).sum()), 1e-30)
    doubtful = noisy and sigmas < _sigmas(alarm, 1)
    detail = f"relative, root mean square {value:.2g}; " + (
        f"noisy, {sigmas:.1f} standard errors"
        if noisy
        else f"mean {average:.2g}, largest {(relative * carries).max():.2g}"
    )
    data = {"f(wi, wo)": light[0].ravel(), "f(wo, wi)": back[0].ravel()}
    return Finding("reciprocity", value <= ONE_WAY or doubtful, value, ONE_WAY, detail, data)


def limit(evidence: Evidence, alarm: float) -> Finding | None:
    """Compare with the BSDF that this one should equal, if there is one: f, and what smooth components send where."""
    ours, theirs, pairs = evidence.drawn, evidence.expected, evidence.pairs
    if theirs is None or pairs.expected is None:
        return None
    change = np.abs(pairs.there[0] - pairs.expected) * pairs.solid_angle[:, None]
    smooth = float(change.mean(axis=0).max())
    moments, errors = zip(*(_mean(_flow(drawn)) for drawn in (ours, theirs)))
    shift = np.abs(moments[0] - moments[1])
    allowed = CHANGE + _sigmas(alarm / 2, shift.size) * np.hypot(*errors)
    value, bound = max((smooth, CHANGE), (float(shift.max()), float(allowed.max())), key=lambda pair: pair[0] - pair[1])
    detail = f"energy that goes elsewhere: {smooth:.2g}; that of smooth components {shift.max():.2g}"
    data = {
        "f expected": (pairs.expected * pairs.solid_angle[:, None]).ravel(),
        "f times solid angle": (pairs.there[0] * pairs.solid_angle[:, None]).ravel(),
    }
    return Finding("limit", smooth <= CHANGE and _within(shift, allowed), value, bound, detail, data)


def turning(evidence: Evidence, alarm: float) -> Finding | None:
    """Compare with the BSDF whose layers are turned, or with an isotropic one itself: light that goes elsewhere."""
    if evidence.turned is None:
        return None
    found = evidence.turned
    cosines, place = np.unique(found.wi[:, 2], return_inverse=True)
    change, noise = (np.abs(found.light - other).mean(axis=1) for other in (found.turned, found.again))
    elsewhere = np.maximum(np.bincount(place, change - noise), 0)
    light = np.bincount(place, found.light.mean(axis=1))
    share = elsewhere / np.maximum(light, DARK)
    at = _worst(share)
    data = {"cosine of incidence": cosines, "share that goes elsewhere": share}
    detail = f"share of light that goes elsewhere, most at cosine {cosines[at]:.3g}"
    return Finding("turning", bool(share[at] <= SHIFT), float(share[at]), SHIFT, detail, data)


def _flow(drawn: DrawnSamples) -> Array:
    """Energy of smooth components, and its flow along x, y, z: (D, N, 4 channels)."""
    energy = drawn.energy * drawn.delta[..., None]
    wo = drawn.samples.wo.reshape(*drawn.arrived.shape, 3)
    return np.concatenate([energy, *(energy * wo[..., [axis]] for axis in range(3))], axis=-1)


LAWS: tuple[Law, ...] = (
    Law("finite", "Every value, density and weight is a number, finite and not negative.", finite),
    Law(
        "sides", "Nothing passes through what does not transmit, and no light comes from a side that is not lit.", sides
    ),
    Law("energy", "No more light leaves than arrives, estimated from the weights of samples.", energy),
    Law("white furnace", "No more light leaves than arrives, by the integral of `eval`.", white_furnace),
    Law("lossless", "No less light leaves than arrives, where nothing absorbs.", lossless),
    Law("albedo", "Samples carry as much light as the integral of `eval`.", albedo),
    Law(
        "normalisation",
        "The pdf integrates to the share of samples that it describes, 1 if none is lost.",
        normalisation,
    ),
    Law("chi-square", "Samples fall where the pdf says.", chi_square),
    Law(
        "agreement",
        "`sample`, `pdf`, `eval` and `eval_pdf` agree about every direction, and `sample` with the flags.",
        agreement,
    ),
    Law("weights", "The weight of a sample is its value over its density.", weights),
    Law("spread", "No sample carries more than three times the light that arrives.", spread),
    Law("reciprocity", "f(wi, wo) is f(wo, wi), with the squared index on either side.", reciprocity),
    Law(
        "turning",
        "Light turns with the layers, at the normal too; with its direction alone where the BSDF is isotropic.",
        turning,
    ),
    Law("limit", "In a limiting case the BSDF equals the one that is expected.", limit),
)


# Statistics


def _share(alarm: float, tests: int) -> float:
    """False alarm probability of one of several tests that together have `alarm` (Sidak)."""
    return float(-np.expm1(np.log1p(-alarm) / tests))


def _sigmas(alarm: float, tests: int) -> float:
    """Bound on the largest of several normal numbers, in standard errors."""
    return float(-ndtri(_share(alarm, tests)))


def _mean(values: Array) -> tuple[Array, Array]:
    """Mean over samples, and its standard error."""
    return values.mean(axis=1), values.std(axis=1) / np.sqrt(values.shape[1])


def _within(values: Array, bounds: Array) -> bool:
    return bool((values <= bounds).all())


def _worst(excess: Array) -> tuple[int, ...]:
    """Index at which a law is closest to being broken, or broken most."""
    return tuple(int(i) for i in np.unravel_index(np.argmax(excess), excess.shape))


def _differ(a: Array, b: Array) -> Array:
    return np.asarray(np.abs(a - b) > OFF * np.maximum(np.abs(a), np.abs(b)) + 1e-6)


def _any(wrong: Array) -> Array:
    return np.asarray(wrong.reshape(len(wrong), -1).any(axis=1))


# Words


def _range(values: Array) -> str:
    return f"{values.min():.4f} to {values.max():.4f}"


def _where(evidence: Evidence, at: tuple[int, ...]) -> str:
    channel = f", channel {at[1]}" if len(at) > 1 else ""
    return f"({_at(evidence.drawn.wi[at[0]])}{channel})"


def _at(wi: Array) -> str:
    return f"at cosine {wi[2]:.3g}"
