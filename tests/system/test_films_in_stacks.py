"""Thin films on the interfaces of a material: files, lobes of all models, the walk, plugins, and what has none yet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.model.registry import MODELS
from velatura.optics import fresnel
from velatura.optics.coatings import Coating, ColouredFilm
from velatura.optics.films import OpticalFilm, coherent
from velatura.stack import dumps, loads, srgb_sensitivity

pytestmark = pytest.mark.usefixtures("one_thread")

COSINES = [1.0, 0.6, 0.3]

ANODISED = """
layers:
  - interface: {eta: [2.7, 2.5, 2.3], k: [3.8, 3.4, 3.1], alpha: [0.1, 0.25], films: [{eta: 2.4, thickness_nm: 60}]}
"""
COATED = """
layers:
  - interface: {eta: 1.5, alpha: 0.05, films: [{eta: 2.0, thickness_nm: 200}]}
  - medium: {sigma_a: [0.1, 0.2, 0.3]}
  - interface: {conductor: Al, alpha: 0.15, films: [{eta: 1.46, thickness_nm: 320}]}
"""
GLASS = """
thin: true
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 1.38, thickness_nm: 100}]}
  - interface: {eta: 1, alpha: 0.05, films: [{eta: 2.2, thickness_nm: 150}, {eta: 1.38, thickness_nm: 90}]}
"""
TINTED = """
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 0.4, k: 2.6, thickness_nm: 15}, {eta: 2.2, thickness_nm: 90}]}
  - interface: {eta: 1, alpha: 0.2, films: [{eta: [1.8, 2, 2.2], k: [0.1, 0.3, 0.5], thickness_nm: 120}]}
"""
OVER_DIFFUSE = """
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 2.2, thickness_nm: 250}]}
  - diffuse: {albedo: [0.2, 0.5, 0.7]}
"""


def white(value: float) -> tuple[float, float, float]:
    return (value, value, value)


def of_thickness(stack: vt.Stack, thickness_nm: float | None) -> vt.Stack:
    """With films of another thickness, or without."""
    layers = []
    for layer in stack.layers:
        if isinstance(layer, vt.Interface):
            films = [film.model_copy(update={"thickness_nm": thickness_nm}) for film in layer.films]
            layer = layer.model_copy(update={"films": () if thickness_nm is None else tuple(films)})
        layers.append(layer)
    return vt.Stack(layers, exterior=stack.exterior, thin=stack.thin)


# Files


@pytest.mark.parametrize("format", ["yaml", "json"])
def test_a_file_keeps_films(format: str) -> None:
    stack = loads(COATED)
    assert loads(dumps(stack, format), name=f"material.{format}") == stack
    assert stack.interfaces[0].films == (vt.Film(eta=2.0, thickness_nm=200),)


def test_flat_names_change_films_and_add_them() -> None:
    stack = loads(COATED).replace(layer0_film0_thickness_nm=120.0, layer0_film1_eta=1.4, layer0_film1_thickness_nm=50)
    assert [film.thickness_nm for film in stack.interfaces[0].films] == [120, 50]
    made = vt.Stack.from_flat(None, {"layer0_conductor": "Al", "layer0_film0_eta": 1.7, "layer0_film0_thickness_nm": 9})
    assert made.interfaces[0].films == (vt.Film(eta=1.7, thickness_nm=9),)


@pytest.mark.parametrize(
    ("interface", "message"),
    [
        ("{eta: 1.5, films: [{eta: 1.4}]}", "films: film 0: thickness_nm: missing"),
        (
            "{eta: 1.5, films: [{eta: 1.4, thickness_nm: 6000}]}",
            "films: film 0: thickness_nm: must lie in 0 to 5000, got 6000",
        ),
        ("{eta: 1.5, films: 3}", "films: must be a list of films, got 3"),
        (
            "{eta: 1, alpha: 0.1, films: [{eta: 1.4, thickness_nm: 9}]}",
            "films: between media whose indices differ by less than 0.001 only where alpha is 0",
        ),
    ],
)
def test_a_wrong_film_gets_one_line(interface: str, message: str) -> None:
    with pytest.raises(vt.InvalidInput) as error:
        loads(f"layers:\n  - interface: {interface}")
    assert str(error.value) == f"material.yaml: layer 0 (interface): {message}"


def test_a_film_that_does_not_exist_gets_one_line() -> None:
    with pytest.raises(vt.InvalidInput, match=r"layer 0 \(interface\): film2_eta: the next film is film 1"):
        loads(COATED).replace(layer0_film2_eta=1.5)


# Lobes


@pytest.mark.parametrize("model", [model.name for model in MODELS])
@pytest.mark.parametrize("material", [COATED, GLASS])
def test_films_of_no_thickness_change_nothing(model: str, material: str) -> None:
    stack = loads(material)
    with_films, without = (vt.lobes(of_thickness(stack, x), COSINES, model=model) for x in (0.0, None))
    assert np.abs(np.array(with_films.energy) - without.energy).max() < 5e-4
    assert np.abs(with_films.passed - without.passed).max() < 5e-4


@pytest.mark.parametrize("model", [model.name for model in MODELS])
def test_a_smooth_interface_reflects_what_its_films_do(model: str) -> None:
    """At the normal, of a metal; on both sides of glass that adds up to the pane."""
    media = white(1.0), (2.7, 2.5, 2.3), (3.8, 3.4, 3.1)
    expected = Coating((ColouredFilm(white(2.4), white(0.0), 60.0),), *media).reflectance(np.ones(1), srgb_sensitivity)
    found = vt.lobes(loads(ANODISED).replace(layer0_alpha=0.0), 1.0, model=model, **_smooth(model)).energy[0]
    assert found[:, 0] == pytest.approx(expected[:, 0], abs=1e-3)
    pane = loads(GLASS).replace(layer0_alpha=0.0, layer1_alpha=0.0)
    upper = Coating((ColouredFilm(white(1.38), white(0.0), 100.0),), white(1.0), white(1.5))
    below = ColouredFilm(white(1.38), white(0.0), 90.0), ColouredFilm(white(2.2), white(0.0), 150.0)
    lower = Coating(below, white(1.0), white(1.5))
    a, b = (x.reflectance(np.ones(1), srgb_sensitivity)[:, 0] for x in (upper, lower))
    lobes = vt.lobes(pane, 1.0, model=model, **_smooth(model))
    assert np.sum(lobes.energy, axis=0)[:, 0] == pytest.approx(a + (1 - a) ** 2 * b / (1 - a * b), abs=2e-3)


def _smooth(model: str) -> dict[str, str]:
    return {"tir": "off"} if model == "belcour2018" else {}


@pytest.mark.parametrize(
    "name", ["anodised-titanium", "coated-lens", "oil-on-wet-asphalt", "pearlescent-paint", "soap-on-varnish"]
)
def test_presets_with_films_have_the_light_of_the_walk(name: str) -> None:
    """All reflected light within .002, and five times the noise of the walk; and each is coloured by its films."""
    truth = vt.reference.statistics(name, 0.8, paths=100_000, seed=2, microsurface=True)
    found = vt.lobes(name, 0.8)
    of_model = (np.sum(found.energy, axis=0) + found.remainder)[:, 0]
    assert truth.standard_error
    noise = np.sqrt(np.sum(np.square(np.reshape(truth.standard_error.energy, (-1, 3))), axis=0))
    assert np.all(np.abs(of_model - np.sum(np.reshape(truth.energy, (-1, 3)), axis=0)) < 2e-3 + 5 * noise)
    bare = vt.lobes(of_thickness(vt.preset(name), None), 0.8)
    without = (np.sum(bare.energy, axis=0) + bare.remainder)[:, 0]
    assert np.ptp(of_model) / of_model.max() > 0.2 + np.ptp(without) / without.max()


@pytest.mark.parametrize("material", [ANODISED, COATED, GLASS, TINTED, OVER_DIFFUSE])
@pytest.mark.parametrize("cosine", [1.0, 0.4])
def test_the_model_has_the_light_of_the_walk(material: str, cosine: float) -> None:
    """Energies of all interfaces, and what passes, within what they err by without films; the noise of the walk is a
    tenth of that."""
    stack = loads(material)
    truth = vt.reference.statistics(stack, cosine, paths=200_000, seed=3)
    found = vt.lobes(stack, cosine, reflectance="fgd")
    of_walk = np.sum(np.reshape(truth.energy, (len(truth.energy), 3)), axis=0)
    of_model = (np.sum(found.energy, axis=0) + found.remainder)[:, 0]
    assert of_model == pytest.approx(of_walk, abs=6e-3)
    if truth.transmitted:
        assert found.passed[:, 0] == pytest.approx(np.reshape(truth.transmitted.energy, 3), abs=6e-3)


ROUGH = {
    "glass": vt.Stack([vt.Interface(eta=1.5, alpha=0.6, films=[vt.Film(eta=2.0, thickness_nm=200)])]),
    "glass from inside": vt.Stack(
        [vt.Interface(eta=1.0, alpha=0.5, films=[vt.Film(eta=2.0, thickness_nm=200)])], exterior=1.5
    ),
    "a small step from inside": vt.Stack(
        [vt.Interface(eta=1.2, alpha=0.4, films=[vt.Film(eta=1.8, thickness_nm=400)])], exterior=1.4
    ),
    "gilt glass": vt.Stack([vt.Interface(eta=1.5, alpha=0.5, films=[vt.Film(eta=0.4, k=2.6, thickness_nm=15)])]),
    "gilt glass from inside": vt.Stack(
        [vt.Interface(eta=1.0, alpha=0.5, films=[vt.Film(eta=0.4, k=2.6, thickness_nm=15)])], exterior=1.5
    ),
    "aluminium": vt.Stack(
        [vt.Interface(conductor="Al", alpha=[0.3, 0.6], films=[vt.Film(eta=1.33, k=0.1, thickness_nm=1200)])]
    ),
}


@pytest.mark.parametrize("name", ROUGH)
def test_light_that_facets_reflect_again_meets_their_films(name: str) -> None:
    """Within what quadrature errs by; the noise of the walk is a quarter of that."""
    stack = ROUGH[name]
    cosines = [1.0, 0.4]
    truth = vt.reference.statistics(stack, cosines, paths=200_000, seed=3, microsurface=True)
    found = vt.lobes(stack, cosines, reflectance="fgd-multi")
    assert found.energy[0] + found.remainder == pytest.approx(truth.energy[0], abs=3.5e-3)
    if truth.transmitted:
        assert found.passed == pytest.approx(truth.transmitted.energy, abs=3.5e-3)


@pytest.mark.parametrize("alpha", [0.005, 0.015])
def test_an_almost_smooth_film_within_reflects_as_a_smooth_one(alpha: float) -> None:
    """Expected: no more than few walks meet its facets again, and these gain no light."""

    def inner(alpha: float) -> list[np.ndarray]:
        films = [{"eta": 2.0, "thickness_nm": 100}]
        between = {"interface": {"eta": 2.12, "alpha": alpha, "films": films}}
        coat, last = ({"interface": {"eta": eta, "alpha": a}} for eta, a in ((1.46, 0.025), (3.5, 0.1)))
        return vt.lobes(vt.Stack.from_dict({"layers": [coat, between, last]}), 1.0).energy

    np.testing.assert_allclose(inner(alpha), inner(0.0), atol=3e-4)


@pytest.mark.parametrize(
    ("name", "reflectance"),
    [(name, x) for name in ("glass", "glass from inside", "aluminium") for x in ("fgd", "fgd-multi")]
    + [("gilt glass", "fgd-multi"), ("gilt glass from inside", "fgd")],
)
def test_averages_of_the_papers_are_those_of_the_films(name: str, reflectance: str) -> None:
    """Of isotropic interfaces; the films of 1,200 nm have the reflectance that bends the most over the angle."""
    stack, cosines = ROUGH[name].replace(layer0_alpha=0.05 if name == "aluminium" else 0.3), [1.0, 0.5, 0.2]
    often = reflectance == "fgd-multi"
    truth = vt.reference.statistics(stack, cosines, paths=200_000, seed=4, microsurface=often)
    found = vt.lobes(stack, cosines, model="belcour2018", tir="off", reflectance=reflectance)
    assert found.energy[0] == pytest.approx(truth.energy[0], abs=4e-3)
    if name == "gilt glass" and often:
        assert truth.transmitted
        assert found.passed == pytest.approx(truth.transmitted.energy, abs=4e-3)


@pytest.mark.parametrize(
    ("interfaces", "accuracy"),
    [
        ([vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=2.2, thickness_nm=250)])], 3e-3),
        ([vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=0.4, k=2.6, thickness_nm=10)])], 7e-3),
        (
            [
                vt.Interface(eta=1.5, alpha=0.1),
                vt.Interface(eta=1.8, alpha=0.3, films=[vt.Film(eta=2.4, thickness_nm=60)]),
            ],
            0.03,
        ),
    ],
)
def test_models_of_the_papers_have_films_over_a_diffuse_base(interfaces: list[vt.Interface], accuracy: float) -> None:
    """Below the first interface, films act at the nodes of directions; the noise of the walk is below .002."""
    stack = vt.Stack([*interfaces, vt.Diffuse(albedo=[0.2, 0.5, 0.9])])
    truth = vt.reference.statistics(stack, COSINES, paths=100_000, seed=6, microsurface=True)
    found = vt.lobes(stack, COSINES, model="belcour2018")
    assert np.sum(found.energy, axis=0) + found.remainder == pytest.approx(np.sum(truth.energy, axis=0), abs=accuracy)


def test_a_mirror_reflects_all_but_what_its_films_absorb() -> None:
    """Over one that absorbs, light passes twice, in colours of its own depth."""
    film = {"eta": 1.5, "thickness_nm": 300}
    clear, tinted = (
        loads("layers:\n  - interface: {conductor: mirror, alpha: 0.1}").replace(
            **{f"layer0_film0_{key}": value for key, value in each.items()}
        )
        for each in (film, {**film, "k": 0.1})
    )
    assert clear.to_dict()["layers"][0]["interface"]["conductor"] == "mirror" and clear.layers[0].lossless
    assert vt.lobes(clear, COSINES).energy[0] == pytest.approx(np.ones((3, 3)), abs=2e-3)
    nm = np.arange(360.0, 831.0)
    weights = srgb_sensitivity(nm)
    exact = coherent(np.array(1.0), nm, 1.0, [OpticalFilm(1.5, 0.1, 300.0)], 1e-3, 1e6).reflected
    assert vt.lobes(tinted.replace(layer0_alpha=0.0), 1.0).energy[0][:, 0] == pytest.approx(
        weights @ exact / weights.sum(axis=1), abs=2e-3
    )
    assert tinted.replace(layer0_eta=2.0, layer0_k=1.0).interfaces[0].k == 1


SOAP = """
layers:
  - interface: {eta: 1, films: [{eta: 1.33, thickness_nm: 400}]}
"""
BELOW_SOAP = SOAP + "  - interface: {conductor: Al, alpha: 0.2}"


@pytest.mark.parametrize("model", [model.name for model in MODELS if model.reflectance != "split-sum"])
def test_a_film_in_air_reflects_as_it_does_alone(model: str) -> None:
    film = Coating((ColouredFilm(white(1.33), white(0.0), 400.0),), white(1.0), white(1.0))
    exact = film.reflectance(np.array(COSINES), srgb_sensitivity)
    found = vt.lobes(loads(SOAP), COSINES, model=model, **_smooth(model))
    assert found.energy[0] == pytest.approx(exact, abs=1e-3)
    assert found.passed == pytest.approx(1 - exact, abs=1e-3)


@pytest.mark.parametrize("cosine", [1.0, 0.4])
def test_a_film_in_air_lies_above_others(cosine: float) -> None:
    """As the walk has it, whose noise is a fifth of what is allowed."""
    truth = vt.reference.statistics(loads(BELOW_SOAP), cosine, paths=200_000, seed=5)
    found = vt.lobes(loads(BELOW_SOAP), cosine, reflectance="fgd")
    for mine, walked in zip(found.energy, truth.energy):
        assert mine[:, 0] == pytest.approx(np.ravel(walked), abs=4e-3)


def test_clear_films_keep_all_light() -> None:
    lobes = vt.lobes(loads(GLASS), COSINES)
    assert np.abs(lobes.absorbed).max() < 1e-3


# In Mitsuba


@pytest.fixture(scope="module")
def mi() -> Any:
    found = kernel.mitsuba("llvm_ad_rgb")
    vt.register()
    return found


def albedo(mi: Any, bsdf: Any, cosine: float) -> np.ndarray:
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.wi = mi.Vector3f(float(np.sqrt(1 - cosine * cosine)), 0.0, cosine)
    dr.make_opaque(si.wi)  # one kernel for all angles
    return np.array(bsdf.eval_diffuse_reflectance(si)).ravel()


@pytest.mark.parametrize(
    ("model", "material"),
    [(model, material) for model in ("velatura", "belcour2018") for material in (COATED, GLASS)]
    + [("velatura", TINTED)],
)
def test_a_plugin_has_the_energies_of_the_lobes(mi: Any, model: str, material: str) -> None:
    stack = loads(material)
    lobes = vt.lobes(stack, 0.6, model=model)
    whole = np.sum(lobes.energy, axis=0) + lobes.remainder + lobes.passed
    assert albedo(mi, vt.bsdf(stack, model=model), 0.6) == pytest.approx(whole[:, 0], abs=5e-3)


def test_films_lie_under_a_textured_roughness(mi: Any, tmp_path: Path) -> None:
    """The albedo of a texture of one value is that of the value."""
    path = tmp_path / "roughness.png"
    mi.util.write_bitmap(str(path), np.repeat([[[0.3]], [[0.5]]], 2, axis=1).astype(np.float32), write_async=False)
    for model in ("velatura", "belcour2018"):
        texture = {"texture": str(path), "scale": 0.0, "offset": 0.1}
        textured, plain = (loads(ANODISED).replace(layer0_alpha=x) for x in (texture, 0.1))
        assert albedo(mi, vt.bsdf(textured, model=model), 0.6) == pytest.approx(
            albedo(mi, vt.bsdf(plain, model=model), 0.6), abs=5e-3
        )


def test_light_from_below_meets_the_films_in_their_order(mi: Any) -> None:
    """What a pane reflects from below is what the same pane, turned over, reflects from above."""
    stack = loads(GLASS)
    first, last = stack.interfaces
    over = vt.Stack(
        [
            vt.Interface(eta=1.5, alpha=last.alpha, films=last.films[::-1]),
            vt.Interface(eta=1.0, alpha=first.alpha, films=first.films[::-1]),
        ],
        thin=True,
    )
    for name in ("velatura", "weier2020", "reference"):
        below, above = sampled(mi, vt.bsdf(stack, model=name), -0.6), sampled(mi, vt.bsdf(over, model=name), 0.6)
        assert below == pytest.approx(above, abs=0.01)


def test_films_that_absorb_reflect_less_from_one_side(mi: Any) -> None:
    """As much of either side as the walk, whose noise is a third of what is allowed."""
    stack = loads(TINTED)
    found, walked = (
        [sampled(mi, vt.bsdf(stack, **which), cosine) for cosine in (0.7, -0.7)]
        for which in ({"reflectance": "fgd"}, {"model": "reference"})
    )
    assert np.all(np.subtract(*walked) > 0.05)
    assert np.array(found) == pytest.approx(np.array(walked), abs=6e-3)


def sampled(mi: Any, bsdf: Any, cosine: float) -> np.ndarray:
    """The mean weight of samples that are reflected: 40,000, whose noise is a fifth of what is allowed."""
    import drjit as dr

    count = 40_000
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(float(np.sqrt(1 - cosine * cosine)), 0.0, cosine)
    dr.make_opaque(si.wi)  # one kernel for all angles
    rng = mi.PCG32(count)
    u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    bs, weight = bsdf.sample(mi.BSDFContext(), si, *u)
    return np.array(dr.mean(dr.select(bs.wo.z * si.wi.z > 0, weight, 0), axis=1)).ravel()


def test_an_index_that_changes_changes_the_films(mi: Any) -> None:
    bsdf = vt.bsdf(loads(COATED), model="belcour2018")
    parameters = mi.traverse(bsdf)
    parameters["layer0_eta"] = mi.Float(1.8)
    parameters.update()
    other = vt.bsdf(loads(COATED).replace(layer0_eta=1.8), model="belcour2018")
    assert albedo(mi, bsdf, 0.6) == pytest.approx(albedo(mi, other, 0.6), abs=1e-4)


def test_a_scene_may_name_films(mi: Any) -> None:
    flat = {"layer0_conductor": "Al", "layer0_alpha": 0.2, "layer0_film0_eta": 1.7, "layer0_film0_thickness_nm": 90}
    named = kernel.load_dict({"type": "layered", **flat})
    assert albedo(mi, named, 0.6) == pytest.approx(albedo(mi, vt.bsdf(vt.Stack.from_flat(None, flat)), 0.6), abs=1e-5)
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2, 1), 1.7, np.float32)), "raw": True}
    textured = kernel.load_dict({"type": "layered", **flat, "layer0_film0_eta": texture})
    assert albedo(mi, named, 0.6) == pytest.approx(albedo(mi, textured, 0.6), abs=1e-3)


# What has no films yet


def test_what_has_no_films_says_so(mi: Any) -> None:
    with pytest.raises(vt.InvalidInput, match=r"layer 0 \(interface\): films: .* no thin films yet"):
        vt.bsdf(loads(COATED), model="weidlich_wilkie")


def test_fresnel_without_films_stays() -> None:
    found = vt.lobes(vt.Stack([vt.Interface(eta=1.5, alpha=0.0)]), [1.0, 0.5], reflectance="fgd").energy[0]
    assert found[0] == pytest.approx(fresnel.dielectric(np.array([1.0, 0.5]), 1.5), abs=1e-6)


@pytest.mark.parametrize("model", ["belcour2018", "bati2021"])
@pytest.mark.parametrize("k", [0.0, 0.2])
def test_separate_channels_have_films_within(model: str, k: float) -> None:
    """Each channel is that of a stack whose other channels have its values, too."""
    within = vt.Interface(eta=1.9, alpha=0.1, films=[vt.Film(eta=1.4, k=k, thickness_nm=200)])
    metal = vt.Interface(conductor="Au", alpha=0.2, films=[vt.Film(eta=1.8, thickness_nm=300)])

    def energies(depths: tuple[float, float, float]) -> np.ndarray:
        stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Medium(sigma_a=depths), within, metal])
        return np.array(vt.lobes(stack, [1, 0.5, 0.2], model=model, channels="separate").energy)

    depths = (0.1, 0.4, 1.6)
    found = energies(depths)
    for c, depth in enumerate(depths):
        assert found[:, c] == pytest.approx(energies((depth,) * 3)[:, c], abs=1e-12)
