"""Fields of directions on a surface: what a brushed material says at a point is what a turned one says there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.renderer.packets import aligned
from velatura.stack import Brushing, Interface, Stack

mi: Any = kernel.mitsuba("llvm_ad_rgb")
import drjit as dr  # noqa: E402

pytestmark = pytest.mark.usefixtures("one_thread")


def brushed(rotation: Any) -> Any:
    return vt.bsdf(Stack([Interface(conductor="Al", alpha=(0.05, 0.4), rotation=rotation)]), "yamaguchi2019")


_kept: list[Any] = []  # Mitsuba follows pointers to scenes and materials that Python alone holds


def seen(shape: dict[str, Any], at: list[list[float]]) -> Any:
    """What a ray from above meets at points (x, y) of a shape."""
    scene = mi.load_dict({"type": "scene", "shape": shape})
    _kept.append(scene)
    origin = mi.Point3f(*np.transpose([[x, y, 2.0] for x, y in at]).astype(np.float32))
    return scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))


def value(rotation: Any, si: Any, wi: list[float], wo: list[float]) -> Any:
    """f |cos| for directions in the world's coordinates, one column a point."""
    bsdf = brushed(rotation)
    _kept.append(bsdf)
    si.wi = si.to_local(dr.normalize(mi.Vector3f(*wi)))
    return np.array(bsdf.eval(mi.BSDFContext(), si, si.to_local(dr.normalize(mi.Vector3f(*wo)))))


@pytest.mark.parametrize(("field", "across"), [("radial", 0), ("concentric", 90)])
@pytest.mark.parametrize("shape", ["rectangle", "mirrored", "disk"])
def test_a_field_is_the_rotation_that_it_names_at_every_point(shape: str, field: str, across: float) -> None:
    """Expected: the tangent runs away from the centre or around it in space, regardless of texture coordinates."""
    angles = np.array([-170, -80, 20, 135])
    points = [[0.6 * np.cos(a), 0.6 * np.sin(a)] for a in np.deg2rad(angles)]
    flip = mi.ScalarTransform4f().scale([-1, 1, 1]) if shape == "mirrored" else mi.ScalarTransform4f()
    described = {"type": "disk" if shape == "disk" else "rectangle", "to_world": flip}
    # On a disk, coordinates are polar, and the tangent runs away from the middle as it is
    rotation = across if shape == "disk" else Brushing(brushing=field, offset=10)
    offset = 0 if shape == "disk" else 10
    plain = {"type": "rectangle"}
    wi, wo = [0.3, 0.1, 1.0], [-0.5, 0.4, 1.0]
    found = value(rotation, seen(described, points), wi, wo)
    for i, (angle, point) in enumerate(zip(angles, points)):
        turned = value(float(angle + across + offset), seen(plain, [point]), wi, wo)
        np.testing.assert_allclose(found[:, i], turned[:, 0], rtol=2e-4, atol=1e-6)


@pytest.mark.parametrize("model", ["belcour2018", "velatura"])
def test_very_long_facets_turn_with_their_rotation(model: str) -> None:
    """In single precision a matrix of their axes does not hold the shorter one."""
    rng, count, degrees = np.random.default_rng(3), 512, 40.0
    slopes = rng.normal(size=(2, count)) * [[2e-3], [0.5]]  # about the facets' own
    h = np.stack([*slopes, np.ones(count)]) / np.sqrt(1 + (slopes**2).sum(axis=0))
    wi = np.array([0.2, 0.1, np.sqrt(0.95)])
    wo = 2 * (wi @ h) * h - wi[:, None]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def light(rotation: float, by: np.ndarray) -> np.ndarray:
        layers = [Interface(eta=1.4, alpha=(0.003, 1.0), rotation=rotation), Interface(conductor="Al", alpha=0.3)]
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(*map(float, by @ wi))
        found = vt.bsdf(Stack(layers), model).eval(mi.BSDFContext(), si, mi.Vector3f(by @ wo))
        return np.where(wo[2] > 0, np.array(found), 0)

    straight, turned = light(0.0, np.eye(3)), light(degrees, turn)
    assert np.abs(turned - straight).sum() < 2e-3 * straight.sum()


def test_a_field_has_no_seam() -> None:
    """Expected: on both sides of where its angle jumps by a turn, the material is the same."""
    si = seen({"type": "rectangle"}, [[-0.5, 1e-5], [-0.5, -1e-5]])
    found = value(Brushing(brushing="radial"), si, [0.2, 0.3, 1], [0.1, -0.5, 1])
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-3)


def test_a_field_is_finite_at_its_centre_and_without_texture_coordinates() -> None:
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    assert np.isfinite(value(Brushing(brushing="radial"), si, [0, 0.1, 1], [0, 0, 1])).all()
    si = seen({"type": "rectangle"}, [[0.0, 0.0], [1e-20, 0.0]])
    assert np.isfinite(value(Brushing(brushing="radial"), si, [0, 0.1, 1], [0, 0, 1])).all()


@pytest.mark.parametrize(
    ("layers", "value"),
    [
        ([Interface(eta=1.49), Interface(eta=(2.5, 2.1, 2.6), k=0.7, alpha=0.54)], "layer1_alpha_v"),
        ([Interface(eta=1.43), Interface(eta=1.43, alpha=0.53)], "layer1_alpha_v"),
    ],
    ids=["coated metal", "glass"],
)
def test_light_does_not_jump_where_a_round_interface_becomes_brushed(layers: list[Any], value: str) -> None:
    """Expected: light that is reflected, and that passes, from either side, within .004 of itself where one roughness
    changes by 1e-4. Light is of directions that the round one draws."""
    stack, count = Stack(layers), 4096
    round_, brushed_ = vt.bsdf(stack), vt.bsdf(stack.replace(**{value: 1.0001 * stack.flat()[value]}))
    rng, context = np.random.default_rng(3), mi.BSDFContext()
    for up in (1.0, -1.0) if stack.transmits else (1.0,):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        z, phi = rng.uniform(0.1, 1, count), rng.uniform(0, 2 * np.pi, count)
        sine = np.sqrt(1 - z * z)
        si.wi = mi.Vector3f(*(mi.Float(aligned(x)) for x in (sine * np.cos(phi), sine * np.sin(phi), up * z)))
        u = rng.random((3, count))
        drawn, _ = round_.sample(context, si, mi.Float(aligned(u[0])), mi.Point2f(u[1:]))
        share = dr.select(drawn.pdf > 0, 1 / (count * dr.maximum(drawn.pdf, 1e-6)), 0)
        before, after = (np.array(dr.mean(x.eval(context, si, drawn.wo)) * share) for x in (round_, brushed_))
        reflected = np.array(drawn.wo.z) * up > 0
        for side in (reflected, ~reflected) if stack.transmits else (reflected,):
            assert abs(after[side].sum() - before[side].sum()) < 4e-3 * before[side].sum()
