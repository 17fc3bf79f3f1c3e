"""The pictures' stage: what it shows where, what it writes, and what it refuses."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import velatura as vt
from velatura import kernel, scenes
from velatura.errors import InvalidInput
from velatura.scenes.environments import SOFTBOXES, sky
from velatura.scenes.picture import PASS_SAMPLES, _passes

Picture = NDArray[np.float32]

GOLD = {"type": "roughconductor", "material": "Au", "distribution": "ggx", "alpha_u": 0.05, "alpha_v": 0.3}
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
WHITE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}

TWO_SPHERES = """
<scene version="3.0.0">
    <integrator type="direct"/>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 0, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="24"/>
            <integer name="height" value="12"/>
            <string name="pixel_format" value="rgba"/>
        </film>
    </sensor>
    <emitter type="constant"/>
    <bsdf type="diffuse" id="{left}"><rgb name="reflectance" value="0"/></bsdf>
    <shape type="sphere"><point name="center" x="-1" y="0" z="0"/><ref id="{left}"/></shape>
    <shape type="sphere">
        <point name="center" x="1" y="0" z="0"/>
        <bsdf type="diffuse" id="painted"><rgb name="reflectance" value="0"/></bsdf>
    </shape>
</scene>
"""

ONE_SPHERE = """
<scene version="3.0.0">
    {}
    <bsdf type="diffuse" id="material"/>
    <shape type="sphere"><ref id="material"/></shape>
</scene>
"""
METER = '<sensor type="irradiancemeter"><film type="hdrfilm"><rfilter type="box"/></film></sensor>'


@pytest.fixture(autouse=True)
def mi() -> Iterator[Any]:
    module = kernel.mitsuba("llvm_ad_rgb")
    yield module
    module.set_variant("llvm_ad_rgb")


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "spheres.xml"
    path.write_text(TWO_SPHERES.format(left="material"))
    return path


# Objects and environments


@pytest.mark.parametrize("scene", scenes.OBJECTS)
def test_every_object_is_rendered(scene: str) -> None:
    image = scenes.render(GOLD, scene=scene, spp=4, size=(24, 16))
    assert image.shape == (16, 24, 3)
    assert image.dtype == np.float32
    assert np.all(np.isfinite(image)) and np.all(image >= 0.0) and image.mean() > 0.05


@pytest.mark.parametrize("env", scenes.ENVIRONMENTS)
def test_every_environment_lights_the_sphere(env: str) -> None:
    """The grey card comes out of the studio and out of the sky at comparable exposures."""
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.18}}
    image = scenes.render(grey, scene="sphere", env=env, spp=16, size=(24, 24))
    assert np.all(np.isfinite(image))
    assert 0.05 < image[6:18, 6:18].mean() < 0.4


def test_the_sky_as_a_picture_is_that_of_the_renderer() -> None:
    """Expected: the irradiance of a grey card that lies flat, sun included, within 2 % (noise of 400 samples: .2 %)."""
    mi = kernel.mitsuba()
    T = mi.ScalarTransform4f
    card = {"type": "rectangle", "to_world": T().rotate([1, 0, 0], -90), "bsdf": {"type": "diffuse"}}
    lit = []
    for light in (scenes.emitter(mi, "sky"), {"type": "envmap", "bitmap": mi.Bitmap(sky())}):
        sensor = {"type": "orthographic", "to_world": T().look_at([0, 3, 0.1], [0, 0, 0], [0, 0, 1]) @ T().scale(0.5)}
        film = {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "rgb"}
        scene = {"type": "scene", "card": card, "light": light, "camera": sensor | {"film": film}}
        scene["integrator"] = {"type": "direct"}
        lit.append(np.array(mi.render(mi.load_dict(scene), spp=400)).mean(axis=(0, 1)))
    np.testing.assert_allclose(lit[0], lit[1], rtol=0.02)


def test_a_material_that_loses_no_light_vanishes_in_the_furnace() -> None:
    """Every direction brings 1, a white sphere sends back what it gets: the picture is 1 everywhere."""
    image = scenes.render(WHITE, scene="sphere", env="furnace", spp=64, size=(32, 32))
    assert image.mean() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    ("size", "zoom", "share"),
    [((64, 64), 1.0, 0.54), ((128, 64), 1.0, 0.27), ((64, 128), 1.0, 0.27), ((64, 64), 1.2, 0.76)],
)
def test_the_ball_covers_the_same_share_of_every_format(size: tuple[int, int], zoom: float, share: float) -> None:
    """A black ball in the furnace blackens its share of the pixels: over half of a square, whole in any format."""
    image = scenes.render(BLACK, env="furnace", spp=4, size=size, zoom=zoom)
    assert 1.0 - image.mean() == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("box", SOFTBOXES)
def test_the_softboxes_hang_where_they_say(mi: Any, box: Any) -> None:
    """Mitsuba's own look-up in the studio finds each at its centre, and finds the floor dark."""
    light = mi.load_dict(scenes.scene_dict(bsdf=BLACK)["light"])
    si = mi.SurfaceInteraction3f()

    def radiance(towards: tuple[float, float, float]) -> float:
        si.wi = -mi.Vector3f((np.asarray(towards) / np.linalg.norm(towards)).tolist())
        return float(np.mean(light.eval(si)))

    assert radiance(box.centre) >= box.radiance
    assert radiance((0.0, -1.0, 0.0)) < 0.1


def test_the_key_light_comes_from_the_upper_left() -> None:
    image = scenes.render(WHITE, scene="sphere", spp=16, size=(32, 32)).mean(axis=-1)
    assert image[8:14, 8:14].mean() > 1.3 * image[18:24, 18:24].mean()


@pytest.mark.parametrize(("alpha_u", "alpha_v"), [(0.05, 0.3), (0.3, 0.05)])
def test_a_brushed_sphere_blurs_across_the_brush(mi: Any, alpha_u: float, alpha_v: float) -> None:
    """A sphere is brushed along its latitudes (u); a light behind the camera is then stretched along v, up and down."""
    scene = scenes.scene_dict("sphere", bsdf={**GOLD, "alpha_u": alpha_u, "alpha_v": alpha_v}, size=(64, 64))
    scene["light"] = {"type": "directional", "direction": [0.0, -0.17, -1.0]}
    del scene["plinth"]
    image = np.array(mi.render(mi.load_dict(scene), spp=16)).mean(axis=-1)
    y, x = np.mgrid[:64, :64]
    wide, tall = (np.average((p - np.average(p, weights=image)) ** 2, weights=image) for p in (x, y))
    assert (tall > 2.0 * wide) if alpha_v > alpha_u else (wide > 2.0 * tall)


def test_a_texture_stands_upright(mi: Any) -> None:
    """The image's upper left corner is red; so is the left of the sphere's upper half, as the camera sees it."""
    corner = np.zeros((2, 4, 3), np.float32)
    corner[0, :2, 0] = 1.0
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(corner), "raw": True, "filter_type": "nearest"}
    painted = {"type": "diffuse", "reflectance": texture}
    red = scenes.render(painted, scene="sphere", env="furnace", spp=4, size=(32, 32))[..., 0]
    quarters = [red[9:13, 9:13], red[9:13, 19:23], red[20:24, 9:13], red[20:24, 19:23]]
    assert [bool(quarter.mean() > 0.5) for quarter in quarters] == [True, False, False, False]


def test_fourteen_coated_metals_share_their_kernels(mi: Any) -> None:
    """Rationale: a kernel takes a third of a second to compile. Expected: values of a material, and addresses of a
    scene's arrays, which differ each time, belong to none."""
    import drjit as dr

    def kernels(alpha: float, metal: str) -> set[str]:
        coat: list[Any] = [vt.Interface(eta=1.5, alpha=alpha), vt.Medium(sigma_a=(alpha, 0.1, 0.2))]
        material = vt.bsdf(vt.Stack([*coat, vt.Interface(conductor=metal, alpha=0.2)]))
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            scenes.render(material, spp=1, size=(4, 4))
            # A small one of single numbers of the scene comes once, now or then
            return {each["hash"] for each in dr.kernel_history([dr.KernelType.JIT]) if each["size"] > 1}

    first = kernels(0.1, "Au")
    assert 0 < len(first) < 12
    for alpha in (0.0, 0.05, 0.2, 0.3, 0.5, 0.8):
        for metal in ("Au", "Al"):
            assert kernels(alpha, metal) == first
    assert kernels(0.1, "Al") == first


def test_several_materials_stand_side_by_side(mi: Any) -> None:
    """The scene is a dictionary: a second sphere is one more entry, and black where the first is white."""
    scene = scenes.scene_dict("sphere", "furnace", WHITE, size=(64, 32))
    body = scenes.OBJECTS["sphere"].surface().moved((2.2, 0.0, 0.0))
    scene["second"] = scenes.mesh(mi, body, mi.load_dict(BLACK))
    image = np.array(mi.render(mi.load_dict(scene), spp=16)).mean(axis=-1)
    assert image[14:18, 30:34].mean() > 0.9
    assert image[14:18, 56:60].mean() < 0.1


@pytest.mark.parametrize(("variant", "size"), [("scalar_rgb", (6, 4)), ("llvm_ad_spectral", (16, 16))])
def test_other_variants_render(mi: Any, variant: str, size: tuple[int, int]) -> None:
    mi.set_variant(variant)
    assert 0.05 < scenes.render(WHITE, scene="sphere", spp=4, size=size).mean() < 2.0


# A user's scene and environment


def test_a_scene_file_shows_the_material_where_it_says_material(scene_file: Path) -> None:
    """White in the file's own white surroundings vanishes; the other sphere keeps its black, the file its size."""
    image = scenes.render(WHITE, scene=str(scene_file), spp=64)
    assert image.shape == (12, 24, 3)
    assert image[4:8, 6:10].mean() == pytest.approx(1.0, abs=0.05)
    assert image[4:8, 14:18].mean() == pytest.approx(0.0, abs=0.05)


def test_a_scene_file_takes_another_size_and_environment(scene_file: Path, tmp_path: Path, mi: Any) -> None:
    dim = tmp_path / "dim.exr"
    mi.Bitmap(np.full((8, 16, 3), 0.5, np.float32)).write(str(dim))
    image = scenes.render(WHITE, scene=str(scene_file), env=str(dim), spp=64, size=(48, 24))
    assert image.shape == (24, 48, 3)
    assert image[8:16, 12:20].mean() == pytest.approx(0.5, abs=0.03)


def test_a_scene_file_may_measure_the_material_itself(scene_file: Path) -> None:
    """Expected: the irradiance on a sphere in white surroundings is pi."""
    meter = METER.replace("<rfilter", '<integer name="width" value="4"/><integer name="height" value="4"/><rfilter')
    text = ONE_SPHERE.format('<integrator type="path"/><emitter type="constant"/>')
    scene_file.write_text(text.replace('<ref id="material"/>', f'<ref id="material"/>{meter}'))
    assert scenes.render(WHITE, scene=str(scene_file), spp=64).mean() == pytest.approx(np.pi, abs=0.05)


def test_a_scene_file_without_light_is_shown_in_the_studio(scene_file: Path) -> None:
    scene_file.write_text(scene_file.read_text().replace('<emitter type="constant"/>', ""))
    assert scenes.render(WHITE, scene=str(scene_file), spp=16).mean() > 0.1


@pytest.mark.parametrize("ending", [".exr", ".hdr"])
def test_an_environment_file_lights_the_scene(ending: str, tmp_path: Path, mi: Any) -> None:
    path = tmp_path / f"half{ending}"
    mi.Bitmap(np.full((8, 16, 3), 0.5, np.float32)).write(str(path))
    image = scenes.render(BLACK, scene="sphere", env=str(path), spp=1, size=(16, 16))
    assert image[0, 0] == pytest.approx([0.5] * 3, rel=0.01)


# What is refused


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"scene": "bal"}, "unknown scene 'bal': give ball, sphere, teapot, urn, plane, wedges, lid, or"),
        ({"scene": "nowhere.xml"}, "nowhere.xml: no such scene file"),
        ({"env": "studoi"}, "unknown environment 'studoi': give studio, sky, furnace, apartment"),
        ({"env": "nowhere.hdr"}, "nowhere.hdr: no such environment file"),
        ({"env": f"{'x' * 300}.hdr"}, "no such environment file"),
        ({"env": ""}, "unknown environment"),
        ({"spp": 0}, "spp: must be a whole number of at least 1, got 0"),
        ({"spp": 1.5}, "spp: must be a whole number of at least 1, got 1.5"),
        ({"seed": -1}, "seed: must be a whole number of at least 0, got -1"),
        ({"scene": 3}, "unknown scene 3"),
        ({"env": 3}, "unknown environment"),
    ],
)
def test_what_cannot_be_rendered_is_refused_in_one_line(asked: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        scenes.render(BLACK, **asked)
    assert says in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.xml", "<scene", "a.xml"),
        ("a.xml", '<scene version="3.0.0"><shape type="nothing"/></scene>', "nothing"),
        ("a.xml", TWO_SPHERES.format(left="other"), 'id="material"'),
        ("a.xml", '<bsdf version="3.0.0" type="diffuse"/>', "holds no <scene>"),
        ("a.xml", ONE_SPHERE.format(""), "has no integrator"),
        ("a.xml", ONE_SPHERE.format('<integrator type="path"/>'), "has no sensor"),
        ("a.xml", ONE_SPHERE.format(f'<integrator type="path"/>{METER}'), "irradiancemeter must stand within"),
        ("a.xml", ONE_SPHERE.format(f'<integrator type="ptracer"/>{METER}'), "irradiancemeter must stand within"),
        ("a.xml", TWO_SPHERES.format(left="material").replace('value="24"', 'value="0"'), "no pixels"),
        (
            "a.xml",  # which Mitsuba finds only when it renders
            ONE_SPHERE.format('<integrator type="ptracer"/><sensor type="orthographic"/><emitter type="constant"/>'),
            "not implemented",
        ),
        ("a.exr", "not a picture", "a.exr"),
        ("a.hdr", "not a picture", "a.hdr"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(name: str, text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InvalidInput) as refused:
        scenes.render(BLACK, str(path)) if name == "a.xml" else scenes.render(BLACK, env=str(path))
    assert str(path) in str(refused.value) and says in str(refused.value) and "\n" not in str(refused.value)


HALF = np.full((8, 16, 3), 0.5, np.float32)


@pytest.mark.parametrize(
    ("texels", "says"),
    [
        (np.where(np.arange(16)[:, None] == 3, np.nan, HALF), "negative, not finite"),
        (np.where(np.arange(16)[:, None] == 3, np.inf, HALF), "negative, not finite"),
        (-HALF, "negative, not finite"),
        (HALF * 1e30, "above 1e[+]12"),
        (np.full((8, 16, 5), 0.5, np.float32), "5 channels"),
    ],
)
def test_a_light_that_is_none_is_refused_in_one_line(texels: Picture, says: str, tmp_path: Path, mi: Any) -> None:
    path = tmp_path / "a.exr"
    mi.Bitmap(texels.astype(np.float32)).write(str(path))
    with pytest.raises(InvalidInput, match=rf"^{path}: has .*{says}.*$"):
        scenes.render(BLACK, env=str(path))


@pytest.mark.parametrize("channels", [1, 2, 4])
def test_a_light_may_be_grey_or_have_opacity(channels: int, tmp_path: Path, mi: Any) -> None:
    """Expected: the picture of .5 with an opacity of 1 lights as that of three channels of .5 does."""
    texels = np.full((8, 16, channels), 0.5, np.float32)
    texels[..., -1] = 1.0 if channels in (2, 4) else 0.5
    mi.Bitmap(texels).write(str(tmp_path / "a.exr"))
    image = scenes.render(WHITE, scene="sphere", env=str(tmp_path / "a.exr"), spp=1, size=(8, 8))
    assert image[0, 0] == pytest.approx([0.5] * 3, rel=0.01)


def test_a_light_without_texels_or_too_large_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.hdr"
    for size in ("-Y 0 +X 0", "-Y 200000 +X 200000"):
        path.write_text(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n")
        with pytest.raises(InvalidInput, match=rf"^{path}: .+$"):
            scenes.render(BLACK, env=str(path))


# Passes


def test_progress_is_told_after_every_pass_and_the_seed_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("velatura.scenes.picture.PASS_SAMPLES", 16 * 16 * 4)
    told: list[tuple[int, int]] = []

    def picture(seed: int) -> Picture:
        return scenes.render(GOLD, "sphere", spp=9, size=(16, 16), seed=seed, progress=lambda *t: told.append(t))

    first = picture(1)
    assert told == [(3, 9), (6, 9), (9, 9)]
    assert np.allclose(picture(1), first, rtol=1e-4)
    assert not np.allclose(picture(2), first, rtol=1e-2)


@given(st.integers(1, 5000), st.integers(1, 2**28))
def test_passes_add_up(spp: int, pixels: int) -> None:
    passes = _passes(spp, pixels)
    assert sum(passes) == spp and min(passes) >= 1
    assert max(passes) == 1 or max(passes) * pixels < 2 * PASS_SAMPLES


# Files


def test_tone_mapping_is_srgb_below_the_knee_and_never_reaches_white() -> None:
    """Rationale: sRGB encodes linear 0.214041 as 0.5 (IEC 61966-2-1)."""
    assert scenes.tone_map([0.0, 0.214041, 0.0031308]) == pytest.approx([0.0, 0.5, 0.04045], abs=1e-5)
    steps = scenes.tone_map(np.linspace([0.0] * 3, [5.0] * 3, 5001))[:, 0]
    assert np.all(np.diff(steps) > 0.0) and steps[-1] < 1.0
    assert np.max(np.diff(steps[600:])) < 2e-3  # no jump at the knee
    assert scenes.tone_map([-1.0, np.nan, 1e9]) == pytest.approx([0.0, 0.0, 1.0])


def test_a_png_holds_the_tone_mapped_picture(tmp_path: Path, mi: Any) -> None:
    image = np.random.default_rng(0).uniform(0.0, 2.0, (5, 7, 3)).astype(np.float32)
    scenes.write_image(image, tmp_path / "a.PNG")
    assert np.array_equal(mi.Bitmap(str(tmp_path / "a.PNG")), np.round(255.0 * scenes.tone_map(image)))


def test_a_png_takes_a_view_transform_and_another_name_is_one_line(tmp_path: Path, mi: Any) -> None:
    image = np.random.default_rng(0).uniform(0.0, 2.0, (5, 7, 3)).astype(np.float32)
    scenes.write_image(image, tmp_path / "a.png", view="agx")
    assert np.array_equal(mi.Bitmap(str(tmp_path / "a.png")), np.round(255.0 * scenes.tone_map(image, "agx")))
    with pytest.raises(InvalidInput, match="view: must be one of soft, srgb, agx, aces, got 'filmic'"):
        scenes.write_image(image, tmp_path / "b.png", view="filmic")
    assert not (tmp_path / "b.png").exists()


def test_an_exr_holds_the_linear_picture(tmp_path: Path, mi: Any) -> None:
    image = np.random.default_rng(0).uniform(0.0, 20.0, (5, 7, 3)).astype(np.float32)
    scenes.write_image(image, tmp_path / "a.exr")
    assert np.array_equal(mi.Bitmap(str(tmp_path / "a.exr")), image)


def test_a_full_disk_is_told_in_one_line(tmp_path: Path) -> None:
    """Rationale: Mitsuba's own files raise a RuntimeError there. A limit on the size of files stands for the disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, before[1]))
    try:
        for name in ("a.exr", "a.png"):
            noise = np.random.default_rng(0).random((64, 64, 3), np.float32)
            with pytest.raises(InvalidInput, match=rf"^.*{name}: cannot be written: file too large$"):
                scenes.write_image(noise, tmp_path / name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


def test_an_interrupt_stays_one_if_the_renderer_raises_another_error(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rationale: Mitsuba, interrupted in a callback, raises a RuntimeError. Expected: any other error is reported."""

    def interrupted(*_: object, **__: object) -> None:
        raise RuntimeError("error while performing a custom differentiable operation") from KeyboardInterrupt()

    monkeypatch.setattr(mi, "render", interrupted)
    with pytest.raises(KeyboardInterrupt):
        scenes.render(GOLD, spp=1, size=(8, 8))

    def failed(*_: object, **__: object) -> None:
        raise RuntimeError("out of memory")

    monkeypatch.setattr(mi, "render", failed)
    with pytest.raises(RuntimeError, match="out of memory"):
        scenes.render(GOLD, spp=1, size=(8, 8))


def test_an_interrupted_writing_leaves_the_old_picture_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    (tmp_path / "a.png").write_text("old")
    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        scenes.write_image(np.zeros((2, 2, 3)), tmp_path / "a.png")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    assert (tmp_path / "a.png").read_text() == "old"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a.gif", "ends in .png"),
        ("a", "ends in .png"),
        ("nowhere/a.png", "no folder"),
        ("folder.png", "is a folder"),
        ("/proc/a.png", "not writable"),  # where not even root may write
    ],
)
def test_a_path_that_cannot_be_written_is_refused_in_one_line(name: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    for write in (scenes.check_writable, lambda path: scenes.write_image(np.zeros((2, 2, 3)), path)):
        with pytest.raises(InvalidInput) as refused:
            write(tmp_path / name)
        assert name in str(refused.value) and says in str(refused.value) and "\n" not in str(refused.value)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


@pytest.mark.parametrize("size", [0, (8, -1), (8,), (8, 8, 8), 8.5, (8, "8"), "8by8", "8x0", "٣", 10**6])
def test_an_impossible_size_is_refused(size: Any) -> None:
    allowed = r"must be pixels, \(width, height\) or 'WxH', from 1 to 16384"
    with pytest.raises(InvalidInput, match=rf"^size is .*, and {allowed}$"):
        scenes.render(GOLD, size=size)


def test_one_number_is_the_size_of_both_sides() -> None:
    assert scenes.render(GOLD, spp=1, size=8).shape == (8, 8, 3)
    assert scenes.render(GOLD, spp=1, size="8x6").shape == (6, 8, 3)
