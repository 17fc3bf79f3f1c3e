"""The statistical model against hand-worked cases, limits, and published numbers."""

from __future__ import annotations

from math import isclose, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from velatura.errors import InvalidInput
from velatura.model import MODELS, SWITCHES, named
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Covariance, Roughness
from velatura.stack import Interface, Material, Medium, Stack, preset

PAPER = {"model": "belcour2018"}  # which has all switches
PLAIN = {**PAPER, "reflectance": "fresnel", "tir": "off"}


def f(alpha: float) -> float:
    x = alpha**1.1
    return x / (1 - x)


def f_inverse(s: float) -> float:
    return (s / (1 + s)) ** (1 / 1.1)


def fresnel(cos_i: float, n: float) -> tuple[float, float]:
    """Reflectance and refracted cosine, from the amplitudes."""
    cos_t = sqrt(1 - (1 - cos_i**2) / n**2)
    r_s = (cos_i - n * cos_t) / (cos_i + n * cos_t)
    r_p = (n * cos_i - cos_t) / (n * cos_i + cos_t)
    return (r_s**2 + r_p**2) / 2, cos_t


def test_rough_coat_over_rough_metal_worked_by_hand() -> None:
    cos_i, n, a1, a2 = 0.6, 1.5, 0.1, 0.2
    stack = Stack([Interface(eta=n, alpha=a1), Interface(eta=0.3, k=3.0, alpha=a2)])
    found = stack_lobes(stack, cos_i, **PLAIN)

    # Energies: R01, then T R / (1 - R R') T
    r01, cos_t = fresnel(cos_i, n)
    eta = complex(0.3, 3.0) / n
    cos_m = np.sqrt(1 - (1 - cos_t**2) / eta**2)
    r12 = (
        abs((cos_t - eta * cos_m) / (cos_t + eta * cos_m)) ** 2
        + abs((eta * cos_t - cos_m) / (eta * cos_t + cos_m)) ** 2
    ) / 2
    second = (1 - r01) ** 2 * r12 / (1 - r01 * r12)
    assert isclose(found.energy[0][0, 0], r01, rel_tol=1e-12)
    assert isclose(found.energy[1][0, 0], second, rel_tol=1e-12)

    # Variances: two refractions, one reflection, and the bounces below the coat
    s_t01, s_t10 = f(a1 * (1 - 1 / n) / 2), f(a1 * (n - 1) / 2)
    j = n * cos_t / cos_i
    bounces = r01 * r12 / (1 - r01 * r12)
    variance = s_t10 + j * (s_t01 + f(a2) + bounces * (f(a2) + f(a1)))
    assert isclose(found.alpha[0][0, 0], a1, rel_tol=1e-12)
    assert isclose(found.alpha[1][0, 0], f_inverse(variance), rel_tol=1e-12)


def test_three_interfaces_worked_by_hand_at_normal_incidence() -> None:
    n1, n2, (a1, a2, a3) = 1.5, 2.0, (0.1, 0.05, 0.2)
    stack = Stack([Interface(eta=n1, alpha=a1), Interface(eta=n2, alpha=a2), Interface(conductor="mirror", alpha=a3)])
    found = stack_lobes(stack, 1.0, **PLAIN)
    r1, r2 = ((n1 - 1) / (n1 + 1)) ** 2, ((n2 / n1 - 1) / (n2 / n1 + 1)) ** 2
    up1, up2 = n1, n2 / n1  # Snell's factors at normal incidence, and relative indices

    # Below the first interface
    t_0, t_1, r_10 = 1 - r1, 1 - r1, r1
    s_down, s_up, s_back = f(a1 * (1 - 1 / up1) / 2), f(a1 * (up1 - 1) / 2), f(a1)
    j_down, j_up = up1, 1 / up1

    # The second lobe
    d = 1 - r_10 * r2
    lobe2, m_rr = t_0 * r2 * t_1 / d, r_10 * r2 / d
    s_lobe2 = s_up + j_down * (s_down + f(a2) + m_rr * (f(a2) + s_back))

    # Below the second interface
    s_t12, s_t21 = f(a2 * (1 - 1 / up2) / 2), f(a2 * (up2 - 1) / 2)
    m_ri0 = (1 - r2) * r_10 * (1 - r2) / d
    inner = m_rr * (f(a2) + s_back)
    s_back2 = (r2 * f(a2) + m_ri0 * (s_t12 + up2 * (s_t21 + s_back + inner))) / (r2 + m_ri0)
    s_down2 = up2 * s_down + s_t12 + up2 * inner
    s_up2 = j_up * s_t21 + s_up + j_up * inner
    t_02, t_20, r_20 = t_0 * (1 - r2) / d, (1 - r2) * t_1 / d, r2 + m_ri0
    j_down2 = j_down * up2

    # The third lobe
    d3 = 1 - r_20
    lobe3, m3 = t_02 * t_20 / d3, r_20 / d3
    s_lobe3 = s_up2 + j_down2 * (s_down2 + f(a3) + m3 * (f(a3) + s_back2))

    assert np.allclose([e[0, 0] for e in found.energy], [r1, lobe2, lobe3], rtol=1e-12)
    assert isclose(r1 + lobe2 + lobe3, 1, rel_tol=1e-12)
    assert np.allclose([a[0, 0] for a in found.alpha], [a1, f_inverse(s_lobe2), f_inverse(s_lobe3)], rtol=1e-12)


@pytest.mark.parametrize(
    ("indices", "alphas", "belcour", "weier"),
    [
        ((1.5,), (0, 0.1), 0.144, 0.140),
        ((2.0,), (0, 0.1), 0.192, 0.184),
        ((1.5,), (0.1, 0), 0.0515, 0.047),
        ((1.5, 2.0), (0.1, 0, 0), 0.070, 0.062),
        ((1.5, 2.25), (0.2, 0, 0), 0.157, 0.141),
        ((2.0, 1.2), (0.2, 0, 0), 0.143, 0.138),
    ],
)
def test_bottom_lobe_of_dielectrics_over_a_mirror(indices, alphas, belcour, weier) -> None:
    """Values worked out independently of this code, for the published recursion with either map."""
    layers = [Interface(eta=n, alpha=a) for n, a in zip(indices, alphas)]
    stack = Stack([*layers, Interface(conductor="mirror", alpha=alphas[-1])])
    for name, expected in (("belcour", belcour), ("weier", weier)):
        assert abs(stack_lobes(stack, 1.0, map=name, **PLAIN).alpha[-1][0, 0] - expected) < 1e-3


DECORRELATED = sorted(set(MAPS) - {"weier-2d"})  # in which each axis is by itself, and the inverse exact


@given(st.floats(0, 0.9999), st.floats(0.05, 1), st.sampled_from(DECORRELATED))
def test_one_interface_gives_its_roughness_and_fresnel(alpha: float, cos_theta: float, name: str) -> None:
    found = stack_lobes(Stack([Interface(eta=1.5, alpha=alpha)]), cos_theta, map=name, **PLAIN)
    assert np.allclose(found.alpha[0], alpha, rtol=1e-6, atol=1e-9)
    assert np.allclose(found.energy[0], fresnel(cos_theta, 1.5)[0], rtol=1e-12)


@pytest.mark.parametrize(("reflectance", "bound"), [("fresnel", 1e-12), ("fgd", 5e-5)])  # tables are fits
@given(cos_theta=st.floats(0.05, 1), alpha=st.floats(0, 0.9))
@settings(max_examples=20)
def test_what_is_not_there_changes_nothing(reflectance: str, bound: float, cos_theta: float, alpha: float) -> None:
    coat, metal = Interface(eta=1.5, alpha=0.1), Interface(conductor="Cu", alpha=alpha)
    switches = {**PAPER, "tir": "off", "medium": "weighted", "reflectance": reflectance}
    bare = stack_lobes(Stack([coat, metal]), cos_theta, **switches)
    empty = Medium(depth=0, sigma_a=1.0, sigma_s=2.0, g=0.5)
    filled = stack_lobes(Stack([coat, empty, metal]), cos_theta, **switches)
    parted = stack_lobes(Stack([coat, Interface(eta=1.5), metal]), cos_theta, **switches)
    for other, below in ((filled, 1), (parted, 2)):
        assert np.allclose(bare.energy[1], other.energy[below], rtol=bound)
        assert np.allclose(bare.alpha[1], other.alpha[below], rtol=max(bound, 1e-9))
    assert np.allclose(parted.energy[1], 0, atol=bound)


def test_nothing_passes_below_total_reflection() -> None:
    stack = Stack([Interface(eta=1.0, alpha=0.1), Interface(conductor="Au", alpha=0.1)], exterior=1.5)
    found = stack_lobes(stack, [0.3, 0.1, 0.74], reflectance="fresnel", **PAPER)
    assert np.allclose(found.energy[0], 1)
    assert np.all(found.energy[1] == 0)
    assert all(np.isfinite(a).all() for a in (*found.alpha, *found.covariance))


@pytest.mark.parametrize("name", ["furnace", "furnace-rough"])
@pytest.mark.parametrize("tir", ["off", "published"])
def test_the_furnace_keeps_all_energy(name: str, tir: str) -> None:
    found = stack_lobes(preset(name), np.linspace(0.05, 1, 50), reflectance="fresnel", tir=tir, **PAPER)
    assert np.allclose(sum(found.energy), 1, atol=1e-6)


@pytest.mark.parametrize("count", [20, 29, 100])
def test_many_smooth_layers_keep_all_energy(count: int) -> None:
    """Total reflection as published keeps ever less from coming back, in the end 1e-15 of all light and less."""
    layers = [Interface(eta=1.5 if k % 2 == 0 else 1.3) for k in range(count)]
    found = stack_lobes(Stack([*layers, Interface(conductor="mirror")]), [1.0, 0.5, 0.1, 0.02], model="belcour2018")
    assert np.allclose(sum(found.energy), 1, atol=1e-6)


@pytest.mark.parametrize("model", ["velatura", "belcour2018", "weier2020"])
@pytest.mark.parametrize("phi", [0.0, 1.2, 2.9])
def test_axes_keep_their_names_where_a_value_changes_by_little(model: str, phi: float) -> None:
    """Between isotropic, straight and turned stacks, whose lobes the model holds in different ways.

    Energies of brushed stacks are summed up on other nodes, which changes roughnesses by .03 %.
    """
    stacks = [
        [Interface(eta=1.5, alpha=0.1), Interface(conductor="Au", alpha=0.3)],
        [Interface(eta=1.5, alpha=0.1), Interface(conductor="Au", alpha=(0.1, 0.3))],
        [Interface(eta=1.5, alpha=(0.1, 0.3), rotation=70), Interface(conductor="Au", alpha=(0.2, 0.1), rotation=80)],
    ]
    little = 1e-6
    for layers in map(Stack, stacks):
        before = stack_lobes(layers, [1.0, 0.6, 0.2], phi, model=model)
        flat = layers.flat()
        for name in ("layer0_alpha_u", "layer1_alpha_v", "layer0_rotation", "layer1_rotation"):
            after = stack_lobes(layers.replace(**{name: flat[name] + little}), [1.0, 0.6, 0.2], phi, model=model)
            assert np.allclose(after.alpha, before.alpha, rtol=3e-4, atol=1e-4), name


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
@pytest.mark.parametrize("rotation", [0.0, 30.0, 45.0, 60.0, 100.0])
def test_one_brushed_metal_is_reported_as_it_is_written(model: str, rotation: float) -> None:
    for alpha in ((0.1, 0.3), (0.3, 0.1)):
        found = stack_lobes(Stack([Interface(conductor="Au", alpha=alpha, rotation=rotation)]), 0.6, 0.4, model=model)
        assert np.allclose(found.alpha[0][:, 0], alpha, rtol=1e-6)
        assert abs(np.sin(found.rotation[0][0] - np.radians(rotation))) < 1e-6


def test_no_map_gives_a_roughness_above_1() -> None:
    stack = Stack([Interface(eta=1.5, alpha=0.9), Medium(sigma_s=5.0, g=0.1), Interface(conductor="Au", alpha=0.9)])
    for name in MAPS:
        found = stack_lobes(stack, [1.0, 0.05], model="belcour2018", map=name)
        assert np.max(found.alpha) <= 1


def test_many_layers_and_an_absorbing_medium_are_summed_as_by_hand() -> None:
    """The energy of a mirror below a stack and a medium of transmittance t is t^2 t_0 t_1 / (1 - r t^2)."""
    coats = [Interface(eta=1.5), Interface(eta=1.3)]
    bare = stack_lobes(Stack(coats), 1.0, **PLAIN)
    assert bare.transmitted is not None
    passed = bare.transmitted.energy[0, 0]  # as much in either direction, and nothing is absorbed
    t = np.exp(-0.3)
    stack = Stack([*coats, Medium(sigma_a=0.3), Interface(conductor="mirror")])
    found = stack_lobes(stack, 1.0, **PLAIN).energy[-1][0, 0]
    assert isclose(found, t * t * passed * passed / (1 - (1 - passed) * t * t), rel_tol=1e-12)


def test_separate_channels_agree_with_their_mean_where_colour_is_none() -> None:
    stack = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=0.3, k=3.0, alpha=0.2)])
    mean, separate = (stack_lobes(stack, [1.0, 0.4], channels=c, **PAPER) for c in SWITCHES["channels"])
    for k in range(2):
        assert separate.alpha[k].shape == (3, 2, 2)
        assert np.allclose(separate.alpha[k], mean.alpha[k], rtol=1e-12)
        assert np.allclose(separate.energy[k], mean.energy[k], rtol=1e-12)


def test_one_channel_of_separate_is_the_grey_stack_of_that_channel() -> None:
    eta, k = (0.2, 0.5, 1.4), (3.9, 2.4, 1.7)
    coloured = Stack([Interface(eta=1.5, alpha=0.1), Interface(eta=eta, k=k, alpha=0.2)])
    found = stack_lobes(coloured, [1.0, 0.4], channels="separate", **PAPER)
    for c in range(3):
        layers = [Interface(eta=1.5, alpha=0.1), Interface(eta=eta[c], k=k[c], alpha=0.2)]
        grey = stack_lobes(Stack(layers), [1.0, 0.4], **PAPER)
        assert np.allclose(found.alpha[1][c], grey.alpha[1], rtol=1e-9)


@settings(max_examples=10)
@given(
    st.floats(0.01, 0.9), st.floats(0.01, 0.9), st.floats(-180, 180), st.floats(-180, 180), st.floats(0, 6.28),
    st.floats(0.1, 1),
)  # fmt: skip
def test_turning_every_interface_turns_the_lobes(u, v, rotation, turn, phi, cos_theta) -> None:
    def turned(by: float) -> Stack:
        return Stack([
            Interface(eta=1.5, alpha=(0.1, 0.2), rotation=10 + by),
            Interface(conductor="Au", alpha=(u, v), rotation=rotation + by),
        ])  # fmt: skip

    before = stack_lobes(turned(0), cos_theta, phi)
    after = stack_lobes(turned(turn), cos_theta, phi + np.deg2rad(turn))
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    for k in range(2):
        xx, xy, yy = before.covariance[k][:, 0]
        expected = np.array([[c, -s], [s, c]]) @ [[xx, xy], [xy, yy]] @ np.array([[c, s], [-s, c]])
        assert np.allclose(after.covariance[k][:, 0], expected[[0, 0, 1], [0, 1, 1]], rtol=1e-6, atol=1e-9)
        assert np.allclose(after.energy[k], before.energy[k], rtol=1e-6)


@given(st.floats(0, 1), st.floats(0, 1), st.floats(-3, 3), st.sampled_from(DECORRELATED))
def test_a_lobe_survives_its_covariance(u: float, v: float, rotation: float, name: str) -> None:
    f_map = MAPS[name]
    back = Covariance.of(Roughness(u, v, rotation), f_map).roughness(f_map)
    again = Covariance.of(back, f_map)
    assert np.isfinite(tuple(back)).all()
    assert np.allclose(again.matrix(), Covariance.of(Roughness(u, v, rotation), f_map).matrix(), rtol=1e-6, atol=1e-9)


@given(st.floats(0, 0.9999), st.sampled_from(DECORRELATED))
def test_maps_invert(alpha: float, name: str) -> None:
    f_map = MAPS[name]
    assert f_map.variance(0.0) == 0.0 == f_map.roughness(0.0)
    assert isclose(f_map.roughness(f_map.variance(alpha)), alpha, rel_tol=1e-5, abs_tol=1e-9)


PATTERNS = list(
    dict.fromkeys(
        pattern
        for depth in range(1, 6)
        for pattern in (
        tuple(["d"] * depth),
        tuple(["d"] * (depth - 1) + ["c"]),
        tuple(["d"] * (depth - 1) + ["m"]),
        tuple(["d", "v"] * (depth - 1) + ["c"]),
        tuple(["d", "v"] * (depth - 1) + ["d"]),
        tuple(["v", *["d"] * (depth - 1), "c"]),
        tuple(["v", *["d"] * depth]),
        tuple([*["d"] * depth, "v", "d", "c"]),
        tuple([*["d"] * depth, "v", "m"]),
        tuple(["d", *["v", "d"] * depth, "v", "c"]),
        )
    )
)[:40]  # fmt: skip


def random_values(pattern: tuple[str, ...], count: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Flat values as arrays, with every edge of the ranges among them."""

    def edges(values: np.ndarray, *special: float) -> np.ndarray:
        chosen = rng.integers(0, len(special) + 4, values.shape)
        for i, value in enumerate(special):
            values = np.where(chosen == i, value, values)
        return values

    values: dict[str, np.ndarray] = {"exterior": edges(rng.uniform(0.5, 2, (1, count)), 1.0)}
    for i, kind in enumerate(pattern):
        if kind == "v":
            values[f"layer{i}_depth"] = edges(rng.exponential(1, count), 0.0, 100.0)
            values[f"layer{i}_sigma_a"] = edges(rng.exponential(1, (3, count)), 0.0)
            values[f"layer{i}_sigma_s"] = edges(rng.exponential(1, (3, count)), 0.0)
            values[f"layer{i}_g"] = edges(rng.uniform(-0.99, 0.99, count), 0.0, 0.999)
            continue
        values[f"layer{i}_alpha_u"] = edges(rng.uniform(0, 1, count), 0.0, 1.0)
        values[f"layer{i}_alpha_v"] = edges(rng.uniform(0, 1, count), 0.0, 1.0)
        values[f"layer{i}_rotation"] = edges(rng.uniform(-360, 360, count), 0.0)
        if kind != "m":
            values[f"layer{i}_eta"] = edges(rng.uniform(0.3, 3, (3, count)), 1.0, 40.0, 0.05, 1.5)
        if kind == "c":
            values[f"layer{i}_k"] = edges(rng.uniform(0, 8, (3, count)), 0.0, 60.0)
    return values


KINDS = {"d": "dielectric", "c": "conductor", "m": "mirror", "v": "medium"}
VARIANTS = [
    {},
    {"reflectance": "fresnel"},
    {"tir": "clean", "scale": "angles"},
    {"medium": "weighted", "map": "weier"},
    {"reflectance": "fg", "map": "belcour-release"},
    {"reflectance": "split-sum", "lobes": "two"},
    {"map": "weier-2d", "scale": "angles"},
]


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_no_stack_or_direction_gives_nan_or_negative_energy(precision) -> None:
    """10^5 random stacks and directions over 40 layer patterns, with each kind of variance in turn.

    In single precision, as renderers have it, and in double.
    """
    from velatura.model.papers import adding, mixture
    from velatura.model.papers.lobe_merging import merged
    from velatura.model.papers.prepare import prepare
    from velatura.model.variance import Isotropic, PerAxis

    rng = np.random.default_rng(7)
    count = 100_000 // len(PATTERNS)
    assert len(PATTERNS) == 40
    for number, pattern in enumerate(PATTERNS):
        values = {name: value.astype(precision) for name, value in random_values(pattern, count, rng).items()}
        model = named("belcour2018", **VARIANTS[number % len(VARIANTS)])
        variance = (Isotropic, PerAxis, Covariance)[number % 3]
        kinds: Any = [KINDS[kind] for kind in pattern]
        one = Stack.from_flat(kinds, {name: float(np.ravel(value)[0]) for name, value in values.items()})
        material = Material.from_flat(one, values)
        prepared = prepare(material, model, variance)
        cos_theta = np.where(rng.random(count) < 0.2, 10 ** rng.uniform(-7, -1, count), rng.uniform(0, 1, count))
        phi, sin_theta = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - cos_theta**2)
        x, y, z = sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta
        wi = (x.astype(precision), y.astype(precision), z.astype(precision))
        reflected, transmitted = adding.lobes(prepared, wi)
        assert reflected[0].roughness.alpha_u.dtype == precision
        reflected = merged(prepared, reflected)
        for lobe in (*reflected, transmitted):
            assert np.isfinite(lobe.energy).all() and np.min(lobe.energy) >= 0, pattern
            for part in (*lobe.roughness, *lobe.variance.matrix()):
                assert np.isfinite(part).all(), pattern
            assert np.min(lobe.roughness.alpha_u) >= 0 and np.max(lobe.roughness.alpha_u) <= 1
        wo = mixture.sample(reflected, None, wi, *rng.random((3, count)).astype(precision))
        value, pdf = mixture.eval_pdf(reflected, None, wi, wo)
        assert np.isfinite(value).all() and np.min(value) >= 0, pattern
        assert np.isfinite(pdf).all() and np.min(pdf) >= 0, pattern


def test_models_refuse_what_they_do_not_know() -> None:
    with pytest.raises(InvalidInput, match="did you mean belcour2018"):
        named("belcour2019")
    with pytest.raises(InvalidInput, match="tir: must be one of off, published, clean, got 'on'"):
        named("belcour2018", tir="on")
    with pytest.raises(InvalidInput, match="did you mean reflectance"):
        named("belcour2018", reflectanse="fgd")
    with pytest.raises(InvalidInput, match="cos_theta: must lie in 0"):
        stack_lobes(preset("furnace"), [0.5, 1.5])


def test_every_switch_of_every_model_has_a_known_value() -> None:
    for model in MODELS:
        assert all(getattr(model, switch) in values for switch, values in SWITCHES.items())
