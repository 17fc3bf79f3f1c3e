"""Spheres of glTF whose coats vary by one property a row, after Khronos' asset CoatParameterSweep: what they become."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.programs.closures import ViewAndLight
from velatura.programs.gltf import formulas

PAIRS, COLUMNS = 4, 4
BASE = {"baseColorFactor": [0.75, 0.75, 0.7, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.4}


def coat(**values: Any) -> dict[str, Any]:
    """A coat that does not darken, like a clearcoat."""
    named = {f"coat{name}": value for name, value in values.items()}
    return {"KHR_materials_coat": {"coatDarkeningFactor": 0.0, **named}}


def control(x: float, odd: bool) -> dict[str, Any]:
    """A clearcoat, or the coat that it is said to be."""
    if odd:
        return coat(Factor=x, RoughnessFactor=0.06)
    return {"KHR_materials_clearcoat": {"clearcoatFactor": x, "clearcoatRoughnessFactor": 0.06}}


#: Extensions of each row's spheres, by a number from 0 to 1.
ROWS = {
    "factor": lambda x: coat(Factor=x, RoughnessFactor=0.06),
    "colour": lambda x: coat(Factor=1.0, RoughnessFactor=0.06, ColorFactor=[1.0, 1 - 0.6 * x, 1 - 0.9 * x]),
    "darkening": lambda x: coat(Factor=1.0, RoughnessFactor=0.06, DarkeningFactor=x),
    "index": lambda x: coat(Factor=1.0, RoughnessFactor=0.06, Ior=1 + x),
    "brushed": lambda x: coat(Factor=1.0, RoughnessFactor=0.15, AnisotropyStrength=x),
    "normal": lambda x: coat(Factor=x, RoughnessFactor=0.1, NormalTexture={"index": 0}),
}


@pytest.fixture(scope="module")
def sweep(tmp_path_factory) -> dict[str, vt.imports.Imported]:
    """The materials of all spheres, by the names that they have in one file."""
    spheres = {f"control {n}": control(n // 2 / 3, bool(n % 2)) for n in range(2 * PAIRS)}
    spheres |= {f"{row} {n}": of(n / (COLUMNS - 1)) for row, of in ROWS.items() for n in range(COLUMNS)}
    materials = [{"name": name, "pbrMetallicRoughness": BASE, "extensions": each} for name, each in spheres.items()]
    used = sorted({name for each in spheres.values() for name in each})
    path: Path = tmp_path_factory.mktemp("sweep") / "sweep.gltf"
    images = {"images": [{"uri": "ripple.png"}], "textures": [{"source": 0}]}
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "extensionsUsed": used, "materials": materials, **images}))
    return {name: vt.imports.read(path, name) for name in spheres}


def row(sweep: dict[str, vt.imports.Imported], name: str) -> list[Any]:
    return [sweep[f"{name} {n}"].stack for n in range(COLUMNS)]


def albedo(material: Any) -> np.ndarray:
    """Light that comes back at the normal, by colours."""
    found: Any = vt.lobes(material, 1.0)
    return np.asarray(sum(found.energy) + found.remainder)[:, 0]


def test_a_clearcoat_is_the_coat_that_it_is_said_to_be(sweep: dict[str, vt.imports.Imported]) -> None:
    """Expected: equal materials in every pair, and equal light by the formulas of glTF; the first pair has no coat."""
    rng = np.random.default_rng(0)
    wi, wo = rng.normal(size=(2, 3, 200))
    pair = ViewAndLight(*(np.abs(w) / np.linalg.norm(w, axis=0) for w in (wi, wo)))
    for n in range(0, 2 * PAIRS, 2):
        here, there = (sweep[f"control {k}"].stack for k in (n, n + 1))
        assert here.replace(name="") == there.replace(name="")
        old, new = (control(n / 6, odd) for odd in (False, True))
        old_light, new_light = (
            formulas.value({key: x for part in each.values() for key, x in part.items()}, pair) for each in (old, new)
        )
        np.testing.assert_allclose(old_light, new_light, rtol=1e-12)
    assert len(sweep["control 0"].stack.layers) == 2 and isinstance(sweep["control 2"].stack, vt.Mix)


def test_the_share_of_a_coat_is_a_share_of_the_surface(sweep: dict[str, vt.imports.Imported]) -> None:
    bare, *partly, whole = row(sweep, "factor")
    assert len(bare.layers) == 2 and whole.layers[0].alpha == pytest.approx(0.06**2)
    assert [each.mix[0].weight for each in partly] == pytest.approx([1 / 3, 2 / 3], rel=1e-5)
    assert all(
        part.mix[0].material.layers == whole.layers and part.mix[1].material.layers == bare.layers for part in partly
    )


def test_rows_change_light_as_they_say(sweep: dict[str, vt.imports.Imported]) -> None:
    """Expected: amber coats take ever more blue and no red; coats that darken take ever more; a coat of index 1 is
    none, and others keep their index; brushed ones grow rougher along one axis alone."""
    colours = np.array([albedo(each) for each in row(sweep, "colour")])
    assert np.all(np.diff(colours[:, 2]) < 0) and np.ptp(colours[:, 0]) < 0.02
    darker = np.array([albedo(each) for each in row(sweep, "darkening")])
    assert np.all(np.diff(darker, axis=0) < 1e-6) and np.all(darker[-1] < darker[0])
    bare, *coated = row(sweep, "index")
    assert bare.layers == row(sweep, "factor")[0].layers
    assert [each.layers[0].eta for each in coated] == pytest.approx([1 + n / 3 for n in range(1, 4)], rel=1e-5)
    along = [each.layers[0].alpha for each in row(sweep, "brushed")]
    u, v = np.array([np.broadcast_to(each, 2) for each in along]).T
    assert np.all(np.diff(u) > 0) and v == pytest.approx(0.15**2)


def test_normals_of_the_coat_are_listed(sweep: dict[str, vt.imports.Imported]) -> None:
    assert [each.parameter for each in sweep["normal 3"].left] == ["coatNormalTexture"]
    assert not any(sweep[f"{name} 3"].left for name in ("control", "factor", "index", "brushed"))
