"""Every value of a material from an image: what is seen at a point is the constant stack of its texels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from images import write_image

import velatura as vt
from velatura import kernel
from velatura.errors import InvalidInput
from velatura.model import MODELS

mi = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")

STACK = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=(0.12, 0.2), rotation=10),
        vt.Medium(depth=0.5, sigma_a=(0.1, 0.2, 0.3), sigma_s=0.2, g=0.8),
        vt.Interface(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.1), alpha=(0.3, 0.2), rotation=30),
    ]
)
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=0.4)])
GLASS = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Interface(eta=1.2, alpha=0.3)])

#: Value, two texels of an image, and what those are scaled by.
VALUES = {
    "layer0_eta": (0.75, 0.9, 2.0),
    "layer0_alpha_u": (0.1, 0.3, 1.0),
    "layer0_alpha_v": (0.1, 0.3, 1.0),
    "layer0_rotation": (0.1, 0.6, 90.0),
    "layer1_depth": (0.2, 1.0, 1.0),
    "layer1_sigma_a": (0.1, 0.6, 1.0),
    "layer1_sigma_s": (0.1, 0.5, 1.0),
    "layer1_g": (0.4, 0.9, 1.0),
    "layer2_eta": (0.1, 0.5, 2.0),
    "layer2_k": (0.4, 0.8, 5.0),
    "layer2_alpha_u": (0.1, 0.4, 1.0),
    "layer2_alpha_v": (0.1, 0.4, 1.0),
    "layer2_rotation": (0.1, 0.9, 90.0),
}
WI, WO = (0.4, 0.3, 0.8), (-0.45, -0.15, 0.75)


def image(folder: Path, texels, name: str = "image.exr") -> Path:
    write_image(np.asarray(texels, np.float32), folder / name)
    return folder / name


def value(bsdf, u: float, wo=WO) -> np.ndarray:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.uv = dr.normalize(mi.Vector3f(*WI)), mi.Point2f(u, 0.5)
    dr.make_opaque(si)
    return np.array(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(*wo)))).ravel()


@pytest.mark.parametrize("key", VALUES)
def test_a_texel_is_a_constant(key: str, tmp_path) -> None:
    """Expected: each half of the surface is the stack with that texel's value, and the halves differ."""
    *texels, scale = VALUES[key]
    four = np.repeat(np.float32(texels)[None, :, None], 64, axis=1)  # so wide that filtering does not mix them
    texture = vt.Texture(texture=image(tmp_path, four), scale=scale)
    textured = vt.bsdf(STACK.replace(**{key: texture}), model="belcour2018")
    seen = [value(textured, u) for u in (0.25, 0.75)]
    for found, texel in zip(seen, texels):
        constant = vt.bsdf(STACK.replace(**{key: texel * scale}), model="belcour2018")
        np.testing.assert_allclose(found, value(constant, 0.5), rtol=0.01)
    assert not np.allclose(seen[0], seen[1], rtol=0.01)


@pytest.mark.parametrize("form", ("forward", "symmetric"))
@pytest.mark.parametrize("model", [model.name for model in MODELS])
def test_constant_images_change_nothing(model: str, form: str, tmp_path) -> None:
    """All values at once from images, all models, both forms: within 3 % (averages looked up, and not sampled once).

    `velatura` is the furthest off, by 2.2 %.
    """
    flat = {key: (low * scale, scale) for key, (low, _, scale) in VALUES.items()}
    constant = vt.bsdf(STACK.replace(**{k: v for k, (v, _) in flat.items()}), model=model, form=form)
    images = {
        key: vt.Texture(texture=image(tmp_path, np.full((2, 2, 1), v / s), f"{key}.exr"), scale=s)
        for key, (v, s) in flat.items()
    }
    textured = vt.bsdf(STACK.replace(**images), model=model, form=form)
    np.testing.assert_allclose(value(textured, 0.3), value(constant, 0.3), rtol=0.03)


def test_paint_and_glass_take_images(tmp_path) -> None:
    texels = image(tmp_path, np.full((2, 2, 3), (0.2, 0.4, 0.6)))
    painted = vt.bsdf(PAINT.replace(layer1_albedo=vt.Texture(texture=texels)), model="belcour2018")
    expected = vt.bsdf(PAINT.replace(layer1_albedo=(0.2, 0.4, 0.6)), model="belcour2018")
    np.testing.assert_allclose(value(painted, 0.5), value(expected, 0.5), rtol=0.02)
    rough = vt.bsdf(GLASS.replace(layer1_alpha=vt.Texture(texture=texels, channel="b")), model="belcour2018")
    expected = vt.bsdf(GLASS.replace(layer1_alpha=0.6), model="belcour2018")
    below = (-0.3, -0.2, -0.9)
    np.testing.assert_allclose(value(rough, 0.5, below), value(expected, 0.5, below), rtol=0.02)


def test_one_image_for_both_axes_leaves_an_interface_isotropic(tmp_path) -> None:
    texture = vt.Texture(texture=image(tmp_path, np.full((2, 2, 1), 0.2)))
    bsdf = vt.bsdf(GLASS.replace(layer0_alpha=texture))
    assert not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Anisotropic)


def test_channels_and_encodings_are_those_of_the_image(tmp_path) -> None:
    """Opacity, one channel of colours, grey as any of them, sRGB, scale and offset."""
    colours = np.uint8([[[51, 102, 153, 204]]])
    write_image(colours, tmp_path / "rgba.png")
    write_image(colours[..., :1], tmp_path / "grey.png")
    cases = {
        ("rgba.png", "b", "linear"): 0.6,
        ("rgba.png", "a", "linear"): 0.8,
        ("rgba.png", "g", "srgb"): 0.1329,
        ("rgba.png", "a", "srgb"): 0.8,
        ("grey.png", "g", "linear"): 0.2,
    }
    for (name, channel, encoding), texel in cases.items():
        texture = vt.Texture(texture=tmp_path / name, channel=channel, encoding=encoding, scale=0.5, offset=0.05)
        bsdf = vt.bsdf(STACK.replace(layer2_alpha_u=texture), model="belcour2018")
        found = bsdf.stacks[0].binding.images["layer2_alpha_u"].at(dr.zeros(mi.SurfaceInteraction3f), True)
        assert np.isclose(found[0], 0.5 * texel + 0.05, atol=2e-4), (name, channel, encoding)


def test_values_are_kept_within_their_range(tmp_path) -> None:
    texture = vt.Texture(texture=image(tmp_path, np.full((2, 2, 1), 0.5)), scale=100, offset=-200)
    bsdf = vt.bsdf(STACK.replace(layer0_alpha_u=texture, layer0_eta=texture, layer1_g=texture, layer1_depth=texture))
    interface, medium, *_ = bsdf.stacks[0].binding.at(dr.zeros(mi.SurfaceInteraction3f), True).layers
    assert interface.alpha_u[0] == 0 and medium.depth[0] == 0
    assert interface.eta[0][0] > 0 and medium.g[0] > -1
    assert np.isfinite(value(bsdf, 0.5)).all()


def _scene(bsdf) -> Any:
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2},
            "shape": {"type": "rectangle", "bsdf": bsdf},
            "light": {"type": "directional", "direction": [0.3, 0.2, -1], "irradiance": {"type": "rgb", "value": 1.0}},
            "sensor": {
                "type": "perspective",
                "fov": 28,
                "sampler": {"type": "multijitter", "sample_count": 1024},
                "to_world": mi.ScalarTransform4f().look_at([-1.5, -1.2, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
    )


def test_gradients_to_texels_are_finite_differences(tmp_path) -> None:
    """Three images of 2 by 2 on a rectangle, `prb` against central differences of a texel of each, to 3 %.

    The passes look through different points of the pixels, so these are spread evenly.
    """
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Interface(eta=0.2, k=3.9, alpha=(0.3, 0.2), rotation=30)])
    values = {"layer0_eta": (0.75, 0.9, 2.0), "layer1_alpha_u": (0.1, 0.4, 1.0), "layer1_rotation": (0.1, 0.6, 90.0)}
    images = {}
    for key, (low, high, scale) in values.items():
        texels = np.float32([[low, high], [0.6 * low + 0.4 * high, 0.3 * low + 0.7 * high]])[..., None]
        images[key] = vt.Texture(texture=image(tmp_path, texels, f"{key}.exr"), scale=scale)
    scene = _scene(vt.bsdf(stack.replace(**images), model="yamaguchi2019"))
    parameters = mi.traverse(scene)
    names = {key: f"shape.bsdf.{key}.data" for key in values}

    def brightness() -> Any:
        return dr.mean(mi.render(scene, parameters, spp=1024, seed=1), axis=None)

    def shifted(key: str, step: float) -> float:
        before = mi.TensorXf(parameters[names[key]])
        texels = np.array(before)
        texels[1, 0, 0] += step
        parameters[names[key]] = mi.TensorXf(texels)
        parameters.update()
        result = float(brightness().array[0])
        parameters[names[key]] = before
        parameters.update()
        return result

    slopes = {key: (shifted(key, 0.01) - shifted(key, -0.01)) / 0.02 for key in values}
    for name in names.values():
        dr.enable_grad(parameters[name])
    parameters.update()
    dr.backward(brightness())
    for key, name in names.items():
        gradient = np.array(dr.grad(parameters[name]))
        assert np.all(gradient != 0)
        assert np.isclose(gradient[1, 0, 0], slopes[key], rtol=0.03, atol=1e-5), (key, gradient, slopes[key])


def test_bad_images_are_refused_in_one_line(tmp_path) -> None:
    (tmp_path / "text.png").write_text("no image")
    grey = image(tmp_path, np.ones((2, 2, 1)), "grey.exr")
    holes = image(tmp_path, np.full((2, 2, 1), np.nan), "holes.exr")
    for path, channel, reason in (
        (tmp_path / "text.png", "r", "is no image that Mitsuba can read"),
        (grey, "a", "has no channel a, only r"),
        (holes, "r", "has texels that are not finite"),
    ):
        with pytest.raises(InvalidInput, match=rf"^layer0_alpha_u: the texture .*{path.name} {reason}$"):
            vt.bsdf(GLASS.replace(layer0_alpha=vt.Texture(texture=path, channel=channel)))
    with pytest.raises(InvalidInput, match=r"^layer0_alpha_u: needs a texture of numbers in .* llvm_ad_rgb$"):
        kernel.load_dict({"type": "layered", "material": "frosted-glass", "layer0_alpha": {"type": "diffuse"}})


@pytest.mark.parametrize("plugin", ("reference", "weidlich_wilkie"))
def test_the_other_plugins_take_images_too(plugin: str, tmp_path) -> None:
    texture = vt.Texture(texture=image(tmp_path, np.full((2, 2, 1), 0.25)))
    stack = vt.Stack([vt.Interface(eta=1.5, k=2.0, alpha=0.1)])
    found = value(vt.bsdf(stack.replace(layer0_alpha=texture), model=plugin), 0.5)
    np.testing.assert_allclose(found, value(vt.bsdf(stack.replace(layer0_alpha=0.25), model=plugin), 0.5), rtol=1e-3)
