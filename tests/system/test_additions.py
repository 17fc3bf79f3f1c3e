"""What CONTRIBUTING says of additions, tried: a parameter, two kinds of layers and an engine are added to a copy of the
package.

The files that an addition takes are counted by the rows of CONTRIBUTING; a file too few, and the copy does not read it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import velatura

PACKAGE = Path(velatura.__file__).parent

# File -> what is replaced there. `dust` is a share by which an interface reflects less.
OF_DEFAULT = {
    "stack/layers.py": [
        ("    films: tuple[FilmValues, ...] = ()\n", "    films: tuple[FilmValues, ...] = ()\n    dust: Any = 0.0\n"),
        (
            "    films: Annotated[Taken[",
            '    dust: Annotated[float | Texture, Scalar("share of the reflected light", low=0, high=1)] = 0.0\n'
            "    films: Annotated[Taken[",
        ),
    ],
    "model/rough_interface.py": [
        ("    films: Coated | None = None\n", "    films: Coated | None = None\n    dust: float = 0.0\n"),
        ("angle, films=films or None)", "angle, films=films or None, dust=float(layer.dust))"),
        (
            "    def reflectance(self, cosine",
            "    def reflectance(self, cosine: Array) -> Array:\n"
            "        return (1 - self.dust) * self.clean(cosine)\n\n    def clean(self, cosine",
        ),
        (
            "    def _divided(self, cosine",
            "    def _divided(self, *light):\n        reflected, passing = self._clean(*light)\n"
            "        return [(1 - self.facets.dust) * each for each in reflected], passing\n\n"
            "    def _clean(self, cosine",
        ),
    ],
    "model/smooth_interface.py": [
        (
            "    films: Films | None = field(default=None, kw_only=True)\n",
            "    films: Films | None = field(default=None, kw_only=True)\n"
            "    dust: Value = field(default=0.0, kw_only=True)\n",
        ),
        ("n12, films=meeting.films)", "n12, films=meeting.films, dust=layer.dust)"),
        (
            "    def reflect(self, cos_theta",
            "    def reflect(self, cos_theta: Value) -> Value:\n"
            "        return (1 - self.dust) * self.clean(cos_theta)\n\n    def clean(self, cos_theta",
        ),
    ],
}
OF_OTHERS = {
    "model/papers/operators.py": [
        (
            "        r = ops.clip(reflectance(prepared, layer, cos_theta, lit, wi), 0.0, 1.0)\n",
            "        r = ops.clip(reflectance(prepared, layer, cos_theta, lit, wi) * (1 - layer.dust), 0.0, 1.0)\n",
        ),
    ],
    "reference/layers.py": [
        (
            "    def shares(self, j: Value, cosine: Value, ",
            "    def shares(self, j, *light):\n        reflected, passing = self.clean(j, *light)\n"
            "        return reflected * (1 - self.surface(j).dust), passing\n\n"
            "    def clean(self, j: Value, cosine: Value, ",
        ),
        ("    smooth: Value\n", "    smooth: Value\n    dust: Value = 0.0\n"),
        ("turn, smooth)", "turn, smooth, layer.dust)"),
    ],
    "plugins/weidlich_wilkie.py": [
        (
            "def _reflectance(meeting",
            "def _reflectance(meeting, cosine):\n"
            "    return (1 - meeting.layer.dust) * _clean(meeting, cosine)\n\n\ndef _clean(meeting",
        ),
    ],
}

TRIED = """
import sys
import numpy as np
import velatura as vt

def stack(dust):
    return vt.Stack([vt.Interface(eta=1.5, alpha=0.1, dust=dust), vt.Interface(eta=0.2, k=3.0, alpha=0.2)])

for model in sys.argv[1:]:
    clean, dusty = (np.array(vt.lobes(stack(d), 0.7, model=model).energy) for d in (0.0, 0.3))
    assert dusty[0].max() < 0.75 * clean[0].max(), model
"""
RENDERED = """
from velatura import kernel
mi = kernel.mitsuba()
si = mi.SurfaceInteraction3f()
si.wi = mi.Vector3f(0.6, 0, 0.8)
for model in ("reference", "weidlich_wilkie", "velatura"):
    light = [float(mi.Float(vt.bsdf(stack(d), model).eval(mi.BSDFContext(), si, mi.Vector3f(-0.6, 0, 0.8))[0])[0])
             if model != "reference" else vt.reference.statistics(stack(d), 0.8, paths=20_000).energy[0].max()
             for d in (0.0, 0.3)]
    assert light[1] < 0.97 * light[0], (model, light)
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package, without its page."""
    root = tmp_path_factory.mktemp("copy")
    shutil.copytree(PACKAGE, root / "velatura", ignore=shutil.ignore_patterns("page", "static", "__pycache__"))
    return root


def changed(copy: Path, root: Path, *changes: dict[str, list[tuple[str, str]]]) -> Path:
    """Another copy, with texts replaced."""
    shutil.copytree(copy, root, dirs_exist_ok=True)
    for path, pairs in (item for each in changes for item in each.items()):
        file = root / "velatura" / path
        text = file.read_text(encoding="utf-8")
        for old, new in pairs:
            assert text.count(old) == 1, f"{path}: {old}"
            text = text.replace(old, new)
        file.write_text(text, encoding="utf-8")
    return root


def run(root: Path, script: str, *arguments: str) -> None:
    environment = {**os.environ, "PYTHONPATH": str(root)}
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], env=environment, cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_parameter_takes_three_files_for_the_default_model(copy: Path, tmp_path: Path) -> None:
    assert len(OF_DEFAULT) == 3
    run(changed(copy, tmp_path, OF_DEFAULT), TRIED, "velatura")


def test_a_parameter_takes_six_files_in_all(copy: Path, tmp_path: Path) -> None:
    assert len({**OF_DEFAULT, **OF_OTHERS}) == 6
    models = [model.name for model in velatura.MODELS]
    run(changed(copy, tmp_path, OF_DEFAULT, OF_OTHERS), TRIED + RENDERED, *models)


# A colour filter by its absorbance, as data sheets have it, and a base of dots of two albedos
KINDS = {
    "stack/layers.py": [
        (
            "class LayerRecord(Record):",
            """@dataclass(frozen=True)
class FilterValues(SlabValues):
    kind: ClassVar[Kind] = "filter"
    g: ClassVar[float] = 0.0
    tau_s: ClassVar[float] = 0.0
    absorbance: Any

    @property
    def tau_a(self) -> Any:
        return 2.302585093 * self.absorbance


@dataclass(frozen=True)
class DotsValues(BaseValues):
    kind: ClassVar[Kind] = "dots"
    ink: Any
    paper: Any
    coverage: Any

    @property
    def albedo(self) -> Any:
        return self.coverage * self.ink + (1 - self.coverage) * self.paper


class LayerRecord(Record):""",
        ),
        (
            "Layer: TypeAlias = Interface | Medium | Diffuse\n",
            """class Filter(LayerRecord):
    record = FilterValues
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]] = {"filter": ()}
    surface = False
    title = "colour filter"

    absorbance: Annotated[float | RGB | Spectrum | Texture, Colour("decadic, along the normal", low=0)] = 0.1


class Dots(LayerRecord):
    record = DotsValues
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]] = {"dots": ()}
    opaque_kinds = frozenset({"dots"})
    surface = True
    title = "halftone"

    ink: Annotated[float | RGB | Spectrum | Texture, Colour("albedo of the ink", low=0, high=1)] = 0.05
    paper: Annotated[float | RGB | Spectrum | Texture, Colour("albedo of the paper", low=0, high=1)] = 0.8
    coverage: Annotated[float | Texture, Scalar("share of the surface under ink", low=0, high=1)] = 0.5


Layer: TypeAlias = Interface | Medium | Diffuse | Filter | Dots
""",
        ),
        ('"diffuse": Diffuse}', '"diffuse": Diffuse, "filter": Filter, "dots": Dots}'),
        (', "medium", "diffuse"]', ', "medium", "diffuse", "filter", "dots"]'),
    ],
    "stack/__init__.py": [("    DiffuseValues,\n", "    DiffuseValues,\n    Dots,\n    Filter,\n")],
    "__init__.py": [('        "Diffuse",\n', '        "Diffuse",\n        "Dots",\n        "Filter",\n')],
}
OF_KINDS = """
import sys
import numpy as np
import velatura as vt
from velatura import kernel
from velatura.stack import json_schema, parameter_table

coat, metal = vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=0.2, k=3.0, alpha=0.1)
filtered, printed = (
    [vt.Stack([coat, vt.Medium(sigma_a=2.302585093), metal]), vt.Stack([coat, vt.Filter(absorbance=1.0), metal])],
    [vt.Stack([coat, vt.Diffuse(albedo=0.35)]), vt.Stack([coat, vt.Dots(ink=0.1, paper=0.6, coverage=0.5)])],
)
mi = kernel.mitsuba()
si = mi.SurfaceInteraction3f()
si.wi = mi.Vector3f(0.6, 0, 0.8)
for old, new in (filtered, printed):
    assert vt.Stack.from_dict(new.to_dict()) == new == vt.Stack.from_flat(None, new.flat())
    for model in sys.argv[1:]:
        of_old, of_new = (vt.lobes(stack, 0.7, model=model) for stack in (old, new))
        np.testing.assert_allclose(of_new.energy, of_old.energy, atol=1e-12)
    walked = [vt.reference.statistics(stack, 0.8, paths=10_000).energy for stack in (old, new)]
    np.testing.assert_allclose(walked[1], walked[0], rtol=1e-4)
    for model in (sys.argv[-1], "weidlich_wilkie"):
        light = [vt.bsdf(stack, model).eval(mi.BSDFContext(), si, mi.Vector3f(-0.6, 0, 0.8)) for stack in (old, new)]
        np.testing.assert_allclose(light[1], light[0], rtol=1e-4)
    assert vt.export(new, to="glsl").text
    vt.export(new, to="openpbr")
text = parameter_table()
assert "| filter | `absorbance`" in text and "| dots | `coverage`" in text and "dots" in str(json_schema())
"""


def test_kinds_of_layers_take_three_files_but_for_the_page(copy: Path, tmp_path: Path) -> None:
    assert len(KINDS) == 3
    run(changed(copy, tmp_path, KINDS), OF_KINDS, *[model.name for model in velatura.MODELS])


ENGINE = '''
"""One lobe of the first interface alone, as an engine of its own."""

from dataclasses import dataclass
from typing import ClassVar

from velatura.model.base import SWITCHES
from velatura.model.papers.model import PaperModel


@dataclass(frozen=True)
class FirstModel(PaperModel):
    closed_form: ClassVar[bool] = True

    def statistics(self, material, wi):
        return super().statistics(type(material)(material.layers[:1], material.exterior, material.thin), wi)
'''
ENTRY = {
    "model/registry.py": [
        (
            "MODELS: tuple[Model, ...] = (\n",
            "from velatura.model.first.model import FirstModel\n\n"
            'MODELS: tuple[Model, ...] = (\n    FirstModel("first", reflectance="fresnel", tir="off"),\n',
        ),
    ]
}
LISTED = """
import velatura as vt
stack = vt.preset("coated-gold")
assert len(vt.lobes(stack, 1.0, model="first").energy) == 1
vt.bsdf(stack, model="first")
vt.export(stack, to="glsl", model="first")
"""


def test_an_engine_takes_a_room_and_an_entry(copy: Path, tmp_path: Path) -> None:
    root = changed(copy, tmp_path, ENTRY)
    room = root / "velatura/model/first"
    room.mkdir()
    (room / "__init__.py").touch()
    (room / "model.py").write_text(ENGINE, encoding="utf-8")
    run(root, LISTED)
