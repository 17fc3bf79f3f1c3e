"""Shares of a surface between 0 and 1, which become mixtures: each part against what is read with whole shares."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import imports, kernel
from velatura.programs.imported import Notes
from velatura.programs.mixture import beside
from velatura.stack.mix import DEEPEST, MOST

COLOUR = [0.6, 0.3, 0.1]


def from_gltf(**values: Any) -> imports.Imported:
    core = {"metallicFactor": 0.0, "baseColorFactor": [*COLOUR, values.pop("alpha", 1)]}
    extensions = {
        "KHR_materials_clearcoat": {"clearcoatFactor": values.pop("clearcoatFactor", 0)},
        "KHR_materials_transmission": {"transmissionFactor": values.pop("transmissionFactor", 0)},
        "KHR_materials_iridescence": {"iridescenceFactor": values.pop("iridescenceFactor", 0)},
    }
    return imports.from_gltf(
        {"pbrMetallicRoughness": {**core, **values}, "extensions": extensions, "alphaMode": "BLEND"}
    )


def from_principled(**values: Any) -> imports.Imported:
    return imports.from_principled({"type": "principled", "base_color": COLOUR, **values})


def from_standard_surface(**values: Any) -> imports.Imported:
    return imports.from_standard_surface(base_color=COLOUR, **values)


def from_openpbr(**values: Any) -> imports.Imported:
    return vt.from_openpbr(base_color=COLOUR, **values)


SHARES = {
    from_openpbr: ("base_metalness", "coat_weight", "thin_film_weight", "transmission_weight", "geometry_opacity"),
    from_standard_surface: ("metalness", "coat", "transmission", "opacity"),
    from_gltf: ("metallicFactor", "clearcoatFactor", "transmissionFactor", "iridescenceFactor", "alpha"),
    from_principled: ("metallic", "clearcoat", "spec_trans"),
}


def layers(material: Any) -> Any:
    return [(stack.layers, stack.thin) for _, stack in material.leaves()]


@pytest.mark.parametrize(("read", "name"), [(read, name) for read, names in SHARES.items() for name in names])
def test_a_share_is_the_weight_of_what_the_whole_gives(read: Callable[..., Any], name: str) -> None:
    """Expected: the stacks that are read with the share at 1 and at 0, the first with the share as weight; nothing is
    left that these do not leave."""
    found, whole, none = read(**{name: 0.3}), read(**{name: 1.0}), read(**{name: 0.0})
    assert isinstance(whole.stack, vt.Stack) and isinstance(none.stack, vt.Stack)
    assert layers(found.stack) == layers(whole.stack) + layers(none.stack)
    assert [part.weight for part in found.stack.mix] == [0.3, None]
    assert set(found.left) == {*whole.left, *none.left}
    assert vt.stack.loads(vt.stack.dumps(found.stack)) == found.stack


def test_metal_and_paint_reflect_by_their_shares() -> None:
    """Expected: F0 = m c of the metal, and (1 - m) (F + (1 - F) c) of the paint (OpenPBR 1.1, "Base")."""
    c, m, f = np.array(COLOUR), 0.3, 0.04
    found = vt.lobes(from_openpbr(base_metalness=m, specular_roughness=0).stack, 1.0)
    light = np.sum([energy[:, 0] for energy in found.energy], axis=0) + found.remainder[:, 0]
    np.testing.assert_allclose(light, m * c + (1 - m) * (f + (1 - f) * c), atol=2e-3)


def test_all_shares_at_once_are_products() -> None:
    """Expected: 13 stacks, nothing among them, with products of the shares that sum up to 1, and no notes."""
    values = dict(zip(SHARES[from_openpbr], (0.3, 0.4, 0.2, 0.5, 0.9)))
    metal, coat, film, clear, cover = values.values()
    found = from_openpbr(**values)
    parts = {stack.name: share for share, stack in found.stack.weighted("")}
    assert len(parts) == 13 and found.left == () and sum(parts.values()) == pytest.approx(1)
    assert parts["nothing"] == pytest.approx(1 - cover)
    assert parts["coated plain metal"] == pytest.approx(cover * coat * (1 - film) * metal)
    assert parts["uncoated iridescent clear dielectric"] == pytest.approx(
        cover * (1 - coat) * film * (1 - metal) * clear
    )


def test_what_a_coat_does_to_its_base_it_does_where_it_is() -> None:
    """Expected: of Standard Surface, the base's roughness and colour of a whole coat, and those of none."""
    given = {"coat_affect_roughness": 1.0, "coat_affect_color": 1.0, "coat_roughness": 0.5, "specular_roughness": 0.2}
    found = from_standard_surface(coat=0.5, **given)
    assert layers(found.stack) == [
        layer for coat in (1.0, 0.0) for layer in layers(from_standard_surface(coat=coat, **given).stack)
    ]


# Images --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def image(tmp_path: Path) -> Callable[..., vt.Texture]:
    def written(*texels: float, name: str = "mask", **options: Any) -> vt.Texture:
        path = tmp_path / f"{name}.exr"
        values = np.broadcast_to(np.array(texels, np.float32)[:, None, None], (len(texels), 2, 3))
        kernel.mitsuba().Bitmap(np.ascontiguousarray(values)).write(str(path))
        return vt.Texture(texture=path, **options)

    return written


@pytest.mark.parametrize(("read", "name"), [(read, names[0]) for read, names in SHARES.items() if read != from_gltf])
def test_an_image_of_shares_is_a_texture_of_weights(
    read: Callable[..., Any], name: str, image: Callable[..., vt.Texture]
) -> None:
    """Expected: the image as it is; of one that is 0 or 1 everywhere, the stack of that."""
    mask = image(0.0, 0.5, 1.0)
    found = read(**{name: mask})
    assert [part.weight for part in found.stack.mix] == [mask.model_copy(update={"channel": "r"}), None]
    assert found.left == ()
    for whole in (0.0, 1.0):
        assert read(**{name: image(whole, whole, name="level")}) == read(**{name: whole})


def test_one_channel_stands_for_an_image_of_colours(image: Callable[..., vt.Texture]) -> None:
    found: Any = from_standard_surface(opacity=image(0.2, 0.6))
    assert found.stack.mix[0].weight.channel == "g" and found.left == ()
    assert "one share for all colours" in str(from_standard_surface(opacity=(0.2, 0.4, 0.6)).left[0])


def test_images_deeper_than_mixtures_go_are_replaced_by_their_means(image: Callable[..., vt.Texture]) -> None:
    """Expected: with five shares, of the innermost two; the products that the means give, of values that are kept
    between 0 and 1."""
    names = SHARES[from_openpbr]
    numbers = dict(zip(names, (0.3, 0.4, 0.2, 0.5, 0.9)))
    masks = {**numbers, "base_metalness": image(-0.5, 0.6), "transmission_weight": image(0.4, 0.6, name="clear")}
    found, expected = from_openpbr(**masks), from_openpbr(**numbers)
    assert {each.parameter for each in found.left} == {"weight mask.exr", "weight clear.exr"}
    assert layers(found.stack) == layers(expected.stack)
    np.testing.assert_allclose(
        [share for share, _ in found.stack.weighted("")],
        [share for share, _ in expected.stack.weighted("")],
        rtol=1e-3,  # of images in half precision
    )


def test_textures_stay_where_they_fit(image: Callable[..., vt.Texture]) -> None:
    found = from_openpbr(
        coat_weight=image(0.1, 0.5), base_metalness=image(0.4, 0.6, name="metal"), geometry_opacity=0.5
    )
    textures = [value for at, value in found.stack.values() if at.name.endswith("weight")]
    assert sum(isinstance(value, vt.Texture) for value in textures) == 3 and found.left == ()


# Limits --------------------------------------------------------------------------------------------------------------


def test_the_greatest_shares_are_kept() -> None:
    """Expected: of 26 stacks the 16 on most of the surface, and each of the others in the notes."""
    shares = dict(zip(SHARES[from_openpbr], (0.3, 0.4, 0.2, 0.5, 0.9)))
    first, second = (from_openpbr(**shares, specular_ior=eta).stack for eta in (1.4, 1.5))
    notes = Notes()
    found = beside(0.7, first.replace(name="A"), second.replace(name="B"), notes)
    assert len(list(found.leaves())) == MOST
    own = sorted([0.7 * share for share, _ in first.weighted("")] + [0.3 * share for share, _ in second.weighted("")])
    assert [float(each.value) for each in notes.left] == pytest.approx(own[: 26 - MOST][::-1], rel=1e-3)
    assert all(each.parameter.startswith(("part A, ", "part B, ")) for each in notes.left)
    assert max(len(path) for path, _ in found.leaves()) == DEEPEST


def test_one_of_which_nothing_is_left_is_left_out() -> None:
    shares = dict(zip(SHARES[from_openpbr], (0.3, 0.4, 0.2, 0.5, 0.9)))
    first, notes = from_openpbr(**shares).stack, Notes()
    many = beside(0.5, first, from_openpbr(**{**shares, "geometry_opacity": 1.0}, base_weight=0.5).stack, notes)
    bare = vt.preset("bare-gold")
    assert beside(1e-9, bare, many, notes) == many
    assert beside(0.4, bare, bare.replace(name="other"), notes) == bare
    assert beside(0.0, bare, many, notes) == many and beside(1.0, bare, many, notes) == bare
