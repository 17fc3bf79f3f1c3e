"""Light that passes straight through: reciprocity, densities, integrals, and limits, in NumPy and in Dr.Jit."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

import velatura as vt
from velatura import kernel
from velatura.model.solved.transmission import direct
from velatura.model.solved.transmission.direct import Transmission
from velatura.model.variance import Covariance, Isotropic, variance_kind
from velatura.renderer import compiled
from velatura.stack import Material, number

Array = NDArray[np.floating]
Direction = tuple[Array, Array, Array]

ROUGH = vt.Stack([vt.Interface(eta=1.5, alpha=0.3)])
INSIDE = vt.Stack([vt.Interface(eta=1.0, alpha=0.3)], exterior=1.5)
PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.15), vt.Interface(eta=1.0, alpha=0.3)])
BRUSHED = vt.Stack(
    [
        vt.Interface(eta=(1.4, 1.5, 1.6), alpha=(0.1, 0.4), rotation=20),
        vt.Medium(sigma_a=(0.1, 0.2, 0.4)),
        vt.Interface(eta=1.8, alpha=(0.3, 0.1), rotation=-50),
        vt.Interface(eta=1.3, alpha=0.2),
    ]
)
STACKS = {"rough": ROUGH, "inside": INSIDE, "pane": PANE, "brushed": BRUSHED}


def transmissions(stack: vt.Stack) -> tuple[Transmission, Transmission]:
    """From above and from below."""
    material = Material.of(stack, number)
    kind = variance_kind(material)
    return tuple(direct.transmission(m, kind) for m in (material, material.reversed()))  # type: ignore[return-value]


def random_stack(rng: np.random.Generator, count: int, brushed: bool = True) -> vt.Stack:
    """Dielectrics of random indices, roughnesses and turns, with absorption between; every second one a pane."""
    indices = rng.uniform(1.05, 2.2, count)
    if rng.random() < 0.5:
        indices[-1] = 1
    layers: list[vt.Interface | vt.Medium] = []
    for n in indices:
        alpha, rotation = rng.uniform(0.05, 0.5), rng.uniform(0, 180)
        layers.append(vt.Interface(eta=n, alpha=(alpha, alpha * rng.uniform(0.3, 1) ** brushed), rotation=rotation))
        layers.append(vt.Medium(sigma_a=rng.uniform(0, 0.5)))
    return vt.Stack(layers[:-1])


def directions(rng: np.random.Generator, count: int) -> Direction:
    """Above, evenly over the projected disc."""
    r, phi = 0.98 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
    return r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r * r)


def at(cos_theta: float, phi: float, count: int) -> Direction:
    sine = np.sqrt(1 - cos_theta**2)
    return np.full(count, sine * np.cos(phi)), np.full(count, sine * np.sin(phi)), np.full(count, cos_theta)


def down(w: Direction) -> Direction:
    return w[0], w[1], -w[2]


def test_it_is_reciprocal_to_rounding() -> None:
    """f / n^2 from the other side of the stack turned over; of 1 to 4 interfaces, turned and absorbing. Where a step
    cancels out, rounding grows."""
    rng = np.random.default_rng(3)
    differences = []
    for case in range(60):
        stack = random_stack(rng, 1 + case % 4)
        above, below = transmissions(stack)
        n = float(np.mean(Material.of(stack, number).below))
        wi, wo = directions(rng, 200), directions(rng, 200)
        there = direct.eval_pdf(above, wi, down(wo))[0] / (wo[2] * n * n)
        back = direct.eval_pdf(below, wo, down(wi))[0] / wi[2]
        scale = np.maximum(np.maximum(there, back), 1e-9)
        differences.append(np.abs(there - back) / scale)
    assert np.quantile(differences, 0.999) < 1e-12
    assert np.max(differences) < 1e-9


@pytest.mark.parametrize("cos_theta", [0.9, 0.5])
@pytest.mark.parametrize("name", STACKS)
def test_samples_follow_their_density_on_both_sides(name: str, cos_theta: float) -> None:
    """Chi-square over cells of the sphere, and of what is lost; beyond the critical angle, too (inside, cosine 0.5). A
    false alarm in 10^5 each."""
    above, _ = transmissions(STACKS[name])
    rng, count, rows, columns, fine = np.random.default_rng(1), 100_000, 24, 12, 12
    wo = direct.sample(above, at(cos_theta, 0.4, count), *rng.random((3, count)))
    cell_z = np.clip(((wo[2] + 1) * 0.5 * rows).astype(int), 0, rows - 1)
    cell_phi = (((np.arctan2(wo[1], wo[0]) / (2 * np.pi)) % 1) * columns).astype(int)
    kept = wo[2] != 0
    found = np.bincount((cell_z * columns + cell_phi)[kept], minlength=rows * columns)
    z = (np.arange(rows * fine) + 0.5) * 2 / (rows * fine) - 1
    phi = (np.arange(columns * fine) + 0.5) * 2 * np.pi / (columns * fine)
    z, phi = (x.ravel() for x in np.meshgrid(z, phi, indexing="ij"))
    r = np.sqrt(1 - z * z)
    _, density = direct.eval_pdf(above, at(cos_theta, 0.4, z.size), (r * np.cos(phi), r * np.sin(phi), z))
    expected = density.reshape(rows, fine, columns, fine).mean((1, 3)).ravel() * (4 * np.pi / (rows * columns)) * count
    expected, found = np.append(expected, count - expected.sum()), np.append(found, count - kept.sum())
    few = expected < 20
    expected, found = (np.append(x[~few], x[few].sum()) for x in (expected, found))
    statistic = np.sum((found - expected) ** 2 / np.maximum(expected, 5))
    assert stats.chi2.sf(statistic, len(found) - 1) > 1e-5


@pytest.mark.parametrize("name", STACKS)
def test_the_integral_is_the_mean_of_samples(name: str) -> None:
    """Energy and the share of samples that pass, each within 4 standard errors and 0.003."""
    above, _ = transmissions(STACKS[name])
    rng, count = np.random.default_rng(2), 40_000
    for cos_theta, phi in ((1.0, 0.0), (0.6, 1.0), (0.3, 2.0)):
        wi = at(cos_theta, phi, count)
        wo = direct.sample(above, wi, *rng.random((3, count)))
        value, density = direct.eval_pdf(above, wi, wo)
        weight = np.where(density > 0, value / np.maximum(density, 1e-30), 0.0)
        energy, _, share = direct.integrals(above, at(cos_theta, phi, 1))
        error = 4 * weight.std(1) / np.sqrt(count) + 0.003
        assert np.all(np.abs(energy[:, 0] - weight.mean(1)) < error)
        assert abs(share[0] - np.mean(wo[2] < 0)) < 4 * 0.5 / np.sqrt(count) + 0.003


@pytest.mark.parametrize(("brushed", "most"), [(False, 2), (True, 6)])
def test_few_samples_weigh_much(brushed: bool, most: float) -> None:
    """Of 1 to 4 interfaces, from both sides: 199 of 200 at most 1.5 times what was spent on them."""
    rng = np.random.default_rng(5)
    for case in range(40):
        for transmission in transmissions(random_stack(rng, 1 + case % 4, brushed)):
            wi = directions(rng, 2000)
            wo = direct.sample(transmission, wi, *rng.random((3, 2000)))
            value, density = direct.eval_pdf(transmission, wi, wo)
            assert np.mean(value > 1.5 * density) < 0.005
            assert np.all(value <= most * density)


def test_an_interface_without_contrast_changes_nothing() -> None:
    """Below the others: neither value nor density, to 1e-4; alone, all light goes straight on, but for what single
    precision needs."""
    rng = np.random.default_rng(6)
    wi, wo = directions(rng, 500), directions(rng, 500)
    layers = [vt.Interface(eta=1.5, alpha=0.15), vt.Interface(eta=1.2, alpha=0.3)]
    plain, _ = transmissions(vt.Stack(layers))
    for extra in (
        [*layers, vt.Interface(eta=1.2, alpha=0.5)],
        [layers[0], vt.Interface(eta=1.5, alpha=0.5), layers[1]],
    ):
        more, _ = transmissions(vt.Stack(extra))
        for a, b in zip(direct.eval_pdf(plain, wi, down(wo)), direct.eval_pdf(more, wi, down(wo))):
            np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)
    alone, _ = transmissions(vt.Stack([vt.Interface(eta=1.0, alpha=0.4)]))
    wo = direct.sample(alone, wi, *rng.random((3, 500)))
    moved = np.hypot(wo[0] + wi[0], wo[1] + wi[1])
    assert np.quantile(moved, 0.9) < 5e-4
    energy, _, share = direct.integrals(alone, wi)
    np.testing.assert_allclose(energy, 1, atol=5e-3)
    np.testing.assert_allclose(share, 1, atol=5e-3)


@pytest.mark.parametrize("eta", [1.0, 1.0005, 1.02])
@pytest.mark.parametrize("alpha", [(0.94, 0.001), 0.002, 0.4])
def test_samples_of_hardly_a_step_follow_their_density(eta: float, alpha: float | tuple[float, float]) -> None:
    """From both sides: the mean over samples of a narrow distribution over their density is its integral, 1, within 4
    standard errors; a false alarm in 10^4 each."""
    for transmission in transmissions(vt.Stack([vt.Interface(eta=eta, alpha=alpha, rotation=30)])):
        rng, count = np.random.default_rng(4), 20_000
        wi = at(0.6, 1.0, count)
        wo = direct.sample(transmission, wi, *rng.random((3, count)))
        density = direct.eval_pdf(transmission, wi, wo)[1] + (wo[2] >= 0)
        x, y = (w * transmission.indices[-1] + i for w, i in zip(wo, wi[:2]))
        x, y = 0.75**0.5 * x + 0.5 * y, 0.75**0.5 * y - 0.5 * x
        u, v = np.median(np.abs(x)), np.median(np.abs(y))
        narrow = np.exp(-((x / u) ** 2) - (y / v) ** 2) / (np.pi * u * v)
        share = np.where(wo[2] < 0, narrow / density, 0) * np.abs(wo[2]) * transmission.indices[-1] ** 2
        assert abs(share.mean() - 1) < 4 * share.std() / np.sqrt(count)


def test_narrow_and_grazing_light_is_finite() -> None:
    """Smooth, equal indices, steps of 1e-7, horizontal and vertical directions, in every combination."""
    cosines = np.array([1e-7, 1e-4, 0.01, 0.5, 1.0])
    angles = [(c, phi) for c in cosines for phi in (0.0, 2.0)]
    grid = [(a, b) for a in angles for b in angles]
    wi, wo = (tuple(np.concatenate(x) for x in zip(*(at(*pair[k], 1) for pair in grid))) for k in (0, 1))
    for n_1 in (1.0, 1.0 + 1e-7, 1.5):
        for n_2 in (1.0, n_1, n_1 + 1e-7, 1.8):
            for alpha in (0.0, 0.5):
                above, _ = transmissions(
                    vt.Stack([vt.Interface(eta=n_1, alpha=0.2), vt.Interface(eta=n_2, alpha=alpha)])
                )
                for o in (wo, down(wo)):
                    assert all(np.isfinite(x).all() for x in direct.eval_pdf(above, wi, o))
                assert np.isfinite(direct.sample(above, wi, *np.full((3, len(wi[0])), 0.5))).all()


def test_energy_rises_smoothly_towards_the_critical_angle() -> None:
    """From inside glass, 1.5: light passes beyond it, and the energy has no step there."""
    transmission, _ = transmissions(INSIDE)
    sine = np.linspace(0.6, 0.8, 41)
    energy, *_ = direct.integrals(transmission, (sine, 0 * sine, np.sqrt(1 - sine * sine)))
    assert energy[0, -1] > 0.05
    assert all(0 < a - b < 0.05 for a, b in pairwise(energy[0]))


def test_energy_of_nearly_isotropic_interfaces_is_that_of_isotropic_ones() -> None:
    """Solved as brushed ones are, about the critical angles of a pane rarer than the outside: the same rays."""
    pane = vt.Stack([vt.Interface(eta=1.35, alpha=0.25), vt.Interface(eta=1.64, alpha=0.53)], exterior=1.7, thin=True)
    material = Material.of(pane, number)
    cosine, phi = (x.ravel() for x in np.meshgrid(np.linspace(0.05, 0.95, 31), np.radians([0, 15, 75])))
    sine = np.sqrt(1 - cosine * cosine)
    wi = sine * np.cos(phi), sine * np.sin(phi), cosine
    alike, brushed = (direct.integrals(direct.transmission(material, kind), wi)[0] for kind in (Isotropic, Covariance))
    np.testing.assert_allclose(brushed, alike, rtol=1e-5, atol=1e-7)


def test_drjit_agrees_with_numpy() -> None:
    """In single precision, value, density and samples; gradients by roughness and index are finite."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    rng = np.random.default_rng(7)
    wi, wo = directions(rng, 300), down(directions(rng, 300))
    stack = vt.Stack([BRUSHED.layers[0], vt.Interface(eta=1.2, alpha=(0.3, 0.1), rotation=-50)])
    material = Material.of(stack, number)
    theirs = Material.of(stack, lambda name, x: mi.Color3f(x) if np.ndim(x) else mi.Float(float(x)))
    dr.enable_grad(theirs.interfaces[0].alpha_u, theirs.interfaces[1].eta)
    kind = variance_kind(material)
    ours = direct.transmission(theirs, kind)
    value, density = direct.eval_pdf(ours, *(tuple(mi.Float(x) for x in w) for w in (wi, wo)))
    expected = direct.eval_pdf(direct.transmission(material, kind), wi, wo)
    dr.backward(value.y + density)
    assert np.isfinite(np.array(dr.grad(theirs.interfaces[0].alpha_u))).all()
    assert np.isfinite(np.array(dr.grad(theirs.interfaces[1].eta))).all()
    np.testing.assert_allclose(np.array(value), expected[0], rtol=2e-3, atol=1e-5)
    np.testing.assert_allclose(np.array(density), expected[1], rtol=2e-3, atol=1e-5)
    u = rng.random((3, 300))
    samples = direct.sample(ours, tuple(mi.Float(x) for x in wi), *(mi.Float(x) for x in u))
    there = direct.sample(direct.transmission(material, kind), wi, *u)
    assert np.mean(np.abs(np.array(samples) - np.array(there)).max(0) < 1e-3) > 0.99


@pytest.mark.parametrize(("n_above", "n_below"), [(1.0, 1.5), (1.5, 1.0), (1.33, 2.0)])
def test_one_interface_is_the_rough_dielectric_of_mitsuba(n_above: float, n_below: float) -> None:
    """Brushed: value and density of what passes, and density of what is reflected, to single precision."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    stack = vt.Stack([vt.Interface(eta=n_below, alpha=(0.2, 0.5))], exterior=n_above)
    glass = {"type": "roughdielectric", "distribution": "ggx", "int_ior": n_below, "ext_ior": n_above}
    theirs = mi.load_dict({**glass, "alpha_u": 0.2, "alpha_v": 0.5})
    rng, count = np.random.default_rng(8), 2000
    wi, wo = directions(rng, count), directions(rng, count)
    wo = (wo[0], wo[1], wo[2] * np.where(np.arange(count) % 2, 1, -1))
    value, density = direct.eval_pdf(transmissions(stack)[0], wi, wo)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(*wi)
    known, known_density = theirs.eval_pdf(mi.BSDFContext(mi.TransportMode.Importance), si, mi.Vector3f(*wo))
    passed = wo[2] < 0
    np.testing.assert_allclose(value[1, passed], np.array(known)[1, passed], rtol=2e-3, atol=1e-5)
    lost = np.array(known_density)[~passed] < 0.998 * density[~passed]  # theirs drops what is refracted upwards
    assert np.mean(lost) < 0.03
    np.testing.assert_allclose(density[passed], np.array(known_density)[passed], rtol=2e-3, atol=1e-5)
    np.testing.assert_allclose(density[~passed][~lost], np.array(known_density)[~passed][~lost], rtol=2e-3, atol=1e-5)


def test_light_of_many_brushed_interfaces_is_round_and_has_fewer_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many interfaces as have rays, and of sixteen no kernel, which would take long to compile."""
    rng = np.random.default_rng(4)

    def brushed(count: int) -> Transmission:
        each = rng.uniform([1.2, 0.03, 0.1, 0.0], [1.9, 0.2, 0.5, 180.0], (count, 4)).tolist()
        stack = vt.Stack([vt.Interface(eta=eta, alpha=(u, v), rotation=turn) for eta, u, v, turn in each], thin=True)
        return transmissions(stack)[0]

    asked: list[int] = []
    original = compiled.over

    def counted(function: Any, sources: Any, samples: Any, *others: Any) -> Any:
        asked.append(samples[0].shape[-1])
        return original(function, sources, samples, *others)

    monkeypatch.setattr(compiled, "over", counted)
    monkeypatch.setattr(compiled, "MANY", -1)
    monkeypatch.setattr(compiled, "_compiled", lambda *_: pytest.fail("a kernel is launched"))
    z, phi = np.array([0.9, 0.6, 0.3]), np.array([0.2, 1.9, 4.0])
    wi = np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z
    for count, least in ((8, np.inf), (16, 0)):
        monkeypatch.setattr(compiled, "LEAST", least)
        passing = brushed(count)
        energy, _, _ = direct.integrals(passing, wi)
        fine, _, _ = direct.integrals(passing, wi, (48, 128))
        assert energy == pytest.approx(fine, abs=2e-3)
    along, around = direct.NODES
    assert asked[::2] == [2 * along * 17, 2 * along * direct.LEAST_RAYS] and around > 17
