"""Exported materials in Blender's Cycles, by Open Shading Language, against Mitsuba.

Rationale: a shader that compiles may still have another frame, other masking or other units. Both renderers draw one
plane under a white world, and under one sun in twelve directions, of the same closures: so only noise may differ.
What closures are off the model is another number, which stands in each file.

A picture has cells of 8 by 8 pixels, and each is drawn twice: the difference of the two gives the variance of a cell
with 64 degrees of freedom, regardless of its gradient. A test fails by chance in ALARM of all runs (Sidak).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from in_mitsuba import of_layers, of_table, pictures
from scipy.stats import t
from with_cycles import NEEDED, ROOT, SCENE
from with_cycles import pictures as by_cycles

import velatura as vt
from velatura import kernel
from velatura.model import named
from velatura.shader import closures
from velatura.shader.recorder import recording
from velatura.stack import Material, Stack

OUTPUT = ROOT / "site/blender"  # where pictures of both are left
pytestmark = NEEDED

CELL, ALARM = 8, 0.01
COLOURS = 3
FLOOR = 2e-4  # of a value: rounding of numbers in the text, and single precision


def _suns() -> list[list[float]]:
    """Twelve directions, three of them below."""
    found = []
    for k in range(12):
        cosine = (0.95, 0.75, 0.55, 0.35, 0.8, 0.6, 0.4, 0.9, 0.5, -0.9, -0.7, -0.4)[k]
        # The first ones are where the camera sees highlights
        azimuth = np.radians((90, 80, 100, 90, 0, 60, 130, 200, 300, 90, 70, 110)[k])
        sine = np.sqrt(1 - cosine * cosine)
        found.append([float(sine * np.cos(azimuth)), float(sine * np.sin(azimuth)), cosine])
    return found


JOB = {**SCENE, "size": 48, "spp": 64, "seeds": [1, 2], "lights": [None, *_suns()]}


@cache
def _textured(folder: Path) -> Stack:
    """Lacquered metal with a texture of roughness, and one of absorption."""
    mi = kernel.mitsuba()
    rng = np.random.default_rng(5)
    for name, channels in (("rough.exr", 1), ("tint.exr", 3)):
        mi.Bitmap(rng.uniform(0.1, 1, (8, 8, channels)).astype(np.float32)).write(str(folder / name))
    rough = {"texture": str(folder / "rough.exr"), "scale": 0.4, "offset": 0.05}
    tint = {"texture": str(folder / "tint.exr"), "scale": 0.8}
    coat = vt.Interface(eta=1.5, alpha=0.2)
    return vt.Stack(
        [coat, vt.Medium(depth=1, sigma_a=tint), vt.Interface(conductor="Al", alpha=rough)], name="textured"
    )


MATERIALS = {
    "isotropic": ("three-dielectrics-over-metal", "velatura"),
    "brushed": ("turned-brushing", "weier2020"),
    "textured": (_textured, "weier2020"),
    "transmissive": ("frosted-glass", "velatura"),
    "film": ("anodised-titanium", "weier2020"),
    "diffuse": ("glossy-plastic", "belcour2018"),
}


def _stack(name: str, folder: Path) -> tuple[Stack, str]:
    made, model = MATERIALS[name]
    return (made(folder) if callable(made) else vt.preset(made)), model


def _rougher(stack: Stack) -> Stack:
    """With a tenth more roughness."""
    alphas = {name: value for name, value in stack.flat().items() if "_alpha" in name and isinstance(value, float)}
    return stack.replace(**{name: 1.1 * value for name, value in alphas.items()})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("blender")


@pytest.fixture(scope="module")
def cycles(folder: Path) -> dict[str, np.ndarray]:
    """Pictures of all materials by Cycles, and of the first one with rougher interfaces."""
    stacks = {name: _stack(name, folder) for name in MATERIALS}
    stacks["control"] = _rougher(stacks["isotropic"][0]), stacks["isotropic"][1]
    made = {name: vt.export(stack, "blender", model) for name, (stack, model) in stacks.items()}
    scripts = {name: each.save(folder / f"{name}.py")[0] for name, each in made.items()}
    return by_cycles(folder, scripts, JOB)


@cache
def _in_mitsuba(name: str, folder: Path) -> np.ndarray:
    stack, model = _stack(name, folder)
    chosen = recording.drawn_by(stack, named(model))
    if chosen.closed_form:
        return pictures(of_layers(stack, chosen), JOB)
    return pictures(of_table(closures.tabulated(Material.of(stack).solid(), chosen)), JOB)


def _cells(found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of cells, (lights, rows, columns, colours), and their variances."""
    lights, _, size, _, _ = found.shape
    parts = found.reshape(lights, 2, size // CELL, CELL, size // CELL, CELL, COLOURS).transpose(0, 2, 4, 6, 1, 3, 5)
    parts = parts.reshape(*parts.shape[:5], -1).astype(float)
    apart = parts[..., 0, :] - parts[..., 1, :]
    return parts.mean(axis=(-2, -1)), (apart**2).sum(axis=-1) / 4 / CELL**4


def _scores(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Differences of cells over their standard deviations."""
    (mean_a, var_a), (mean_b, var_b) = _cells(a), _cells(b)
    floor = FLOOR * np.maximum(mean_a, mean_b) + 1e-7
    return np.maximum(np.abs(mean_a - mean_b) - floor, 0) / np.sqrt(var_a + var_b + 1e-20)


def _bound(count: int) -> float:
    alone = 1 - (1 - ALARM) ** (1 / (count * len(MATERIALS)))
    return float(t.isf(alone / 2, CELL * CELL))


@pytest.mark.parametrize("name", MATERIALS)
def test_cycles_and_mitsuba_agree(name: str, cycles: dict[str, np.ndarray], folder: Path) -> None:
    """Expected: no cell of any picture differs by more than noise does."""
    mine, theirs = cycles[name], _in_mitsuba(name, folder)
    _leave_picture(name, mine, theirs)
    scores = _scores(mine, theirs)
    means = _cells(mine)[0]
    assert means[0].max() > 0.05 and all(light.max() > 1e-3 for light in means[1:10])
    print(f"{name}: {scores.max():.2f} of {_bound(scores.size):.2f}, {scores.max(axis=(1, 2, 3)).round(1)} by light")
    assert scores.max() < _bound(scores.size)


def test_a_tenth_more_roughness_is_seen(cycles: dict[str, np.ndarray], folder: Path) -> None:
    """Expected: the comparison fails, so it can."""
    scores = _scores(cycles["control"], _in_mitsuba("isotropic", folder))
    assert scores.max() > 10 * _bound(scores.size)


def _leave_picture(name: str, mine: np.ndarray, theirs: np.ndarray) -> None:
    """Cycles on the left, Mitsuba on the right: the white world above, all suns below."""
    mi = kernel.mitsuba()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    sides = [np.concatenate([x[0].mean(axis=0), x[1:].mean(axis=1).sum(axis=0) / 4]) for x in (mine, theirs)]
    mi.util.write_bitmap(str(OUTPUT / f"{name}.png"), np.concatenate(sides, axis=1).astype(np.float32))
