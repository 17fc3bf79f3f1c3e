"""The seam between shaders and their languages: a second printer, of Python, whose programs are run against NumPy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agreement import PATTERNS, coated, in_numpy, mixed_case, random_case
from evaluation import evaluate
from python_printer import PythonPrinter, put, run

import velatura as vt
from velatura.model import MODELS
from velatura.shader import Shader, constant, record, shader
from velatura.shader.lookups.bake import LobeLookUp
from velatura.shader.lookups.lookup import stacked
from velatura.shader.part import PartCode
from velatura.stack import Varying

PYTHON = PythonPrinter()
NAMES = [model.name for model in MODELS]


# Every model has patterns of all three shapes
BARE = [(pattern, NAMES[(k + 2 * (k // len(NAMES))) % len(NAMES)], False) for k, pattern in enumerate(PATTERNS)]
COATED = [(PATTERNS[k], model, True) for k, model in ((0, "belcour2018"), (18, "weier2020"), (9, "velatura"))]


@pytest.mark.parametrize(("pattern", "model", "films"), BARE + COATED, ids=str)
def test_another_language_prints_the_same_functions(pattern, model: str, films: bool) -> None:
    """Random stacks of every pattern: lobes, value, density and samples as the model has them, in double precision;
    films in single precision."""
    case = random_case(pattern, 20, np.random.default_rng(7))
    case = coated(case) if films else case
    recording, made = record(case.stack, model), shader(case.stack, model, printer=PYTHON)
    solved = made.columns is not None or films  # with a texture in single precision
    given = {"vt_baked": made.columns.astype(float)} if made.columns is not None else {}
    given |= {} if made.films is None else {"vt_films": made.films.astype(float)}
    program, truth = run(made.text, vt_tables=made.tables.astype(float), **given), in_numpy(case, recording)
    m = program.VtMaterial()
    for name, place in made.uniforms.items():
        put(m, place, case.values[name])

    lobes = program.vt_lobes(m, case.directions["wi"])
    seen = [*getattr(lobes, "reflected", []), *([lobes.transmitted] if hasattr(lobes, "transmitted") else [])]
    energies = (
        program.vt_energies(m, case.directions["wi"]) if made.columns is not None else [lobe.energy for lobe in seen]
    )
    energy = [np.broadcast_to(x, (3, 20)) for x in energies]
    np.testing.assert_allclose(energy, truth.energy, rtol=1e-6 if solved else 1e-10, atol=1e-14)
    value, density = program.vt_eval_pdf(m, lobes, case.directions["wi"], case.directions["wo"])
    np.testing.assert_allclose(np.broadcast_to(value, (3, 20)), truth.value, rtol=1e-5 if solved else 1e-9, atol=1e-14)
    # The share of the remainder is what single precision leaves of 1
    rtol, atol = (1e-5, 1e-8) if solved else (1e-9, 1e-14)
    np.testing.assert_allclose(np.broadcast_to(density, 20), truth.density, rtol=rtol, atol=atol)
    drawn = program.vt_sample(m, lobes, case.directions["wi"], case.directions["u"])
    np.testing.assert_allclose(np.broadcast_arrays(*drawn), truth.drawn, atol=1e-5 if solved else 1e-11)


@pytest.mark.parametrize(
    ("patterns", "model", "films"),
    [
        ((9, 15, 9), "weier2020", False),
        ((12, 19, 20), "belcour2018", False),
        ((9, 0, 18), "velatura", False),
        ((9, 9, 9), "weier2020", True),
    ],
)
def test_a_mixture_is_the_weighted_sum_of_its_parts(patterns: tuple[int, ...], model: str, films: bool) -> None:
    """Expected: value and density are weighted sums of those of the parts in NumPy; a sample is that of the part that
    the first number chooses. Parts of one kind share their functions, where these read no tables of their own."""
    case = mixed_case([PATTERNS[k] for k in patterns], 20, np.random.default_rng(7), films)
    made = shader(case.whole.stack, model, printer=PYTHON)
    solved = made.columns is not None
    given = {"vt_baked": made.columns.astype(float)} if made.columns is not None else {}
    given |= {} if made.films is None else {"vt_films": made.films.astype(float)}
    program = run(made.text, vt_tables=made.tables.astype(float), **given)
    m, (wi, wo, u) = program.VtMaterial(), (case.whole.directions[name] for name in ("wi", "wo", "u"))
    for name, place in made.uniforms.items():
        put(m, place, case.whole.values[name])
    truth, lobes = case.in_numpy(model), program.vt_lobes(m, wi)
    value, density = program.vt_eval_pdf(m, lobes, wi, wo)
    loose = solved or films
    np.testing.assert_allclose(np.broadcast_to(value, (3, 20)), truth.value, rtol=1e-5 if loose else 1e-9, atol=1e-8)
    np.testing.assert_allclose(density, truth.density, rtol=1e-5 if loose else 1e-9, atol=1e-8)
    np.testing.assert_allclose(program.vt_sample(m, lobes, wi, u), truth.drawn, atol=1e-5 if loose else 1e-9)
    assert hasattr(program, "vt_part1_part1_lobes") == (loose or patterns[2] != patterns[0])


def test_textures_and_brushing_are_read_where_the_material_is(tmp_path: Path) -> None:
    for name in ("scratches.png", "wood.png"):
        (tmp_path / name).touch()
    scratches = {"texture": str(tmp_path / "scratches.png"), "scale": 0.5, "offset": 0.1, "channel": "g"}
    wood = {"texture": str(tmp_path / "wood.png"), "scale": 2.0}
    brushing = {"brushing": "concentric", "u": 0.25, "v": 0.5, "offset": 10}
    coat = vt.Interface(eta=[1.4, 1.5, 1.6], alpha=[scratches, 0.2], rotation=brushing)
    made = shader(vt.Stack([coat, vt.Diffuse(albedo=wood)]), printer=PYTHON)
    texels = {
        "vt_map_layer0_alpha_u": lambda uv: [0.0, uv[0], 0.0, 1.0],
        "vt_map_layer1_albedo": lambda uv: [0.1, uv[1], 0.9],
    }
    assert {name: image.texture.name for name, image in made.maps.items()} == {
        "vt_map_layer0_alpha_u": "scratches.png",
        "vt_map_layer1_albedo": "wood.png",
    }
    m = run(made.text, **texels).vt_material((0.75, 0.5 + math.sqrt(0.75)))
    assert m.exterior == 1.0
    assert (m.layer0.alpha_u, m.layer0.alpha_v) == (0.475, 0.2)
    assert m.layer0.rotation == pytest.approx(60 + 90 + 10)
    np.testing.assert_allclose(m.layer0.eta.ravel(), [1.4, 1.5, 1.6])
    np.testing.assert_allclose(m.layer1.albedo.ravel(), [0.2, 1.0, 1.0])


def test_weights_are_read_where_the_material_is(tmp_path: Path) -> None:
    """Expected: shares of texels, divided by their sum where that exceeds 1; a constant weight is worked in."""
    (tmp_path / "worn.png").touch()
    mask = {"texture": str(tmp_path / "worn.png"), "channel": "g", "scale": 2.0}
    paint = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=0.4)])
    mix = vt.Mix([(mask, "bare-gold"), (0.5, paint), (None, paint)])
    made = shader(mix, "weier2020", ["part1_weight"], printer=PYTHON)
    assert "part1_weight" not in made.uniforms and list(made.maps) == ["vt_map_part0_weight"]
    given = {"vt_map_part0_weight": lambda uv: [0.0, uv, 0.0, 1.0], "vt_tables": made.tables.astype(float)}
    program, wi = run(made.text, **given), (np.zeros(1), np.zeros(1), np.ones(1))
    for texel, expected in ((0.1, (0.2, 0.5, 0.3)), (0.5, (2 / 3, 1 / 3, 0.0))):
        lobes = program.vt_lobes(program.vt_material(np.array([texel])), wi)
        np.testing.assert_allclose(
            np.ravel([lobes.part0_share, lobes.part1_share, lobes.part2_share]), expected, atol=1e-12
        )
    assert made.text.count("def vt_part") == 3 * 2  # paint and gold
    with pytest.raises(vt.InvalidInput, match="constant: unknown parameter 'part2_weight'"):
        shader(mix, "weier2020", ["part2_weight"])


def filled(part: PartCode, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """The lobes of a stack over direction, as its tape gives them: a line for each texel, side and azimuth."""
    baked = part.recording.baked
    assert isinstance(baked, LobeLookUp)
    nodes, sides = baked.nodes, baked.sides
    x, y = np.meshgrid(*(np.linspace(0, 1, n) for n in (nodes[0], nodes[1] if len(nodes) > 1 else 1)))
    inputs = {f"m.{place}": values[part.prefix + name] for name, place in part.recording.parameters.items()}
    inputs |= {"place.x": x.ravel(), "place.y": y.ravel()}
    columns = [evaluate(baked.columns, {**inputs, "place.z": float(side)}) for side in range(sides)]
    grid = np.array([[np.broadcast_to(column, x.size) for column in side] for side in columns])
    return grid.reshape(sides, -1, 4, *x.shape).transpose(1, 0, 3, 4, 2).reshape(-1, nodes[0], 4)


def given_uniforms(material: Any, made: Shader, given: Mapping[str, Any]) -> tuple[Any, Any]:
    """A program whose values change, and its struct with those of a material."""
    program = run(made.text, **given, vt_parameters=None)
    parameters, values = program.VtMaterial(), values_of(material)
    for name, place in made.uniforms.items():
        if name in values and has(parameters, place):
            put(parameters, place, values[name])
    return program, run(made.text, **given, vt_parameters=parameters).vt_material((0.5, 0.5))


def has(struct: Any, place: str) -> bool:
    """Whether a struct has a place, as those that only a tape reads are not in it."""
    first, _, rest = place.partition(".")
    return hasattr(struct, first) and (not rest or has(getattr(struct, first), rest))


def values_of(material: Any) -> dict[str, np.ndarray]:
    flat = [
        (address, np.ravel(constant(address, value)))
        for address, value in material.values()
        if not isinstance(value, Varying)
    ]
    return {address.name: np.resize(x, (3, 1)) if address.colour else x for address, x in flat}


@pytest.mark.parametrize("name", ["coated-gold", "varnished-paint", "frosted-glass"])
def test_lobes_over_direction_are_read_in_another_language(name: str) -> None:
    """Parameters from a uniform, weights of lobes, and lobes from the texture that the tape fills."""
    stack = vt.preset(name)
    made = shader(stack, "belcour2018", values="uniforms", printer=PYTHON)
    shown = np.ones(len(made.shown))
    given = {"vt_tables": made.tables, "vt_baked": filled(made.parts[0], values_of(stack)), "vt_shown": shown}
    program, m = given_uniforms(stack, made, given)
    cos_theta = np.array([0.2, 0.5, 0.9])
    wi = (np.sqrt(1 - cos_theta**2), np.zeros(3), cos_theta)
    expected = vt.lobes(stack, cos_theta=cos_theta, model="belcour2018")
    lobes = program.vt_lobes(m, wi)
    np.testing.assert_allclose([lobe.energy for lobe in lobes.reflected], expected.energy, atol=2e-3)
    shown[0] = 0
    assert not program.vt_lobes(m, wi).reflected[0].energy.any()


def test_each_part_of_a_mixture_whose_values_change_reads_its_own(tmp_path: Path) -> None:
    """Weights and values from a uniform, one within another; weights of lobes and lines of the texture of each part,
    also of two of the same kind; a mask as a weight."""
    (tmp_path / "worn.png").touch()
    mask = {"texture": str(tmp_path / "worn.png")}
    inner = vt.Mix([(0.2, vt.preset("bare-gold").replace(layer0_alpha=0.4)), (None, "coated-gold")])
    mix = vt.Mix([(mask, "bare-gold"), (None, inner)])
    made = shader(mix, "belcour2018", values="uniforms", printer=PYTHON)
    drawn = [filled(part, values_of(mix)) for part in made.parts]
    assert list(made.lines) == [0, len(drawn[0]), len(drawn[0]) + len(drawn[1])]
    shown = {f"vt_{part.prefix}shown": np.ones(len(part.recording.shown)) for part in made.parts}
    texture = {"vt_map_part0_weight": lambda uv: [0.3, 0.0, 0.0, 1.0]}
    given = {"vt_tables": made.tables, "vt_baked": stacked(drawn), **shown, **texture}
    program, m = given_uniforms(mix, made, given)
    cos_theta = np.array([0.2, 0.5, 0.9])
    lobes = program.vt_lobes(m, (np.sqrt(1 - cos_theta**2), np.zeros(3), cos_theta))
    for part, (_, stack), share in zip(made.parts, mix.leaves(), (0.3, 0.14, 0.56)):
        expected = vt.lobes(stack, cos_theta=cos_theta, model="belcour2018")
        own = getattr(lobes, part.member)
        np.testing.assert_allclose(getattr(lobes, f"{part.member}_share"), share, atol=1e-12)
        np.testing.assert_allclose([lobe.energy for lobe in own.reflected], expected.energy, atol=2e-3)
    shown["vt_part1_part0_shown"][0] = 0
    hidden = program.vt_lobes(m, (np.zeros(1), np.zeros(1), np.ones(1)))
    assert not hidden.part1_part0.reflected[0].energy.any() and hidden.part0.reflected[0].energy.all()
