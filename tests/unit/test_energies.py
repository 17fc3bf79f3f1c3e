"""Energies by adding on nodes of momentum, against closed forms, limits, laws of conservation and walks."""

from typing import Any

import numpy as np
import pytest
import tmm

import velatura as vt
from velatura import ops, tables
from velatura.model.guards import ALPHA_MIN
from velatura.model.rough_interface import KEPT, Facets, FirstEvents
from velatura.model.solved.energies import adding
from velatura.model.solved.energies import energies as of_energies
from velatura.model.solved.energies.adding import Leaving, indices, layers, parts
from velatura.model.solved.energies.energies import Energies, energies
from velatura.model.solved.energies.interfaces import Setting
from velatura.model.solved.energies.modes import RATIOS, Even, Relative
from velatura.model.solved.energies.nodes import CLOSE, Nodes
from velatura.model.solved.energies.operators import Layer
from velatura.optics import fresnel, ggx
from velatura.renderer import compiled
from velatura.renderer.compiled import Found
from velatura.renderer.low_discrepancy import fibonacci
from velatura.stack import Diffuse, Interface, Material, Medium, Stack
from velatura.tables.microsurface_walks import Walks

COSINES = np.array([1.0, 0.7, 0.35, 0.1])
GOLD = {"eta": 0.2, "k": 3.5}
FALSE_ALARM_SIGMAS = 4.5  # of some 60 numbers, one fails by chance in 2000 runs
MODEL_ERROR = 0.006  # relative to the albedo


def solved(stack: Stack, often: bool = True, phi: float = 0.0, cosines: np.ndarray = COSINES) -> Energies:
    known = tables.load() if often else None
    return energies(Material.of(stack), cosines, np.full(cosines.shape, phi), known, lambda g: 0.0)


def reflected(found: Energies) -> np.ndarray:
    """(C, M)."""
    return np.asarray((found.lobes + found.veils).sum(axis=0) + found.rest)


# Nodes


def test_light_keeps_its_energy_and_its_moments_among_the_nodes() -> None:
    nodes = Nodes.of([1.0, 1.5, 1.2], 24)
    p = np.linspace(0, 1.5, 401)
    index, shares, _ = nodes.shares(p)
    assert shares.sum(axis=0) == pytest.approx(np.ones(401), abs=1e-12)
    assert (nodes.p[index] ** 2 * shares).sum(axis=0) == pytest.approx(p**2, abs=3e-3)


def test_nodes_lie_where_media_end() -> None:
    nodes = Nodes.of([1.0, 1.5, 1.2], 24)
    assert all(np.abs(nodes.p - n).min() < 1e-12 for n in (1.0, 1.2, 1.5))
    assert nodes.weights(1.2).sum() == pytest.approx(1.44, rel=1e-6)


def test_a_step_of_an_index_keeps_the_number_of_nodes() -> None:
    """Where it would change by itself; where a part would be too short, or where one medium stands beside another of
    the same index, nodes are those of the indices alone."""
    like = [1.0, 1.6912, 1.3]
    steps = [Nodes.of([1.0, like[1] + step, 1.3], 24) for step in (-0.03, 0.03)]
    held = [Nodes.of([1.0, like[1] + step, 1.3], 24, like) for step in (-0.03, 0.03)]
    assert steps[0].cells != steps[1].cells
    assert held[0].cells == held[1].cells == Nodes.of(like, 24).cells and held[0].ends == steps[0].ends
    assert Nodes.of([1.0, 1.30001, 1.3], 24, like) == Nodes.of([1.0, 1.30001, 1.3], 24)
    assert Nodes.of([1.0, 1.02, 1.3], 24, [1.0, 1.0, 1.3]) == Nodes.of([1.0, 1.02, 1.3], 24)


@pytest.mark.parametrize("index", [1.0, 1.3])
def test_light_does_not_jump_where_indices_share_an_end(index: float) -> None:
    layers = Interface(eta=1.3, alpha=0.05), Interface(**GOLD, alpha=0.3)
    ratios = CLOSE * (1 - 1e-9), CLOSE * (1 + 1e-9)
    here, there = (reflected(solved(Stack([Interface(eta=index * r, alpha=0.1), *layers]))) for r in ratios)
    assert there == pytest.approx(here, abs=2e-4)


def test_many_media_share_nodes() -> None:
    """Each part between two indices has four nodes at least: those of many media would have too many."""
    many = [1.0, *np.linspace(1.05, 2.5, 30).tolist()]
    assert Nodes.of(many, 24).count < 1.7 * Nodes.of(many[:4], 24).count
    assert Nodes.of(many, 24).ends[-1] == 2.5


@pytest.mark.parametrize(("count", "azimuths", "modes"), [(4, 6, 9), (5, 4, 5)])
def test_more_than_four_brushed_interfaces_have_two_orders_of_the_azimuth(
    count: int, azimuths: int, modes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What matrices and light from the nodes cost, by the numbers of both."""
    settings: list[Setting] = []

    def stopped(_: Any, setting: Setting) -> Any:
        settings.append(setting)
        raise InterruptedError

    monkeypatch.setattr(of_energies, "layers", stopped)
    stack = Stack([Interface(eta=1.3 + 0.1 * k, alpha=(0.02, 0.3), rotation=20.0 * k) for k in range(count)])
    with pytest.raises(InterruptedError):
        solved(stack)
    basis = settings[0].basis
    assert (len(basis.azimuths), basis.size) == (azimuths, modes * basis.nodes.count)


# Smooth interfaces


@pytest.mark.parametrize("often", [False, True])
@pytest.mark.parametrize("eta", [1.1, 1.5, 2.2])
def test_a_smooth_interface_is_fresnel(eta: float, often: bool) -> None:
    found = solved(Stack([Interface(eta=eta, alpha=0)]), often)
    assert found.lobes[0, 0] == pytest.approx(fresnel.dielectric(COSINES, eta), abs=1e-9)
    assert found.straight[0] == pytest.approx(1 - fresnel.dielectric(COSINES, eta), abs=1e-9)


def test_smooth_stacks_are_the_incoherent_sum() -> None:
    """At normal incidence, where both polarisations agree, that of `tmm`."""
    stack = Stack([Interface(eta=1.5, alpha=0), Medium(depth=1, sigma_a=0.3), Interface(eta=1.3, alpha=0),
                   Interface(eta=1.7, alpha=0)])  # fmt: skip
    found = solved(stack, cosines=np.array([1.0]))
    wavelength = 500.0
    thickness = 1e6
    k = 0.3 * wavelength / (4 * np.pi * thickness)
    layers = [1, 1.5 + 1j * k, 1.3, 1.7]
    expected = tmm.inc_tmm("s", layers, [np.inf, thickness, 1e6, np.inf], ["i"] * 4, 0, wavelength)
    assert reflected(found)[0, 0] == pytest.approx(expected["R"], abs=1e-6)
    assert found.passed[0, 0] == pytest.approx(expected["T"], abs=1e-6)


NEARLY_SMOOTH: dict[str, Any] = {
    "metal": lambda alpha: [Interface(eta=1.5), Interface(eta=0.96, k=6.7, alpha=alpha)],
    "brushed": lambda alpha: [Interface(eta=1.5), Interface(eta=0.96, k=6.7, alpha=[alpha, 0.3 * alpha])],
    "coat": lambda alpha: [Interface(eta=1.5, alpha=alpha), Interface(eta=0.96, k=6.7)],
    "middle": lambda alpha: [Interface(eta=1.5), Interface(eta=1.2, alpha=alpha), Interface(eta=1.3, k=2.0)],
    "pane": lambda alpha: [Interface(eta=1.5, alpha=alpha), Interface(eta=1.0, alpha=0.5 * alpha)],
}


@pytest.mark.parametrize("name", NEARLY_SMOOTH)
def test_rough_interfaces_tend_to_smooth_ones(name: str) -> None:
    """Without a jump where a roughness begins, nor where it is resolved."""
    for alpha in (0.0, ALPHA_MIN * (1 - 1e-9)):
        here, there = (solved(Stack(NEARLY_SMOOTH[name](each))) for each in (alpha, alpha + 2e-9 * ALPHA_MIN))
        assert reflected(there) == pytest.approx(reflected(here), abs=1e-6)
        assert there.passed == pytest.approx(here.passed, abs=1e-6)


@pytest.mark.parametrize("alpha", [2e-4, 5e-4])
@pytest.mark.parametrize("name", ["metal", "coat", "middle"])
def test_slight_roughness_agrees_with_walks(name: str, alpha: float) -> None:
    """At a cosine at which light is close to being totally reflected inside."""
    stack, cosines = Stack(NEARLY_SMOOTH[name](alpha)), np.array([0.5, 0.08])
    walked = vt.reference.statistics(stack, cosines, paths=100_000, seed=3, microsurface=True)
    assert walked.standard_error
    true, error = np.sum(walked.energy, axis=0), np.square(walked.standard_error.energy).sum(axis=0)
    bound = MODEL_ERROR * true + FALSE_ALARM_SIGMAS * np.sqrt(error)
    assert (np.abs(reflected(solved(stack, cosines=cosines)) - true) < bound).all()


@pytest.mark.parametrize("eta, cosine", [(1.5, 0.1), (1 / 1.5, 0.5)])
def test_later_events_are_those_of_walks(eta: float, cosine: float) -> None:
    """Energy and momentum of what leaves either side after second and third events of one rough interface. Bounds: the
    error of 1597 normals, .008, beside which that of walks is a tenth."""
    facets, alpha = Facets(np.ones(1), np.array([eta]), None, 0.5, 0.5), np.array([0.5])
    events = FirstEvents(facets, (True,), True)

    def sums(*values: Any) -> Found:
        lights, _ = events(*values)
        momenta = [ops.sqrt(light.x * light.x + light.y * light.y) for light in lights]
        return Found([w * x for light, p in zip(lights, momenta) for w in light.weights for x in (1.0, p)])

    sources = np.array([np.sqrt(1 - cosine**2)]), np.zeros(1)
    found, _, _ = compiled.over(sums, sources, fibonacci(1597), events.numbers(1597))
    later = np.reshape(found, (events.lights, 2))[2:]
    passing = np.array([number.bit_count() % 2 == 1 for number in (*range(4), *range(8))])

    walks, expected = Walks(np.array([cosine]), alpha, 2**15, np.random.default_rng(3)), np.zeros((2, 2))
    while walks.meetings < 3:
        walks.scatter(*walks.meet(), np.array([eta]))
        sine, below = np.hypot(walks.w[0], walks.w[1]), (~walks.outside).astype(int)
        leaving = walks.leave() / walks.paths
        if walks.meetings > 1:
            for side, n in enumerate((1.0, eta)):
                expected[side] += [(leaving * x)[below == side].sum() for x in (1.0, n * sine)]
        walks.end_faint()
    for side in (0, 1):
        assert later[passing == bool(side)].sum(axis=0) == pytest.approx(expected[side], abs=0.01)


def test_colours_of_a_metal_are_solved_each_like_a_metal_of_its_own() -> None:
    """Where they differ in the extinction alone."""
    k = (2.0, 3.0, 4.0)
    together = solved(Stack([COAT, Interface(eta=0.2, k=k, alpha=0.4)]))
    for colour, own in enumerate(k):
        alone = solved(Stack([COAT, Interface(eta=0.2, k=own, alpha=0.4)]))
        assert reflected(together)[colour] == pytest.approx(reflected(alone)[0], abs=1e-9)


# Conservation


def slab(depth: float) -> Medium:
    return Medium(depth=depth, sigma_a=0.2, sigma_s=0.5, g=0.6)


COAT, METAL = Interface(eta=1.5, alpha=0.2), Interface(**GOLD, alpha=0.15)
COATED = Stack([COAT, slab(1.0), METAL])
LOSSLESS: dict[str, list[Any]] = {
    "mirror under rough coats": [Interface(eta=1.5, alpha=0.3), Interface(eta=1.2, alpha=0.05),
                                 Interface(conductor="mirror", alpha=0.4)],
    "brushed and turned": [Interface(eta=1.6, alpha=[0.1, 0.4], rotation=30), Interface(eta=1.9, alpha=0.2),
                           Interface(conductor="mirror", alpha=[0.3, 0.05], rotation=75)],
    "paint": [Interface(eta=1.5, alpha=0.2), Medium(depth=1, sigma_s=3, g=0.5),
              Interface(conductor="mirror", alpha=0.2)],
    "glass": [Interface(eta=1.5, alpha=0.3), Interface(eta=1.1, alpha=0.1)],
    "smoke over glass": [Medium(depth=1, sigma_s=0.7, g=0.8), Interface(eta=1.5, alpha=0.2)],
}  # fmt: skip


@pytest.mark.parametrize("name", LOSSLESS)
def test_lossless_stacks_keep_all_light(name: str) -> None:
    found = solved(Stack(LOSSLESS[name]))
    assert (reflected(found) + found.passed)[0] == pytest.approx(np.ones(4), abs=1e-3)


@pytest.mark.parametrize("alpha", [0.001, 0.002])
def test_glass_that_is_brushed_most_keeps_its_light(alpha: float) -> None:
    """Of light that it traps, modes of the azimuth leave a part out."""
    found = solved(Stack([Interface(eta=1.5, alpha=[alpha, 0.3]), Interface(eta=1.0)]), phi=0.3)
    assert (reflected(found) + found.passed)[0] == pytest.approx(np.ones(4), abs=1e-3)


@pytest.mark.parametrize("name", ["glass", "smoke over glass"])
def test_lossless_stacks_keep_all_light_from_below(name: str) -> None:
    material = Material.of(Stack(LOSSLESS[name])).reversed()
    found = energies(material, COSINES, 0 * COSINES, tables.load(), lambda g: 0.0)
    assert (reflected(found) + found.passed)[0] == pytest.approx(np.ones(4), abs=1e-3)


@pytest.mark.parametrize("alpha", [0.0011, (0.0, 0.0011), 0.05])
@pytest.mark.parametrize("step", [1e-3, 0.01, 0.03, 0.05])
def test_indices_that_are_close_keep_all_light(step: float, alpha: Any) -> None:
    """The nodes about them are shared, and some have a weight below 0."""
    stack = Stack([Interface(eta=1.5 - step, alpha=alpha), Interface(eta=1.5), Interface(eta=1.0, alpha=0.5)])
    found = solved(stack)
    assert (reflected(found) + found.passed)[0] == pytest.approx(np.ones(4), abs=2e-3)


def test_the_remainder_of_brushed_interfaces_is_bounded() -> None:
    """Even where that of isotropic ones, which lends it its shape, is no more than rounding."""
    coats = Interface(eta="salt", alpha=1.0), Interface(eta=(1.5966, 1.3792, 1.4225))
    glass, ink = Interface(eta="sapphire", alpha=(0.2737, 0.3259)), Medium(depth=1.9088, sigma_a=1.9893)
    stack = Stack([*coats, glass, ink, Interface(eta=1.0, alpha=(0.324, 0.2689))], exterior=1.33, thin=True)
    found = solved(stack, cosines=np.array([0.9, 0.5]))
    assert np.abs(found.remainder[:, 0]).sum(axis=1).max() < 10 * max(found.rest.max(), 1e-3)


def test_light_from_inside_leaves_beyond_the_critical_angle() -> None:
    """Expected: as Walter's refraction by facets, integrated here over a fine grid of normals."""
    material = Material.of(Stack([Interface(eta=1.5, alpha=0.3)])).reversed()
    sin = 1.1 / 1.5
    found = energies(material, np.array([np.sqrt(1 - sin * sin)]), np.zeros(1), None, lambda g: 0.0)
    assert found.passed[0, 0] == pytest.approx(_refracted(sin, 1 / 1.5, 0.3), rel=0.01)


def _refracted(sin: float, eta: float, alpha: float, count: int = 400) -> float:
    """Share that passes facets, by the density of normals that are visible."""
    theta, phi = np.meshgrid((np.arange(count) + 0.5) / count * np.pi / 2, (np.arange(count) + 0.5) / count * 2 * np.pi)
    h = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    wi = (sin, 0.0, np.sqrt(1 - sin * sin))
    cosine = np.maximum(ggx.dot(wi, h), 0)
    density = ggx.masking(wi, alpha, alpha) * ggx.ndf(h, alpha, alpha) * cosine / wi[2]
    cos_t = fresnel.cos_transmitted(cosine, eta)
    along = cosine / eta - cos_t
    z = along * h[2] - wi[2] / eta
    out = (along * h[0] - wi[0] / eta, along * h[1], np.abs(z))
    share = (1 - fresnel.dielectric(cosine, eta)) * np.where(z < 0, ggx.masking(out, alpha, alpha), 0)
    return float((density * share * np.sin(theta)).sum() * (np.pi / 2 / count) * (2 * np.pi / count))


# What changes nothing


def test_an_index_step_of_one_changes_nothing() -> None:
    plain, stepped = solved(COATED), solved(Stack([COAT, Interface(eta=1.5, alpha=0.4), slab(1.0), METAL]))
    assert reflected(stepped) == pytest.approx(reflected(plain), abs=1e-6)


def test_a_medium_of_no_depth_changes_nothing() -> None:
    plain, thin = solved(Stack([COAT, METAL])), solved(Stack([COAT, slab(0.0), METAL]))
    assert reflected(thin) == pytest.approx(reflected(plain), abs=1e-7)


def test_a_medium_cut_in_two_changes_nothing() -> None:
    halves = Stack([COAT, slab(0.5), Interface(eta=1.5, alpha=0.1), slab(0.5), METAL])
    assert reflected(solved(halves)) == pytest.approx(reflected(solved(COATED)), abs=5e-4)


@pytest.mark.parametrize("often", [False, True])
def test_turning_all_layers_turns_all_energies(often: bool) -> None:
    def stack(turn: float) -> Stack:
        return Stack([
            Interface(eta=1.5, alpha=[0.1, 0.3], rotation=20 + turn),
            Interface(**GOLD, alpha=[0.3, 0.1], rotation=50 + turn),
        ])  # fmt: skip

    here, there = solved(stack(0), often, 0.3), solved(stack(40), often, 0.3 + np.radians(40))
    assert there.lobes == pytest.approx(here.lobes, abs=1e-9)
    assert there.rest == pytest.approx(here.rest, abs=1e-9)


@pytest.mark.parametrize("often", [False, True])
def test_modes_of_the_azimuth_agree_on_isotropic_stacks(often: bool) -> None:
    found = parts(Material.of(COATED))
    nodes, p = Nodes.of(indices(found), 24), np.sqrt(1 - COSINES**2)
    total = []
    for basis in (Relative(nodes), Even(nodes)):
        setting = Setting(basis, p, 0 * p, 377, tables.load() if often else None)
        light = Leaving.of([last for _, last in layers(found, setting)], setting)
        total.append(sum(light.energies.reflected))
    assert total[1] == pytest.approx(total[0], abs=4e-3)


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
def test_nearly_isotropic_interfaces_have_the_energies_of_isotropic_ones(often: bool) -> None:
    """Very rough glass, whose few normals are off by 1 % where light meets them often: by as much."""

    def pane(alpha: float) -> Energies:
        return solved(Stack([Interface(eta=1.8, alpha=0.13), Interface(eta=1.0, alpha=[alpha, 1.0])]), often, 0.4)

    alike, brushed = pane(1.0), pane(1 - 1e-6)
    for x in ("lobes", "rest", "straight", "bounced", "passed"):
        assert getattr(brushed, x) == pytest.approx(getattr(alike, x), abs=2e-5), x


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
def test_brushed_metals_look_alike_from_all_azimuths_about_the_normal(often: bool) -> None:
    """There light has no side: the error of few normals is the same for all."""
    stack = Stack([Interface(eta=(0.14, 0.37, 1.44), k=(3.98, 2.39, 1.6), alpha=[0.1, 0.4])])
    alike = [reflected(solved(stack, often, phi, np.array([1.0, 0.999]))) for phi in np.linspace(0, np.pi, 7)]
    assert np.ptp(alike, axis=0) == pytest.approx(0, abs=5e-4)


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
def test_interfaces_that_mirror_light_keep_cosines_from_sines(often: bool) -> None:
    stack = Stack([Interface(eta=1.5, alpha=[0.05, 0.2]), Interface(**GOLD, alpha=[0.3, 0.06], rotation=90)])
    found = parts(Material.of(stack))
    nodes, p = Nodes.of(indices(found), 24), np.sqrt(1 - COSINES**2)
    total = []
    for mirrored in (True, False):
        basis = Even(nodes, (2, 4), mirrored)
        setting = Setting(basis, p, 0 * p + 0.4, 89, tables.load() if often else None)
        light = Leaving.of([last for _, last in layers(found, setting)], setting)
        total.append(sum(light.energies.reflected))
    assert Even.of(nodes, [(4.0, 0.0), (5.0, np.pi / 2)]).mirrored and not Even.of(nodes, [(4.0, 0.3)]).mirrored
    assert total[0] == pytest.approx(total[1], abs=1e-12)


@pytest.mark.parametrize("ratio", RATIOS)
def test_modes_of_the_azimuth_fade_in(ratio: tuple[float, float]) -> None:
    """Where they begin, and where they are whole."""
    for end in ratio:
        across = [0.3 / end * (1 + step) for step in (-1e-9, 1e-9)]
        stacks = [Stack([COAT, Interface(**GOLD, alpha=[0.3, alpha], rotation=30)]) for alpha in across]
        here, there = (reflected(solved(stack, phi=0.2)) for stack in stacks)
        assert there == pytest.approx(here, abs=1e-7)


@pytest.mark.parametrize("ratio", [1.0, 1.41, 1.6, 1.8, 4.5, 9.0, 12.0])
def test_azimuths_hold_modes_apart(ratio: float) -> None:
    """Means over them of products of modes."""
    basis = Even.of(Nodes.of([1.0], 24), [(ratio, 0.0)])
    azimuths, weights = basis.rule
    assert weights.sum() == pytest.approx(1, abs=1e-12) and (weights > 0).all()
    orders = 2 * np.arange(2 * len(basis.orders) + 1)
    means = [weights @ np.cos(order * azimuths) for order in orders]
    assert means == pytest.approx([1.0, *(0 * orders[1:])], abs=1e-12)


# Walks


WALKED: dict[str, list[Any]] = {
    "coats": [Interface(eta=1.7, alpha=0.3), Interface(eta=1.3, alpha=0.1), Interface(**GOLD, alpha=0.25)],
    "brushed": [Interface(eta=1.6, alpha=[0.3, 0.1], rotation=35), Interface(**GOLD, alpha=[0.1, 0.3], rotation=80)],
    "lacquer": [Interface(eta=1.5, alpha=0.18), Interface(eta=0.96, k=6.7, alpha=[0.345, 0.03], rotation=30)],
    "crossed": [Interface(eta=1.6, alpha=[0.35, 0.04], rotation=20), Interface(**GOLD, alpha=[0.3, 0.04], rotation=95)],
    "varnish": [Interface(eta=1.5, alpha=0.15), Medium(depth=1, sigma_a=0.4), Interface(**GOLD, alpha=0.3)],
    "paint": [COAT, Medium(depth=1, sigma_a=0.3, sigma_s=2.0, g=0.4), Interface(**GOLD, alpha=0.1)],
    "backwards": [COAT, Medium(depth=1, sigma_a=0.1, sigma_s=1.0, g=-0.3), Diffuse(albedo=0.5)],
    "white": [Interface(eta=1.5, alpha=0.3), Diffuse(albedo=0.9)],
    "block": [Interface(eta=1.8, alpha=0.4), Interface(eta=1.2, alpha=0.2)],
}


@pytest.mark.parametrize(
    "coats",
    [
        [Interface(eta=1.5, alpha=[0.26, 0.03], rotation=77), Interface(eta=1.35, alpha=[0.19, 0.03], rotation=30)],
        [Interface(eta=1.3, alpha=[0.2, 0.02], rotation=61), Interface(eta=1.5, alpha=[0.26, 0.08], rotation=164)],
    ],
)
def test_light_that_passes_crossed_brushings_agrees_with_walks(coats: list[Interface]) -> None:
    """At a slant, where facets of the coats are met most often."""
    stack, cosines = Stack([*coats, Interface(eta=1.9, k=4.5, alpha=[0.3, 0.045], rotation=85)]), np.array([0.1])
    walked = vt.reference.statistics(stack, cosines, paths=200_000, seed=3, microsurface=True)
    assert walked.standard_error
    true, error = np.sum(walked.energy, axis=0), np.square(walked.standard_error.energy).sum(axis=0)
    bound = MODEL_ERROR * true + FALSE_ALARM_SIGMAS * np.sqrt(error)
    assert (np.abs(reflected(solved(stack, cosines=cosines)) - true) < bound).all()


@pytest.mark.parametrize("often", [False, True], ids=["once", "often"])
@pytest.mark.parametrize("name", WALKED)
def test_energies_agree_with_walks(name: str, often: bool) -> None:
    stack, cosines = Stack(WALKED[name]), np.array([1.0, 0.35])
    found = solved(stack, often, cosines=cosines)
    walked = vt.reference.statistics(stack, cosines, paths=200_000, seed=3, microsurface=often)
    assert walked.standard_error
    true, error = np.sum(walked.energy, axis=0), np.square(walked.standard_error.energy).sum(axis=0)
    bound = FALSE_ALARM_SIGMAS * np.sqrt(error) + MODEL_ERROR * true
    assert np.all(np.abs(reflected(found) - true) < bound)
    if walked.transmitted and walked.standard_error.transmitted:
        through, noise = walked.transmitted.energy, walked.standard_error.transmitted.energy
        assert np.all(np.abs(found.passed - through) < FALSE_ALARM_SIGMAS * noise + MODEL_ERROR * through)


def test_both_sides_of_a_pane_share_what_its_layers_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Below it is another medium than above, whose index is the unit of momentum there."""
    stack = Stack([Interface(eta=1.5, alpha=[0.1, 0.2], rotation=20), Medium(depth=1, sigma_s=0.5, g=0.3),
                   Interface(eta=1.33, alpha=[0.2, 0.1])])  # fmt: skip
    below, made, make = Material.of(stack).reversed(), [], adding._made

    def counted(part: adding.Part, setting: Setting) -> tuple[Layer, Layer]:
        made.append(len(setting.p))
        return make(part, setting)

    def seen_from_below() -> np.ndarray:
        return reflected(energies(below, COSINES, 0 * COSINES, tables.load(), lambda g: 0.0, np.zeros(0)))

    KEPT.clear()
    alone = seen_from_below()
    KEPT.clear()
    solved(stack)
    monkeypatch.setattr(adding, "_made", counted)
    assert seen_from_below() == pytest.approx(alone, abs=1e-12)
    assert made and all(made)  # beams alone meet an interface anew
