"""Thin films of values that change in a renderer: gradients, textures of thickness, and other variants."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from images import write_image

import velatura as vt
from velatura import kernel
from velatura.model.solved import solve
from velatura.optics.films import OpticalFilm, coherent
from velatura.renderer.packets import aligned
from velatura.stack import luminance_sensitivity, srgb_weights

pytestmark = pytest.mark.usefixtures("one_thread")

COATED = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.05, films=[vt.Film(eta=2.0, thickness_nm=200)]),
        vt.Medium(sigma_a=(0.1, 0.2, 0.3)),
        vt.Interface(conductor="Al", alpha=0.15, films=[vt.Film(eta=1.46, thickness_nm=320)]),
    ]
)
PANE = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=1.38, thickness_nm=100)]),
        vt.Interface(eta=1, alpha=0.05, films=[vt.Film(eta=2.2, thickness_nm=150), vt.Film(eta=1.38, thickness_nm=90)]),
    ],
    thin=True,
)
GILT = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=0.4, k=2.6, thickness_nm=15)]),
        vt.Interface(eta=1, alpha=0.05, films=[vt.Film(eta=2.2, k=0.2, thickness_nm=150)]),
    ]
)
OXIDE = vt.Stack([vt.Interface(conductor="Al", alpha=0.2, films=[vt.Film(eta=1.7, thickness_nm=300)])])
TWO = OXIDE.replace(layer0_films=[vt.Film(eta=2.2, thickness_nm=150), vt.Film(eta=1.38, thickness_nm=90)])


@pytest.fixture(scope="module", autouse=True)
def mi() -> Iterator[Any]:
    yield kernel.mitsuba("llvm_ad_rgb")
    kernel.mitsuba("llvm_ad_rgb")


def lit(mi: Any, cosine: float, u: Any = 0.5) -> Any:
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, np.size(u))
    si.wi = mi.Vector3f(float(np.sqrt(1 - cosine * cosine)), 0.0, cosine)
    dr.make_opaque(si.wi)  # one kernel for all angles
    si.uv = mi.Point2f(mi.Float(aligned(np.atleast_1d(u))), 0.5)
    return si


def albedo(mi: Any, bsdf: Any, cosine: float, u: Any = 0.5) -> np.ndarray:
    return np.array(bsdf.eval_diffuse_reflectance(lit(mi, cosine, u)))


def value(mi: Any, bsdf: Any, u: Any = 0.5) -> Any:
    return bsdf.eval(mi.BSDFContext(), lit(mi, 0.8, u), mi.Vector3f(-0.55, 0.1, float(np.sqrt(0.6875))))


def test_films_are_listed_by_flat_names(mi: Any) -> None:
    parameters = mi.traverse(vt.bsdf(OXIDE))
    assert float(parameters["layer0_film0_thickness_nm"][0]) == 300
    assert "layer0_film0_eta" in parameters and "layer0_film0_k" in parameters


@pytest.mark.parametrize(
    ("model", "stack", "name", "step"),
    [
        ("velatura", COATED, "layer0_film0_thickness_nm", 1.0),
        ("velatura", COATED, "layer0_film0_eta", 0.005),
        ("velatura", COATED, "layer0_eta", 0.02),
        ("velatura", PANE, "layer1_film1_thickness_nm", 1.0),
        ("velatura", GILT, "layer0_film0_k", 0.05),
        ("velatura", PANE, "layer0_film0_k", 0.005),
        ("belcour2018", COATED, "layer0_film0_thickness_nm", 1.0),
        ("belcour2018", OXIDE, "layer0_film0_eta", 0.005),
    ],
)
def test_gradients_are_finite_differences(
    mi: Any, model: str, stack: vt.Stack, name: str, step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Values are solved as finely as those of gradients."""
    import drjit as dr

    facets, normals = 377, 610
    monkeypatch.setattr(solve, "FINELY", (facets, normals))
    monkeypatch.setattr(solve, "SAMPLES", facets)
    monkeypatch.setattr(solve, "NORMALS", dict.fromkeys(solve.NORMALS, normals))
    bsdf = vt.bsdf(stack, model=model, reflectance="fgd")
    parameters = mi.traverse(bsdf)
    start = np.ravel(np.array(parameters[name])).tolist()[0]

    def at(x: Any) -> Any:
        parameters[name] = mi.Float(x)
        parameters.update()
        return value(mi, bsdf)

    ends = max(start - step, 0.0), start + step
    low, high = (np.array(at(x)).ravel() for x in ends)
    variable = mi.Float(start)
    dr.enable_grad(variable)
    found = at(variable)
    dr.forward(variable)
    assert np.ravel(dr.grad(found)) == pytest.approx((high - low) / (ends[1] - ends[0]), rel=0.06, abs=4e-4)


def grey(path: Path, ends: tuple[float, float]) -> str:
    """An image from one value to another, which a texture interpolates between a quarter and three of its width."""
    return write_image(np.array([[[ends[0]], [ends[1]]]] * 2, np.float32), path)


Spans = dict[str, tuple[float, float]]


def of_textures(stack: vt.Stack, spans: Spans, image: str, share: float = 0.5) -> tuple[vt.Stack, vt.Stack]:
    """A stack at a share of spans, each an offset and a scale, and with textures that have them."""
    uniform = {name: offset + share * scale for name, (offset, scale) in spans.items()}
    textures = {name: {"texture": image, "offset": low, "scale": scale} for name, (low, scale) in spans.items()}
    return stack.replace(**uniform), stack.replace(**textures)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
def test_a_texture_of_thickness_is_the_material_of_each_thickness(mi: Any, model: str, tmp_path: Path) -> None:
    """Of four fringes; energies and values within .003 of what is reflected the most."""
    texture = {"texture": grey(tmp_path / "t.exr", (0.0, 1.0)), "scale": 500.0, "offset": 100.0}
    textured = vt.bsdf(OXIDE.replace(layer0_film0_thickness_nm=texture), model=model, reflectance="fgd")
    thicknesses = np.array([103.0, 264.0, 555.5])
    u = 0.25 + 0.5 * (thicknesses - 100) / 500
    albedos, values = [albedo(mi, textured, cosine, u) for cosine in (1.0, 0.4)], np.array(value(mi, textured, u))
    for k, thickness in enumerate(thicknesses.tolist()):
        uniform = vt.bsdf(OXIDE.replace(layer0_film0_thickness_nm=thickness), model=model, reflectance="fgd")
        for cosine, found in zip((1.0, 0.4), albedos):
            assert found[:, k] == pytest.approx(albedo(mi, uniform, cosine)[:, 0], abs=3e-3)
        assert values[:, k] == pytest.approx(np.array(value(mi, uniform))[:, 0], abs=3e-3 * float(values.max()))


@pytest.mark.parametrize(
    ("stack", "cosine", "spans"),
    [
        (COATED, 0.8, {"layer2_film0_thickness_nm": (100.0, 500.0)}),
        (COATED, 0.8, {"layer0_eta": (1.2, 0.6), "layer2_film0_eta": (1.3, 0.5)}),
        (GILT, -0.6, {"layer0_film0_k": (2.0, 1.0)}),
    ],
)
def test_the_walk_has_textures_of_films(mi: Any, stack: vt.Stack, cosine: float, spans: Spans, tmp_path: Path) -> None:
    """Its paths are the same as those of the uniform material, to rounding and to the error of the fixed quadrature."""
    uniform, textured = (
        vt.bsdf(each, model="reference") for each in of_textures(stack, spans, grey(tmp_path / "t.exr", (0.0, 1.0)))
    )
    count, found = 20_000, []
    for bsdf in (uniform, textured):
        rng = mi.PCG32(count)
        u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        weight = bsdf.sample(mi.BSDFContext(), lit(mi, cosine, np.full(count, 0.5)), *u)[1]
        found.append(np.mean(np.array(weight), axis=1))
    assert found[0] == pytest.approx(found[1], abs=1e-3)


@pytest.mark.parametrize(
    ("model", "stack", "spans"),
    [
        ("velatura", OXIDE, {"layer0_film0_eta": (1.3, 0.9)}),
        ("velatura", OXIDE, {"layer0_eta": (1.0, 1.0), "layer0_film0_k": (0.0, 0.5)}),
        ("velatura", PANE, {"layer1_film0_eta": (2.0, 0.5)}),
        ("velatura", COATED, {"layer0_eta": (1.3, 0.5)}),
        ("velatura", TWO, {"layer0_film0_thickness_nm": (140.0, 30.0), "layer0_film1_thickness_nm": (80.0, 20.0)}),
        ("belcour2018", OXIDE, {"layer0_film0_eta": (1.3, 0.9)}),
        ("belcour2018", COATED, {"layer0_eta": (1.3, 0.5)}),
    ],
)
def test_textures_of_films_are_the_material_of_each_value(
    mi: Any, model: str, stack: vt.Stack, spans: Spans, tmp_path: Path
) -> None:
    """Energies within .003, and values within .02 of the largest: a pane reflects red beyond sRGB."""
    image = grey(tmp_path / "t.exr", (0.0, 1.0))
    uniform, textured = (
        vt.bsdf(each, model=model, reflectance="fgd") for each in of_textures(stack, spans, image, 0.33)
    )
    u = 0.25 + 0.5 * 0.33
    for cosine in (1.0, 0.4):
        assert albedo(mi, textured, cosine, u) == pytest.approx(albedo(mi, uniform, cosine), abs=3e-3)
    expected = np.array(value(mi, uniform))
    assert np.array(value(mi, textured, u)) == pytest.approx(expected, abs=0.02 * float(expected.max()))


def test_a_colour_that_a_film_hardly_reflects_stays_dark_in_a_texture(mi: Any, tmp_path: Path) -> None:
    """Red, of a pane; the noise of samples is a third of what is allowed."""
    spans, found = {"layer1_film0_thickness_nm": (140.0, 30.0)}, []
    stacks = of_textures(PANE, spans, grey(tmp_path / "t.exr", (0.0, 1.0)), 0.2)
    count, si = 200_000, lit(mi, 0.8, np.full(200_000, 0.35))
    for bsdf in (vt.bsdf(stack, reflectance="fgd") for stack in stacks):
        rng = mi.PCG32(count)
        u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        bs, weight = bsdf.sample(mi.BSDFContext(), si, *u)
        found.append(np.mean(np.array(weight)[:, np.array(bs.wo.z) > 0], axis=1) * np.mean(np.array(bs.wo.z) > 0))
    assert found[1] == pytest.approx(found[0], abs=3e-3)


def test_each_colour_has_its_own_index_from_a_texture(mi: Any, tmp_path: Path) -> None:
    texels = np.array([[[0.1, 0.5, 0.9]]] * 2, np.float32)
    write_image(texels, tmp_path / "t.exr")
    texture = {"texture": str(tmp_path / "t.exr"), "scale": 0.5, "offset": 1.4}
    textured, uniform = (
        vt.bsdf(OXIDE.replace(layer0_film0_eta=eta)) for eta in (texture, tuple((1.4 + 0.5 * texels[0, 0]).tolist()))
    )
    assert np.array(value(mi, textured)) == pytest.approx(np.array(value(mi, uniform)), rel=2e-3)


@pytest.mark.parametrize("film", [0, 2])
def test_light_from_below_meets_the_film_that_has_a_texture(mi: Any, film: int, tmp_path: Path) -> None:
    """Among others, in either order."""
    films = [vt.Film(eta=eta, thickness_nm=120) for eta in (2.2, 1.38, 1.8)]
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.1, films=films)])
    image = grey(tmp_path / "t.exr", (0.0, 1.0))
    spans = {f"layer0_film{film}_thickness_nm": (100.0, 200.0)}
    uniform, textured = (vt.bsdf(each, model="weier2020") for each in of_textures(stack, spans, image))
    si, wo = lit(mi, -0.8), mi.Vector3f(-0.6, 0.02, -0.8)
    found, expected = (np.array(bsdf.eval(mi.BSDFContext(), si, wo)) for bsdf in (textured, uniform))
    assert found == pytest.approx(expected, abs=0.02 * float(expected.max()))


@pytest.mark.parametrize(
    ("key", "offset", "scale"), [("film0_thickness_nm", 100.0, 300.0), ("film0_eta", 1.4, 0.5), ("eta", 1.0, 0.5)]
)
def test_texels_beside_films_have_gradients(mi: Any, key: str, offset: float, scale: float, tmp_path: Path) -> None:
    import drjit as dr

    texture = {"texture": grey(tmp_path / "t.exr", (0.45, 0.55)), "scale": scale, "offset": offset}
    bsdf = vt.bsdf(OXIDE.replace(layer0_k=5.0, layer0_eta=1.0).replace(**{f"layer0_{key}": texture}))
    parameters = mi.traverse(bsdf)
    name = f"layer0_{key}.data"
    texels = np.array(parameters[name])

    def at(step: float) -> np.ndarray:
        parameters[name] = mi.TensorXf((texels + step).astype(np.float32))
        parameters.update()
        return np.array(value(mi, bsdf)).ravel()

    expected = (at(0.01) - at(-0.01)) / 0.02
    step = mi.Float(0.0)
    dr.enable_grad(step)
    parameters[name] = mi.TensorXf(mi.Float(aligned(texels.ravel())) + step, texels.shape)
    parameters.update()
    found = value(mi, bsdf)
    dr.forward(step)
    assert np.ravel(dr.grad(found)) == pytest.approx(expected, rel=0.05, abs=5e-3)


@pytest.mark.parametrize("model", ["velatura", "belcour2018", "reference"])
def test_monochromatic_variants_have_the_luminance_of_films(model: str) -> None:
    """Of one index for all colours; the noise of the walk is a third of what is allowed."""
    mono = kernel.mitsuba("llvm_ad_mono")
    stack = vt.Stack([vt.Interface(eta=2.0, k=1.0, alpha=0.02, films=[vt.Film(eta=1.5, thickness_nm=400)])])
    nm = np.arange(360.0, 831.0)
    weights = luminance_sensitivity(nm)[0]
    exact = coherent(np.array(0.8), nm, 1.0, [OpticalFilm(1.5, 0.0, 400.0)], 2.0, 1.0).reflected
    rng = mono.PCG32(40_000)
    u = rng.next_float32(), mono.Point2f(rng.next_float32(), rng.next_float32())
    _, weight = vt.bsdf(stack, model=model).sample(mono.BSDFContext(), lit(mono, 0.8, np.full(40_000, 0.5)), *u)
    assert np.mean(np.array(weight)) == pytest.approx(float(weights @ exact / weights.sum()), abs=3e-3)


# At the wavelengths of a ray

RAY = (405.0, 460.0, 530.0, 640.0)
FGD = {"reflectance": "fgd"}


@pytest.fixture()
def spectral() -> Iterator[Any]:
    yield kernel.mitsuba("llvm_ad_spectral")
    kernel.mitsuba("llvm_ad_rgb")


def at_wavelengths(mi: Any, cosine: float, nm: Any = RAY, count: int = 1) -> Any:
    si = lit(mi, cosine, np.full(count, 0.5))
    si.wavelengths = mi.UnpolarizedSpectrum(*nm)
    return si


def drawn(mi: Any, bsdf: Any, cosine: float, count: int = 60_000) -> np.ndarray:
    """Mean weights of samples that are reflected, and of those that pass."""
    import drjit as dr

    rng = mi.PCG32(count)
    u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    context = mi.BSDFContext(mi.TransportMode.Importance)
    si = at_wavelengths(mi, cosine, count=count)
    bs, weight = bsdf.sample(context, si, *u)
    reflected = bs.wo.z * si.wi.z > 0
    both = (dr.select(reflected, weight, 0), dr.select(reflected, 0, weight))
    return np.array([np.mean(np.array(x), axis=1) for x in both])


@pytest.mark.parametrize(("thickness_nm", "cosine"), [(400.0, 0.8), (1000.0, 1.0)])
def test_films_reflect_each_wavelength_by_itself(spectral: Any, thickness_nm: float, cosine: float) -> None:
    """Queried energies and weights of samples of a metal that is almost smooth, which moves waves by little."""
    film = vt.Film(eta=1.5, thickness_nm=thickness_nm)
    stack = vt.Stack([vt.Interface(eta=2.0, k=1.0, alpha=0.004, films=[film])])
    exact = coherent(np.array(cosine), np.array(RAY), 1.0, [OpticalFilm(1.5, 0.0, thickness_nm)], 2.0, 1.0).reflected
    bsdf = vt.bsdf(stack)
    energies = np.ravel(bsdf.eval_diffuse_reflectance(at_wavelengths(spectral, cosine)))
    assert energies == pytest.approx(exact, abs=5e-3)
    assert drawn(spectral, bsdf, cosine)[0] == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize(
    ("stack", "cosine"),
    [
        (COATED, 0.4),
        (PANE, 0.8),
        (PANE, -0.6),
        (COATED.replace(layer0_film0_thickness_nm=2000.0), 0.8),
        (COATED.replace(layer0_alpha=0.0, layer2_alpha=0.0), 0.5),
        (GILT, -0.6),
    ],
)
def test_the_model_has_the_spectrum_of_the_walk(spectral: Any, stack: vt.Stack, cosine: float) -> None:
    """Within what lobes of colours differ by from those of the walk, whose noise is a sixth of that."""
    found, expected = (drawn(spectral, vt.bsdf(stack, **which), cosine) for which in (FGD, {"model": "reference"}))
    assert found == pytest.approx(expected, abs=6e-3)


def test_spectra_of_films_add_up_to_their_colours(mi: Any) -> None:
    """Under D65, of indices that are the same for all wavelengths and colours."""
    stack = vt.Stack([vt.Interface(eta=2.5, k=2.0, alpha=0.1, films=[vt.Film(eta=1.6, thickness_nm=350)])])
    colour = albedo(kernel.mitsuba("llvm_ad_rgb"), vt.bsdf(stack), 0.7)[:, 0]
    spectral = kernel.mitsuba("llvm_ad_spectral")
    nm, weights = srgb_weights()
    si = lit(spectral, 0.7, np.full(len(nm), 0.5))
    si.wavelengths = spectral.Spectrum(*[spectral.Float(nm)] * 4)
    assert weights @ np.array(vt.bsdf(stack).eval_diffuse_reflectance(si))[0] == pytest.approx(colour, abs=3e-3)


@pytest.mark.parametrize("name", ["layer0_film0_thickness_nm", "layer0_alpha"])
def test_textures_beside_films_have_spectra(spectral: Any, name: str, tmp_path: Path) -> None:
    low, step = (250.0, 100.0) if name.endswith("nm") else (0.1, 0.2)
    texture = {"texture": grey(tmp_path / "t.exr", (0.0, 1.0)), "scale": step, "offset": low}
    textured, uniform = (vt.bsdf(OXIDE.replace(**{name: x})) for x in (texture, low + 0.5 * step))
    found, expected = (
        np.ravel(bsdf.eval_diffuse_reflectance(at_wavelengths(spectral, 0.6))) for bsdf in (textured, uniform)
    )
    assert found == pytest.approx(expected, abs=3e-3)


def test_polarised_variants_leave_light_unpolarised(spectral: Any) -> None:
    wo = [-0.55, 0.1, float(np.sqrt(0.6875))]
    plain = np.ravel(vt.bsdf(OXIDE).eval(spectral.BSDFContext(), at_wavelengths(spectral, 0.8), spectral.Vector3f(*wo)))
    mi = kernel.mitsuba("llvm_ad_spectral_polarized")
    found = np.array(vt.bsdf(OXIDE).eval(mi.BSDFContext(), at_wavelengths(mi, 0.8), mi.Vector3f(*wo)))
    assert found[0, 0].ravel() == pytest.approx(plain, rel=1e-4)
    assert np.abs(found).sum() == pytest.approx(np.abs(found[0, 0]).sum())
