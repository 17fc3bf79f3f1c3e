"""Parameters of other programs as stacks: each against the formulas that define them, worked out here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import imports, kernel
from velatura.programs.gltf import read as gltf
from velatura.programs.openpbr import read as openpbr
from velatura.programs.principled import read as principled
from velatura.programs.standard_surface import read as standard_surface
from velatura.renderer.low_discrepancy import square


def fresnel(cosine: float, index: Any) -> Any:
    """Reflectance of unpolarised light at a smooth boundary from air, of a complex index."""
    index = np.asarray(index, complex)
    inside = np.sqrt(index**2 - 1 + cosine**2)
    s = (cosine - inside) / (cosine + inside)
    p = (index**2 * cosine - inside) / (index**2 * cosine + inside)
    return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)


def index_of(layer: Any) -> Any:
    return np.array(layer.eta) + 1j * np.array(layer.k or 0.0)


def kept_inside(eta: float) -> float:
    """The share of light from a diffuse base that a smooth boundary sends back down."""
    cosines = (np.arange(20000) + 0.5) / 20000
    outside = np.sum(2 * cosines * fresnel(cosines, eta)) / 20000
    return float(1 - (1 - outside) / eta**2)


def reflected(stack: vt.Stack) -> Any:
    """All light reflected at the normal, by colours."""
    found = vt.lobes(stack, 1.0)
    return np.sum([energy[:, 0] for energy in found.energy], axis=0) + found.remainder[:, 0]


# Metals --------------------------------------------------------------------------------------------------------------


def test_a_metal_has_its_colours_at_the_normal_and_at_82_degrees() -> None:
    """Expected: F0 and the tinted Schlick curve at the cosine 1/7 (OpenPBR 1.1, "Metal"), by Fresnel's formulas."""
    f0, tint = np.array([0.95, 0.64, 0.38]), np.array([1.0, 0.93, 0.85])
    found = vt.from_openpbr(base_metalness=1, base_color=f0, specular_color=tint, specular_roughness=0)
    (metal,) = found.stack.layers
    edge = tint * (f0 + (1 - f0) * (6 / 7) ** 5)
    np.testing.assert_allclose(fresnel(1.0, index_of(metal)), f0, atol=1e-5)
    np.testing.assert_allclose(fresnel(1 / 7, index_of(metal)), edge, atol=1e-4)
    assert found.left == () and metal.kind == "conductor"


def test_an_edge_that_no_metal_has_is_listed() -> None:
    """Expected: the metal that reflects least there, which is one without extinction."""
    found = vt.from_openpbr(base_metalness=1, base_color=0.5, specular_color=0.2)
    assert found.stack.interfaces[0].k == pytest.approx((0, 0, 0), abs=1e-2)
    assert [each.parameter for each in found.left] == ["specular_color"]


def test_weights_multiply_the_colour_of_a_metal() -> None:
    found = vt.from_openpbr(base_metalness=1, base_color=0.8, base_weight=0.5, specular_weight=0.7)
    np.testing.assert_allclose(fresnel(1.0, index_of(found.stack.layers[0])), 0.28, atol=1e-5)


def test_a_white_metal_is_a_mirror() -> None:
    assert vt.from_openpbr(base_metalness=1, base_color=1).stack.kinds == ("mirror",)
    assert vt.from_openpbr(base_metalness=1, base_color=1, thin_film_weight=1).stack.kinds == ("conductor",)


def test_edge_tints_of_standard_surface_are_artists_indices() -> None:
    """Expected: n by the tint between its bounds, and k by the reflectance (Gulbrandsen 2014)."""
    r, g = 0.6, 0.3
    found = imports.from_standard_surface(metalness=1, base=1, base_color=r, specular=1, specular_color=g)
    n = g * (1 - r) / (1 + r) + (1 - g) * (1 + np.sqrt(r)) / (1 - np.sqrt(r))
    k = np.sqrt((r * (n + 1) ** 2 - (n - 1) ** 2) / (1 - r))
    metal = found.stack.interfaces[0]
    np.testing.assert_allclose([metal.eta, metal.k], [[n] * 3, [k] * 3], rtol=1e-5)


# Roughness -----------------------------------------------------------------------------------------------------------


def test_roughness_is_the_root_of_alpha_and_stretched_along_the_tangent() -> None:
    """Expected: alpha_t = r^2 sqrt(2 / (1 + (1 - a)^2)), alpha_b = (1 - a) alpha_t (OpenPBR 1.1)."""
    found = vt.from_openpbr(base_metalness=1, specular_roughness=0.4, specular_roughness_anisotropy=0.6)
    along = 0.16 * np.sqrt(2 / (1 + 0.16))
    np.testing.assert_allclose(found.stack.interfaces[0].alpha, [along, 0.4 * along], rtol=1e-5)


@pytest.mark.parametrize(
    ("made", "alpha", "rotation"),
    [
        (
            lambda: imports.from_standard_surface(
                metalness=1, specular_roughness=0.5, specular_anisotropy=0.75, specular_rotation=0.25
            ),
            (0.5, 0.125),
            90,
        ),
        (
            lambda: imports.from_gltf(
                {
                    "pbrMetallicRoughness": {"roughnessFactor": 0.5, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
                    "extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 0.5}},
                }
            ),
            (0.25 + 0.25 * 0.75, 0.25),
            np.degrees(0.5),
        ),
        (
            lambda: imports.from_principled(
                {"type": "principled", "metallic": 1.0, "roughness": 0.5, "anisotropic": 0.8}
            ),
            (0.25 / np.sqrt(0.28), 0.25 * np.sqrt(0.28)),
            0,
        ),
    ],
)
def test_every_source_stretches_by_its_own_rule(made: Any, alpha: Any, rotation: float) -> None:
    (metal,) = made().stack.interfaces
    np.testing.assert_allclose(metal.alpha, alpha, rtol=1e-5)
    assert metal.rotation == pytest.approx(rotation)


# Diffuse bases -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("eta", [1.3, 1.5, 2.0])
def test_a_diffuse_base_is_seen_in_its_colour(eta: float) -> None:
    """Expected: of what enters at the normal the share base_color comes back (OpenPBR 1.1, "Glossy-diffuse"): the base
    is lighter by what a smooth interface keeps of it.
    """
    c = np.array([0.1, 0.5, 0.9])
    found = vt.from_openpbr(base_color=c, specular_ior=eta, specular_roughness=0)
    assert found.stack.base
    k = kept_inside(eta)
    np.testing.assert_allclose(found.stack.base.albedo, c / (1 - k + c * k), atol=2e-3)
    f = fresnel(1.0, eta)
    np.testing.assert_allclose(reflected(found.stack), f + (1 - f) * c, atol=1e-3)


def test_a_rough_one_is_too() -> None:
    found = vt.from_openpbr(base_color=0.5, specular_roughness=0.8)
    black = reflected(found.stack.replace(layer1_albedo=0.0))
    np.testing.assert_allclose(reflected(found.stack), black + (1 - black) * 0.5, atol=1e-3)


def test_weights_modulate_the_index() -> None:
    """Expected: the reflectance at the normal times the weight and the tint (OpenPBR 1.1, "Dielectric base")."""
    found = vt.from_openpbr(specular_weight=0.5, specular_color=(1.0, 0.5, 0.25), specular_roughness=0)
    (interface,) = found.stack.interfaces
    np.testing.assert_allclose(fresnel(1.0, interface.eta), 0.04 * np.array([0.5, 0.25, 0.125]), rtol=1e-3)
    assert [each.parameter for each in found.left] == ["specular_color"]
    assert vt.from_openpbr(specular_weight=0).stack.kinds == ("diffuse",)


def test_scattering_below_is_mixed_into_the_colour() -> None:
    found = vt.from_openpbr(specular_weight=0, base_color=0.2, subsurface_weight=0.25, subsurface_color=(0.6, 0.2, 0.2))
    assert found.stack.base
    np.testing.assert_allclose(found.stack.base.albedo, [0.3, 0.2, 0.2])
    assert [each.parameter for each in found.left] == ["subsurface_weight"]


# Coats ---------------------------------------------------------------------------------------------------------------


def test_a_coat_colours_light_that_passes_it_twice() -> None:
    """Expected: over a mirror T F / (1 - T F'), by Fresnel's formula, with the coat's colour for both ways."""
    colour = np.array([0.9, 0.5, 0.2])
    found = vt.from_openpbr(base_metalness=1, base_color=1, specular_roughness=0, coat_weight=1, coat_color=colour)
    f = fresnel(1.0, 1.6)
    expected = f + (1 - f) ** 2 * colour / (1 - f * colour)
    np.testing.assert_allclose(reflected(found.stack), expected, atol=1e-3)


@pytest.mark.parametrize("base", [{"base_metalness": 1, "specular_roughness": 0.0}, {"specular_roughness": 0.3}])
def test_a_coat_need_not_darken(base: dict[str, Any]) -> None:
    """Expected: E_c = F0 + E_b (1 - F0), with the coat's F0 and the reflectance E_b of the bare base (OpenPBR 1.1,
    "Darkening"); with darkening less than that, and between the two in between.
    """
    parameters = {"base_color": (0.9, 0.5, 0.2), **base}
    bare = reflected(vt.from_openpbr(**parameters).stack)
    f = fresnel(1.0, 1.6)
    coated = [reflected(vt.from_openpbr(**parameters, coat_weight=1, coat_darkening=d).stack) for d in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(coated[0], f + (1 - f) * bare, atol=4e-3)
    assert (coated[0] > coated[1]).all() and (coated[1] > coated[2]).all()


@pytest.mark.parametrize("coat, base", [(1.5, 1.5), (1.9, 1.9)])
def test_a_coat_darkens_paint_as_a_lambertian_base(coat: float, base: float) -> None:
    """Expected: E_c = F0 + E_b (1 - F0) (1 - K) / (1 - E_b K) with K = 1 - (1 - E_F) / n^2, which is exact for a
    Lambertian base of the colour below a smooth coat (OpenPBR 1.1, "Darkening"); E_F by quadrature.
    """
    colour = np.array([0.9, 0.5, 0.2])
    found = vt.from_openpbr(base_color=colour, specular_ior=base, coat_weight=1, coat_ior=coat)
    cosine = (np.arange(2000) + 0.5) / 2000
    mean = np.mean([2 * c * fresnel(c, coat) for c in cosine])
    kept, f = 1 - (1 - mean) / coat**2, fresnel(1.0, coat)
    expected = f + colour * (1 - f) * (1 - kept) / (1 - colour * kept)
    np.testing.assert_allclose(reflected(found.stack), expected, atol=3e-3)


@pytest.mark.parametrize(
    "made",
    [
        lambda: imports.from_standard_surface(coat=1, base_color=0.3, coat_roughness=0, specular_roughness=0).stack,
        lambda: (
            imports.from_gltf(
                {
                    "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [0.3] * 4},
                    "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1}},
                }
            ).stack
        ),
    ],
)
def test_sources_that_know_no_darkening_keep_their_colours(made: Any) -> None:
    """Expected: coat and base reflect 4 % each, though both have the index 1.5, and the colour is seen through both."""
    stack = made()
    coat, base = stack.interfaces
    assert fresnel(1.0, base.eta / coat.eta) == pytest.approx(0.04, rel=1e-4)
    np.testing.assert_allclose(reflected(stack), 0.04 + 0.96 * (0.04 + 0.96 * 0.3), atol=2e-3)


# Films and clear bases -----------------------------------------------------------------------------------------------


def test_films_lie_on_the_base() -> None:
    found = vt.from_openpbr(
        base_metalness=1, thin_film_weight=1, thin_film_thickness=0.3, thin_film_ior=1.7, coat_weight=1
    )
    coat, base = found.stack.interfaces
    assert coat.films == () and base.films == (vt.Film(eta=1.7, thickness_nm=300),)
    thick = vt.from_openpbr(base_metalness=1, thin_film_weight=1, thin_film_thickness=9)
    assert thick.stack.interfaces[0].films == () and "thin film 9000" in str(thick.left[0])


def test_a_soap_bubble_is_one_film_in_air() -> None:
    found = vt.from_openpbr(specular_ior=1, transmission_weight=1, thin_film_weight=1, geometry_thin_walled=True)
    (film,) = found.stack.layers
    assert found.stack.thin and film == vt.Interface(eta=1.0, films=[{"eta": 1.4, "thickness_nm": 500}])
    assert "0 below a film between equal indices" in str(found.left[0])


def test_a_tint_is_of_each_crossing() -> None:
    """Expected: a clear base lets 1 - F times its colour through at the normal; a pane what its colour leaves of all
    bounces; a depth belongs to the shape's inside, and is listed as a medium.
    """
    tint = np.array([0.8, 0.4, 0.2])
    glass = vt.from_openpbr(transmission_weight=1, transmission_color=tint, specular_roughness=0)
    np.testing.assert_allclose(vt.lobes(glass.stack, 1.0).passed[:, 0], 0.96 * tint, atol=1e-3)
    pane = vt.from_openpbr(
        transmission_weight=1, transmission_color=tint, specular_roughness=0, geometry_thin_walled=True
    )
    expected = 0.96**2 * tint / (1 - 0.04**2 * tint**2)
    np.testing.assert_allclose(vt.lobes(pane.stack, 1.0).passed[:, 0], expected, atol=1e-3)
    deep = vt.from_openpbr(transmission_weight=1, transmission_color=tint, transmission_depth=2)
    assert deep.stack.kinds == ("dielectric",)
    assert f"sigma_a [{-np.log(0.8) / 2:.4g}, " in str(deep.left[0])


# What is left --------------------------------------------------------------------------------------------------------


def test_what_a_stack_cannot_carry_is_listed() -> None:
    given = {"fuzz_weight": 0.5, "emission_luminance": 100, "base_diffuse_roughness": 0.2}
    found = vt.from_openpbr(**given, fuzz_color=(1, 0, 0))
    assert {each.parameter: each.value for each in found.left} == {
        "fuzz_weight": "0.5",
        "emission_luminance": "100",
        "base_diffuse_roughness": "0.2",
    }
    assert all("\n" not in str(each) for each in found.left)
    plain = vt.from_openpbr()
    assert plain.left == () and plain.stack.kinds == ("dielectric", "diffuse")


def test_switches_may_be_true() -> None:
    """Expected: of a parameter that is true or false, as 1; the solid of other tests without it."""
    pane = vt.from_openpbr(transmission_weight=1, geometry_thin_walled=True)
    assert pane == vt.from_openpbr(transmission_weight=1, geometry_thin_walled=1) and pane.stack.thin is True


def test_values_beyond_their_range_take_its_end() -> None:
    found = vt.from_openpbr(base_color=(1.5, 0.5, 0.5), subsurface_radius_scale=(2, 0, 0))
    assert "outside 0 to 1" in str(found.left[0]) and len(found.left) == 1
    assert found.stack.base and found.stack.base.albedo[0] == 1


@pytest.mark.parametrize("source", [openpbr, standard_surface, gltf, principled])
def test_all_values_in_range_become_a_stack(source: Any) -> None:
    """Expected: of parameters drawn from their ranges and their ends a stack that a file can hold."""
    random = np.random.default_rng(0)

    def drawn(parameter: Any) -> float:
        high = parameter.high if np.isfinite(parameter.high) else 10.0
        low = parameter.low if np.isfinite(parameter.low) else -10.0
        return float(random.choice([low, high, random.uniform(low, high)]))

    for _ in range(12):
        values = {
            each.name: tuple(drawn(each) for _ in range(3)) if each.is_colour else drawn(each)
            for each in source.PARAMETERS
            if random.random() < 0.5 and each.name != "specular" * (source is principled)
        }
        stack = source.read(values).stack
        assert vt.stack.loads(vt.stack.dumps(stack)) == stack


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"base_colour": 0.5}, "unknown parameter 'base_colour' (did you mean base_color?)"),
        ({"base_color": "red"}, "base_color: must be a number or [r, g, b], got 'red'"),
        ({"base_color": (1, 2)}, "base_color: must be a number or [r, g, b], got (1, 2)"),
        ({"specular_ior": (1, 1, 1)}, "specular_ior: must be a number, got (1, 1, 1)"),
        ({"coat_weight": float("nan")}, "coat_weight: must be a number, got nan"),
        ({"base_color": {"texture": "none.png"}}, "texture: file not found: "),
        ({"coat_weight": True}, "coat_weight: must be a number, got True"),
        ({"coat_weight": 10**400}, "coat_weight: must be a number, got 1000"),
        ({"coat_weight": 10**5000}, "coat_weight: must be a number, got a value of type int"),
    ],
)
def test_other_values_are_refused_in_one_line(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(vt.InvalidInput) as caught:
        vt.from_openpbr(**parameters)
    assert str(caught.value).startswith(message) and "\n" not in str(caught.value)


def test_the_clearcoat_of_principled_reflects_as_the_plugin() -> None:
    """Expected: at the normal, the albedo of the coat alone in the stack and in Mitsuba, by cosine-weighted directions.

    The plugin's distribution has long tails: it loses up to a third, and nothing of a factor.
    """
    import drjit as dr

    mi = kernel.mitsuba()
    u, v = square(2**15)
    radius, phi = np.sqrt(u), 2 * np.pi * v
    wo = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - u)])
    for weight in (0.5, 1.0):
        given = {"type": "principled", "clearcoat": weight, "clearcoat_gloss": 0.0, "base_color": (0.0, 0.0, 0.0)}
        described = {**given, "base_color": {"type": "rgb", "value": [0.0, 0.0, 0.0]}, "eta": 1.0}
        surface = dr.zeros(mi.SurfaceInteraction3f)
        surface.wi = mi.Vector3f(0, 0, 1)
        value = np.array(kernel.load_dict(described).eval(mi.BSDFContext(), surface, mi.Vector3f(wo)))
        plugin = float(np.mean(value / wo[2] * np.pi))
        coat = float(np.mean(vt.lobes(imports.from_principled(given).stack, 1.0).energy[0]))
        assert 0.6 < plugin / coat < 1


def test_principled_takes_one_index(tmp_path: Path) -> None:
    assert imports.from_principled({"eta": 1.8}).stack.interfaces[0].eta == 1.8
    assert imports.from_principled({"specular": 0.5}).stack.interfaces[0].eta == pytest.approx(1.5)
    with pytest.raises(vt.InvalidInput, match="eta: not together with specular"):
        imports.from_principled({"eta": 1.8, "specular": 0.5})
    with pytest.raises(vt.InvalidInput, match="type: must be principled, got 'diffuse'"):
        imports.from_principled({"type": "diffuse"})


# Images --------------------------------------------------------------------------------------------------------------


def test_images_follow_the_same_formulas(tmp_path: Path) -> None:
    """Expected: at each node of a curve what the number there gives, of alpha, of a diffuse base, and of a metal."""
    image = tmp_path / "image.png"
    image.touch()
    texture = vt.Texture(texture=image)

    def at(value: Any, texel: float) -> float:
        curve = value.curve or (0.0, 1.0)
        return float(value.scale * np.interp(texel, np.linspace(0, 1, len(curve)), curve) + value.offset)

    mapped = vt.from_openpbr(base_color=texture, specular_roughness=texture, specular_ior=1.5)
    metal = vt.from_openpbr(base_color=texture, base_metalness=1)
    for texel in (0.25, 0.5, 0.75):
        assert at(mapped.stack.interfaces[0].alpha, texel) == pytest.approx(texel**2)
        # The interface above is as rough as the middle of its image
        plain = vt.from_openpbr(base_color=texel, specular_roughness=0.5)
        assert at(mapped.stack.layers[1].albedo, texel) == pytest.approx(plain.stack.layers[1].albedo[0], rel=1e-4)  # type: ignore[union-attr]
        plain = vt.from_openpbr(base_color=texel, base_metalness=1)
        for key in ("eta", "k"):
            found, expected = (getattr(each.stack.layers[0], key) for each in (metal, plain))
            assert at(found, texel) == pytest.approx(expected[0], rel=1e-4)
    assert mapped.left == metal.left == ()


def test_a_linear_change_of_an_image_needs_no_curve(tmp_path: Path) -> None:
    image = tmp_path / "image.png"
    image.touch()
    texture = vt.Texture(texture=image, scale=0.5, offset=0.1)
    found = vt.from_openpbr(
        base_metalness=1, base_color=0.5, thin_film_weight=1, thin_film_thickness=texture
    ).stack.interfaces[0]
    thickness = found.films[0].thickness_nm
    assert isinstance(thickness, vt.Texture)
    assert (thickness.scale, thickness.offset, thickness.curve) == (pytest.approx(500), pytest.approx(100), None)


def coated(**extensions: Any) -> imports.Imported:
    """A brown dielectric of glTF with extensions `KHR_materials_...`."""
    core = {"baseColorFactor": [0.5, 0.3, 0.2, 1], "metallicFactor": 0, "roughnessFactor": 0.6}
    named = {f"KHR_materials_{name}": values for name, values in extensions.items()}
    return imports.from_gltf({"pbrMetallicRoughness": core, "extensions": named})


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_a_coat_without_darkening_is_a_clearcoat(weight: float) -> None:
    """Expected: equal materials, as in pairs of Khronos' CoatParameterSweep; the coat stands where both are given."""
    coat = {"coatFactor": weight, "coatRoughnessFactor": 0.2, "coatDarkeningFactor": 0.0}
    clearcoat = {"clearcoatFactor": weight, "clearcoatRoughnessFactor": 0.2}
    found = coated(coat=coat)
    assert found.stack == coated(clearcoat=clearcoat).stack
    assert found.stack == coated(coat=coat, clearcoat={"clearcoatFactor": 0.9}).stack and not found.left


def test_a_coat_of_gltf_has_index_colour_darkening_and_brushing() -> None:
    """Expected: those of the coat of OpenPBR, which has the same terms, on a base whose index counts from the coat's;
    alpha and angle follow the base's own brushing; a coat of weight 0 is left out, in any colour."""
    coat = {"coatFactor": 1, "coatRoughnessFactor": 0.3, "coatIor": 1.7, "coatColorFactor": [0.9, 0.5, 0.2]}
    brushed = {"coatAnisotropyStrength": 0.5, "coatAnisotropyRotation": np.pi / 6}
    found: Any = coated(coat={**coat, **brushed}).stack
    top, medium, below, base = found.layers
    assert (top.eta, top.rotation) == (1.7, pytest.approx(30))
    np.testing.assert_allclose(top.alpha, (0.09 * 0.75 + 0.25, 0.09))
    np.testing.assert_allclose(np.exp(-2 * np.array(medium.sigma_a)), (0.9, 0.5, 0.2), rtol=1e-5)
    assert below.eta == pytest.approx(1.5 * 1.7)
    plain: Any = coated(coat={**coat, "coatDarkeningFactor": 0.0}).stack.layers[-1]
    assert np.all(np.array(base.albedo) < plain.albedo)
    assert coated(coat={**coat, "coatFactor": 0}).stack == coated().stack
    assert [each.parameter for each in coated(coat={**coat, "coatNormalTexture": {"index": 0}}).left] == [
        "coatNormalTexture"
    ]
