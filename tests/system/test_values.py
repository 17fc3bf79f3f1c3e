"""Every way to give a value in Mitsuba, in every kind of variant, through scene files and dictionaries.

Rationale: a user writes a value as for any of Mitsuba's own plugins, and expects the same of it. Three of these are
what a stack of one layer is, with one Fresnel term: `roughconductor` for an index and a roughness, `diffuse`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.errors import InvalidInput

mi: Any = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

VARIANTS = (
    "llvm_ad_rgb",
    "llvm_ad_spectral",
    "llvm_ad_mono_polarized",
    "scalar_rgb",
    "scalar_spectral_polarized",
)
RAY_NM = (450.0, 520.0, 590.0, 640.0)
WI, WO = (0.5, 0.2, 0.8), (-0.5, -0.2, 0.8)  # in the mirror direction, where both have the same Fresnel term
POINTS = ((-0.5, -0.4), (0.4, 0.6))  # on the square from -1 to 1 that is looked at

NUMBERS = {
    "float": '<float name="NAME" value="0.4"/>',
    "spectrum of a number": '<spectrum name="NAME" value="0.4"/>',
    "grey rgb": '<rgb name="NAME" value="0.4"/>',
    "uniform": '<texture name="NAME" type="uniform"><float name="value" value="0.4"/></texture>',
    "rawconstant": '<texture name="NAME" type="rawconstant"><float name="value" value="0.4"/></texture>',
    "d65": '<spectrum name="NAME" type="d65"><float name="scale" value="0.4"/></spectrum>',
    "checkerboard": '<texture name="NAME" type="checkerboard"/>',
    "grey bitmap": '<texture name="NAME" type="bitmap"><string name="filename" value="grey.exr"/>'
    '<boolean name="raw" value="true"/></texture>',
    "number of a mesh": '<texture name="NAME" type="mesh_attribute"><string name="name" value="vertex_size"/>'
    "</texture>",
    "volume": '<texture name="NAME" type="volume"><volume name="volume" type="constvolume">'
    '<float name="value" value="0.4"/></volume></texture>',
}
COLOURS = {
    "rgb": '<rgb name="NAME" value="0.4, 0.5, 0.3"/>',
    "spectrum of pairs": '<spectrum name="NAME" value="400:0.4, 500:0.5, 600:0.6, 700:0.5"/>',
    "spectrum of a file": '<spectrum name="NAME" filename="table.spd"/>',
    "irregular": '<texture name="NAME" type="irregular"><string name="wavelengths" value="400, 500, 700"/>'
    '<string name="values" value="0.4, 0.5, 0.3"/></texture>',
    "regular": '<texture name="NAME" type="regular"><float name="wavelength_min" value="400"/>'
    '<float name="wavelength_max" value="700"/><string name="values" value="0.4, 0.5, 0.3"/></texture>',
    "srgb": '<texture name="NAME" type="srgb"><rgb name="color" value="0.4, 0.5, 0.3"/></texture>',
    "blackbody": '<spectrum name="NAME" type="blackbody"><float name="temperature" value="300"/></spectrum>',
    "bitmap": '<texture name="NAME" type="bitmap"><string name="filename" value="colours.exr"/></texture>',
    "raw bitmap": '<texture name="NAME" type="bitmap"><string name="filename" value="colours.exr"/>'
    '<boolean name="raw" value="true"/></texture>',
    "colour of a mesh": '<texture name="NAME" type="mesh_attribute"><string name="name" value="vertex_tint"/>'
    "</texture>",
}
SQUARE = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float s
property float t
property float tint_0
property float tint_1
property float tint_2
property float size_0
element face 2
property list uchar int vertex_indices
end_header
-1 -1 0 0 0 0.2 0.3 0.4 0.2
1 -1 0 1 0 0.5 0.4 0.3 0.3
1 1 0 1 1 0.6 0.2 0.7 0.5
-1 1 0 0 1 0.3 0.5 0.2 0.4
3 0 1 2
3 0 2 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the scenes name: a mesh with attributes, images, and a table of a spectrum."""
    path = tmp_path_factory.mktemp("values")
    (path / "square.ply").write_text(SQUARE)
    (path / "table.spd").write_text("# nm, value\n380 0.3\n450 0.5\n600 0.4\n780 0.6\n")
    texels = np.float32([[[0.4, 0.5, 0.3], [0.2, 0.3, 0.5]], [[0.6, 0.3, 0.2], [0.3, 0.6, 0.4]]])
    mi.Bitmap(texels).write(str(path / "colours.exr"))
    mi.Bitmap(texels[..., :1]).write(str(path / "grey.exr"))
    return path


@pytest.fixture(params=VARIANTS, scope="module")
def variant(request: pytest.FixtureRequest) -> Iterator[str]:
    kernel.mitsuba(request.param)
    vt.register()
    yield request.param
    kernel.mitsuba("llvm_ad_rgb")


def seen(folder: Path, described: str) -> np.ndarray:
    """What a BSDF on the square answers at two of its points, for unpolarised light; loaded from a file beside it."""
    shape = f'<shape type="ply"><string name="filename" value="square.ply"/>{described}</shape>'
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{shape}</scene>')
    scene = mi.load_file(str(path))
    found: list[np.ndarray] = []
    bsdf: Any = scene.shapes()[0].bsdf()
    for x, y in POINTS:
        origin, wi, wo = mi.Point3f(x, y, 1), mi.Vector3f(*WI), mi.Vector3f(*WO)
        dr.make_opaque(origin, wi, wo)  # one kernel for both points
        si = scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))
        si.wi = dr.normalize(wi)
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)(*RAY_NM)
        value = bsdf.eval(mi.BSDFContext(), si, dr.normalize(wo))
        found.append(np.ravel(value[0, 0] if mi.is_polarized else value))
    return np.array(found)


def compare(folder: Path, tag: str, ours: tuple[str, str], theirs: tuple[str, str]) -> None:
    """Both plugins, with a tag under their own name of the value, agree; where theirs fails, ours is refused."""
    try:
        expected = seen(folder, theirs[1].replace("TAG", tag.replace("NAME", theirs[0])))
    except RuntimeError:
        with pytest.raises(RuntimeError, match=rf"InvalidInput: {ours[0]}[^\n]*{mi.variant()}[^\n]*\s*$"):
            seen(folder, ours[1].replace("TAG", tag.replace("NAME", ours[0])))
        return
    found = seen(folder, ours[1].replace("TAG", tag.replace("NAME", ours[0])))
    # Uniform stacks are sampled at every 10 nm, and so are kinks of a spectrum
    np.testing.assert_allclose(found, expected, rtol=0.01 if mi.is_spectral else 1e-3, err_msg=tag)


MODEL = '<string name="model" value="belcour2018"/><string name="reflectance" value="fresnel"/>'
METAL = '<float name="layer0_k" value="2"/>'


@pytest.mark.parametrize("tag", [*NUMBERS, *COLOURS])
def test_an_index(tag: str, variant: str, folder: Path) -> None:
    ours = f'<bsdf type="layered">{MODEL}{METAL}TAG<float name="layer0_alpha" value="0.3"/></bsdf>'
    theirs = (
        '<bsdf type="roughconductor"><string name="distribution" value="ggx"/>'
        'TAG<float name="k" value="2"/><float name="alpha" value="0.3"/></bsdf>'
    )
    compare(folder, {**NUMBERS, **COLOURS}[tag], ("layer0_eta", ours), ("eta", theirs))


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "scalar_spectral_polarized"], indirect=True)
@pytest.mark.parametrize("tag", NUMBERS)
def test_a_roughness(tag: str, variant: str, folder: Path) -> None:
    ours = f'<bsdf type="layered">{MODEL}{METAL}TAG<float name="layer0_eta" value="1.5"/></bsdf>'
    theirs = (
        '<bsdf type="roughconductor"><string name="distribution" value="ggx"/>'
        '<float name="eta" value="1.5"/><float name="k" value="2"/>TAG</bsdf>'
    )
    compare(folder, NUMBERS[tag], ("layer0_alpha", ours), ("alpha", theirs))


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"], indirect=True)
@pytest.mark.parametrize("tag", [*NUMBERS, *COLOURS])
def test_an_albedo(tag: str, variant: str, folder: Path) -> None:
    ours, theirs = '<bsdf type="layered">TAG</bsdf>', '<bsdf type="diffuse">TAG</bsdf>'
    compare(folder, {**NUMBERS, **COLOURS}[tag], ("layer0_albedo", ours), ("reflectance", theirs))


def test_entries_of_dictionaries(variant: str) -> None:
    """Expected: the material that has the same value as a number or a colour."""

    def eta(value: Any) -> np.ndarray:
        bsdf = mi.load_dict({"type": "layered", "layer0_eta": value, "layer0_k": 2.0, "layer0_alpha": 0.3})
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = dr.normalize(mi.Vector3f(*WI))
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)(*RAY_NM)
        return np.ravel(np.array(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO)))))

    ways = [1, mi.Float(1), np.float32(1), [1.0, 1.0, 1.0], np.ones(3), mi.Color3f(1), mi.ScalarColor3f(1)]
    texture = mi.load_dict({"type": "uniform", "value": 1.0})
    for value in (*ways, texture, {"type": "rgb", "value": 1.0}, {"type": "spectrum", "value": 1.0}):
        np.testing.assert_allclose(eta(value), eta(1.0), rtol=1e-4)
    colour = {"type": "rgb", "value": [0.4, 0.5, 0.3]}
    np.testing.assert_allclose(eta([0.4, 0.5, 0.3]), eta(colour), rtol=1e-4)
    pairs = {"type": "spectrum", "value": [(360, 1.0), (830, 1.0)]}
    np.testing.assert_allclose(eta(pairs), eta(1.0), rtol=2e-3)  # Mitsuba's own sums of the three curves


@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_what_is_no_value_is_refused_in_a_line(variant: str) -> None:
    colour, image = {"type": "rgb", "value": [0.1, 0.2, 0.3]}, {"type": "checkerboard"}
    for key, value, reason in (
        ("layer0_alpha", colour, r"layer 0 \(interface\): alpha: must be a number, .*"),
        (
            "layer0_eta",
            mi.ScalarTransform4f(),
            "layer0_eta: must be a number, a colour, a spectrum or a texture, got .*",
        ),
        (
            "layer0_eta",
            {"type": "spectrum", "value": 0.0},
            r"layer 0 \(interface\): eta: must lie in 0.001 to 1e4, got 0.0",
        ),
        ("exterior", image, "exterior: must be a number, .*"),
        ("layer0_conductor", image, r"layer0_conductor: layer 0 \(dielectric\) has no conductor, .*"),
        ("layer3_alpha", image, "layer3_alpha_u: the last layer is layer 1"),
    ):
        with pytest.raises(InvalidInput, match=f"^{reason}$"):
            kernel.load_dict({"type": "layered", "material": "frosted-metal", key: value})


@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_a_texture_of_python_varies_even_if_it_denies_that(variant: str) -> None:
    class Halves(mi.Texture):
        def eval_1(self, si: Any, active: Any = True) -> Any:
            return dr.select(si.uv.x < 0.5, 0.2, 0.5)

    mi.register_texture("halves", Halves)
    bsdf = mi.load_dict({"type": "layered", "material": "frosted-metal", "layer0_alpha": {"type": "halves"}})
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.wi, si.uv = dr.normalize(mi.Vector3f(*WI)), mi.Point2f([0.2, 0.8], 0.5)
    left, right = np.array(bsdf.pdf(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO))))
    assert left > 2 * right


@pytest.mark.parametrize("variant", ["scalar_rgb"], indirect=True)
def test_files_are_found_beside_the_scene(variant: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: a material file, its image, and an image that JSON text names, wherever the program runs."""
    (folder / "paint.yaml").write_text("layers: [diffuse: {albedo: {texture: colours.exr}}]")
    text = '{"layers": [{"diffuse": {"albedo": {"texture": "colours.exr"}}}]}'
    monkeypatch.chdir(folder.parent)
    for material in ("paint.yaml", text, str(folder / "paint.yaml")):
        found = seen(folder, f"<bsdf type='layered'><string name='material' value='{material}'/></bsdf>")
        expected = seen(folder, f'<bsdf type="diffuse">{COLOURS["bitmap"].replace("NAME", "reflectance")}</bsdf>')
        np.testing.assert_allclose(found, expected, rtol=1e-4)
    with pytest.raises(RuntimeError, match=r"InvalidInput: none\.yaml: file not found\s*$"):
        seen(folder, '<bsdf type="layered"><string name="material" value="none.yaml"/></bsdf>')


@pytest.mark.parametrize("plugin", ["velatura", "weidlich_wilkie"])
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"], indirect=True)
def test_a_table_of_ones_own_is_used_as_a_measured_name(plugin: str, variant: str, tmp_path: Path) -> None:
    """Expected: gold by its name, and by tables that hold what Mitsuba's do, in a material file."""
    for part in ("eta", "k"):
        rows = zip(*vt.stack.Named("Au", part).table())
        (tmp_path / f"{part}.spd").write_text("\n".join(f"{nm} {value}" for nm, value in rows))
    index = "eta: {spectrum: eta.spd}, k: {spectrum: k.spd}"
    (tmp_path / "own.yaml").write_text(f"layers: [{{interface: {{{index}, alpha: 0.3}}}}]")
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(*WI))
    if mi.is_spectral:
        si.wavelengths = type(si.wavelengths)(*RAY_NM)
    gold = vt.Stack([vt.Interface(conductor="Au", alpha=0.3)])
    found, expected = (
        np.ravel(vt.bsdf(material, model=plugin).eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO))))
        for material in (tmp_path / "own.yaml", gold)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    assert np.ptp(found) > 0.3 * found.max()


GREY = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Medium(depth=0.5), vt.Interface(eta=0.5, k=2.0, alpha=0.3)])


@pytest.mark.parametrize("plugin", ["velatura", "reference", "weidlich_wilkie"])
def test_all_variants_give_a_grey_material_one_value(plugin: str, variant: str) -> None:
    """Expected: the value of `llvm_ad_rgb`, `sample` included, to rounding; light that was polarised is so no more.

    The reference polarises light in such variants, which changes what later bounces reflect: there it draws the same
    directions, and matrices that polarise light in part. `test_exact_polarised.py` measures them.
    """
    polarises = plugin == "reference" and mi.variant().endswith("polarized")

    def seen() -> list[np.ndarray]:
        bsdf, ctx, si = vt.bsdf(GREY, model=plugin), mi.BSDFContext(), dr.zeros(mi.SurfaceInteraction3f)
        si.wi = dr.normalize(mi.Vector3f(*WI))
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)(*RAY_NM)
        value = bsdf.eval(ctx, si, dr.normalize(mi.Vector3f(*WO)))
        sample, weight = bsdf.sample(ctx, si, 0.3, mi.Point2f(0.4, 0.6))
        if mi.is_polarized:
            for mueller in (value, weight):
                entries = np.array(mueller).reshape(16, -1)
                assert np.count_nonzero(entries.any(axis=1)) == (16 if polarises else 1)
                assert np.all(np.linalg.norm(entries[[4, 8, 12]], axis=0) <= entries[0])
            value, weight = value[0, 0], weight[0, 0]
        return [np.ravel(value)[0], np.ravel(weight)[0], *np.ravel(sample.wo)]

    found = seen()
    kernel.mitsuba("llvm_ad_rgb")
    try:
        expected = seen()
    finally:
        kernel.mitsuba(variant)
    known = slice(2, None) if polarises else slice(None)
    np.testing.assert_allclose(found[known], expected[known], rtol=1e-4)


OUT_OF_RANGE = {
    "layer0_eta": (0.0, 1e-3),
    "layer0_alpha_u": (3.0, 1.0),
    "layer0_alpha_v": (-1.0, 0.0),
    "layer1_depth": (-1.0, 0.0),
    "layer1_g": (1.0, 1 - 1e-3),
    "layer1_sigma_a": (-2.0, 0.0),
    "exterior": (-1.0, 1e-3),
}


@pytest.mark.parametrize("plugin", ["velatura", "reference", "weidlich_wilkie"])
@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_updates_are_kept_within_range(plugin: str, variant: str) -> None:
    """Expected: the value at the end of the range, one warning for each parameter, and a NaN refused."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(*WI))
    for name, (beyond, end) in OUT_OF_RANGE.items():
        bsdf, expected = (vt.bsdf(GREY.replace(layer1_sigma_s=0.1), model=plugin) for _ in range(2))
        parameters = mi.traverse(bsdf)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for value in (beyond, 0.5, beyond):
                parameters[name] = value
                parameters.update()
        ours = [str(warning.message) for warning in caught if name in str(warning.message)]
        assert len(ours) == 1 and f"got {beyond}" in ours[0]
        parameters = mi.traverse(expected)
        parameters[name] = end
        parameters.update()
        found, expected = (
            np.ravel(each.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO)))) for each in (bsdf, expected)
        )
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        assert np.isfinite(found).all()
    parameters["layer0_eta"] = float("nan")
    with pytest.raises(InvalidInput, match=r"^layer0_eta: must be finite, got nan$"):
        parameters.update()


@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_an_optimiser_that_overshoots_comes_back(variant: str) -> None:
    """Expected: the slope at the end of the range, beyond it, too."""
    bsdf = vt.bsdf(GREY.replace(layer1_sigma_a=1.0))
    parameters, slopes = mi.traverse(bsdf), []
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(*WI))
    for depth in (0.0, -0.5):
        parameters["layer1_depth"] = mi.Float(depth)
        dr.enable_grad(parameters["layer1_depth"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parameters.update()
        dr.backward(dr.sum(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*WO)))))
        slopes.append(float(dr.grad(parameters["layer1_depth"])[0]))
    assert slopes[0] < 0 and slopes[1] == pytest.approx(slopes[0], rel=1e-4)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_every_grey_colour_takes_three_channels(model: str, variant: str) -> None:
    """Of numbers and of grey `rgb`: the BSDF then equals one that is made with the colours."""
    si, wo = dr.zeros(mi.SurfaceInteraction3f), dr.normalize(mi.Vector3f(*WO))
    si.wi = dr.normalize(mi.Vector3f(*WI))
    coat = {"layer0_eta": 1.5, "layer0_alpha": 0.1, "layer1_sigma_a": 0.5, "layer1_sigma_s": 0.2}
    for base in ({"layer2_eta": 0.5, "layer2_k": 3.0, "layer2_alpha": 0.2}, {"layer2_albedo": 0.5}):
        greys = {key: value for key, value in (coat | base).items() if not key.endswith("alpha")}
        colours = {key: (value, 1.1 * value, 1.2 * value) for key, value in greys.items()}
        expected = vt.bsdf(vt.Stack.from_flat(None, coat | base | colours), model=model).eval(mi.BSDFContext(), si, wo)
        rgb = {key: {"type": "rgb", "value": [value] * 3} for key, value in greys.items()}
        for given in (greys, rgb):
            bsdf = mi.load_dict({"type": "layered", "model": model, **coat, **base, **given})
            parameters = mi.traverse(bsdf)
            for key, colour in colours.items():
                parameters[key] = mi.Color3f(colour)
            parameters.update()
            found = bsdf.eval(mi.BSDFContext(), si, wo)
            np.testing.assert_allclose(np.ravel(found), np.ravel(expected), rtol=1e-5)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
@pytest.mark.parametrize("variant", ["llvm_ad_rgb"], indirect=True)
def test_texels_that_are_not_finite_are_refused(model: str, variant: str) -> None:
    """In a texture of a scene, when it is loaded and after a change."""
    refusal = r"layer0_alpha_u: has texels that are not finite"
    texels = np.full((2, 2, 1), 0.2, np.float32)

    def bsdf() -> Any:
        image = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True}
        return mi.load_dict({"type": "layered", "model": model, "layer0_conductor": "mirror", "layer0_alpha": image})

    parameters, key = mi.traverse(bsdf()), "layer0_alpha_u.data"
    for bad in (np.nan, np.inf):
        texels[0, 1] = bad
        with pytest.raises(RuntimeError, match=refusal):
            bsdf()
        parameters[key] = mi.TensorXf(texels)
        with pytest.raises(InvalidInput, match=refusal):
            parameters.update()
