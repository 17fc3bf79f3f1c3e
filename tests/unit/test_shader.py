"""The recorder: what the model does is recorded, printed, and the same as in NumPy. A browser is not needed here."""

from __future__ import annotations

import compileall
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agreement import PATTERNS, in_numpy, random_case
from evaluation import evaluate
from manual import ROOT
from python_printer import reader

import velatura as vt
from velatura import ops, tables
from velatura.errors import InvalidInput
from velatura.shader import Recording, constant, record, shader
from velatura.shader.lookups.atlas import texels
from velatura.shader.lookups.bake import LobeLookUp
from velatura.shader.lookups.columns import SolvedLookUp
from velatura.shader.lookups.films import tables as tables_of_films
from velatura.shader.lookups.lookup import Group
from velatura.shader.material import place
from velatura.shader.printers.glsl import GLSL
from velatura.shader.printers.statements import statements
from velatura.shader.recorder.cost import Cost, cost
from velatura.shader.recorder.graph import Graph
from velatura.shader.recorder.symbol import Symbol, colour, component, in_order, number
from velatura.shader.recorder.tape import tape
from velatura.stack import Named, loads, rgb

GUIDES = ROOT / "docs" / "how-to"
X, Y = np.random.default_rng(1).uniform(0.05, 0.95, (2, 20))
RGB = np.random.default_rng(2).uniform(0.05, 0.95, (3, 20))


def printed(value: Symbol) -> str:
    """The statements for a value, and the expression that it ends in."""
    lines, texts = statements([(value, value.kind)], GLSL)
    return "\n".join([*lines, *texts])


# Symbols


@pytest.mark.parametrize(
    "function",
    [
        lambda x, y, c: x + 2 * y - c / x,
        lambda x, y, c: -x * (1 - c) / (y - 2),
        lambda x, y, c: ops.sqrt(x - y) + ops.exp(-c) + ops.log(x),
        lambda x, y, c: ops.power(c, x) * ops.sin(x) * ops.cos(c),
        lambda x, y, c: ops.arctan2(x, c) + ops.absolute(x - y),
        lambda x, y, c: ops.clip(c, 0.2, x),
        lambda x, y, c: ops.select((x < y) & (c > 0.5), c, y),
        lambda x, y, c: ops.select((x <= y) & (x >= 0.1), 1.0, c),
        lambda x, y, c: ops.divide(x, c - c) * ops.mean(c),
        lambda x, y, c: np.array([0.1, 0.2, 0.3])[:, None] * c + x * np.array([0.5, 0.0, 2.0])[:, None],
        lambda x, y, c: ops.select(np.array([True, False, True])[:, None], x, y) + 0 * c,
        lambda x, y, c: ops.interpolate(tables.load().dielectric, x, y)[5] + 0 * c,
        lambda x, y, c: ops.interpolate(tables.load().inside, x, c, y)[0],
        lambda x, y, c: ops.interpolate(tables.load().absorbing_inside, x, y, c)[8],
    ],
)
def test_what_is_recorded_is_what_is_computed(function) -> None:
    recorded = function(number("x"), number("y"), colour("c"))
    found = evaluate([recorded], {"x": X, "y": Y, "c": RGB})[0]
    expected = function(X, Y, RGB)
    np.testing.assert_allclose(np.broadcast_to(found, expected.shape), expected, rtol=1e-14)


def test_constants_fold_and_neutral_elements_go() -> None:
    x = number("x")
    for same in (x + 0, 0.0 + x, x - 0.0, 1 * x, x / 1.0, ops.select(x > 0, x, x), ops.select(True, x, 2.0)):
        assert same is x
    for zero in (0.0 * x, x * 0, 0.0 / x):
        assert zero == 0.0
    assert ops.select(x > 0, 2.0, 2.0) == 2.0
    assert (x > 0) & False is False
    assert ops.mean(x) is x
    assert component((0.1, 0.2, 0.3), 1) == 0.2


def test_the_model_may_not_ask_whether_a_value_holds() -> None:
    with pytest.raises(TypeError, match=r"ops\.select"):
        bool(number("x") > 0)


def test_equal_values_are_worked_out_once() -> None:
    x, y = number("x"), number("y")
    graph = Graph()
    a, b = graph.unique([ops.exp(x + y) * 2, 2 * ops.exp(y + x)])
    assert a is b
    assert len(in_order([a])) == 5  # x, y, the sum, its exponential, the product


def test_what_is_given_is_read() -> None:
    x = number("x")
    graph = Graph()
    first, second = graph.unique([ops.exp(x), ops.sqrt(ops.exp(x))])
    assert isinstance(first, Symbol)
    (found,) = Graph({first: number("l.first")}).unique([second])
    assert isinstance(found, Symbol)
    assert printed(found) == "vt_sqrt(l.first)"


# Statements


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (number("x") - (number("y") - 1), "x - (y - 1.0)"),
        (number("x") / (number("x") * number("y")), "x / (x * y)"),
        ((number("x") + 1) * -number("y"), "(x + 1.0) * -y"),
        (ops.clip(number("x"), 0.0, 1.0), "clamp(x, 0.0, 1.0)"),
        (ops.maximum(number("x"), 1e-15), "max(x, 1e-15)"),
        (ops.select(number("x") < 0, 1.0, number("x")), "vt_choice(x < 0.0, 1.0, x)"),
        (ops.select(colour("c") < 0.5, 1.0, colour("c")), "mix(c, vec3(1.0), lessThan(c, vec3(0.5)))"),
        (ops.power(colour("c"), 1.5), "pow(c, vec3(1.5))"),
        (colour("c") * np.array([0.5, 1.0, 2.0]), "c * vec3(0.5, 1.0, 2.0)"),
    ],
)
def test_operators_bind_as_they_should(value: Symbol, text: str) -> None:
    assert printed(value) == text


def test_what_is_used_twice_has_a_name() -> None:
    twice = number("x") * number("y")
    assert printed(twice + ops.exp(twice)) == "float value = x * y;\nvalue + exp(value)"


def test_names_and_titles_are_those_of_the_model() -> None:
    text = shader(vt.preset("coated-gold"), "belcour2018").text
    assert "// Sum the bounces between the stack and the layer (Belcour 2018, Eqs. 28-31)" in text
    assert "vec3 bounces = 1.0 / max(" in text


# Shaders


@pytest.mark.parametrize("model", ["belcour2018", "weier2020", "yamaguchi2019", "realtime", "velatura"])
@pytest.mark.parametrize("pattern", [PATTERNS[k] for k in (0, 13, 24, 39, 52)], ids=str)
def test_a_recording_answers_as_numpy_does(pattern, model: str) -> None:
    """The expressions that are printed, worked out in double precision, against the functions called directly."""
    case = random_case(pattern, 40, np.random.default_rng(3))
    recording = record(case.stack, model)
    truth = in_numpy(case, recording)
    values: dict[str, Any] = {f"m.{place}": case.values[name] for name, place in recording.read.items()}
    values |= {f"{name}.{axis}": w[k] for name, w in case.directions.items() for k, axis in enumerate("xyz")}
    solved = isinstance(recording.baked, SolvedLookUp)  # with a texture in single precision
    if isinstance(recording.baked, SolvedLookUp):
        values["vt_baked"] = reader(recording.baked)

    lobes = dict(zip(recording.lobes, evaluate(list(recording.lobes.values()), values)))
    energies = [value for name, value in lobes.items() if name.endswith(".energy")]
    energies = [np.broadcast_to(x, (3, 40)) for x in energies or evaluate(recording.energies, values)]
    np.testing.assert_allclose(energies, truth.energy, rtol=1e-6 if solved else 1e-12, atol=1e-15)

    values |= {f"l.{name}": value for name, value in lobes.items()}
    values |= {f"l.{name}.r": value for name, value in lobes.items()}
    value, density, *drawn = evaluate([recording.value, recording.density, *recording.drawn], values)
    value = np.broadcast_to(np.reshape(value, (-1, 40)), (3, 40))
    np.testing.assert_allclose(value, truth.value, rtol=1e-5 if solved else 1e-10, atol=1e-15)
    # The chance of the remainder is what those of lobes leave of 1
    np.testing.assert_allclose(density, truth.density, rtol=1e-5 if solved else 1e-10, atol=1e-8 if solved else 1e-15)
    np.testing.assert_allclose(drawn, truth.drawn, atol=1e-5 if solved else 1e-12)


def test_many_smooth_layers_keep_all_energy_in_single_precision() -> None:
    layers = [vt.Interface(eta=1.5 if k % 2 == 0 else 1.3) for k in range(29)]
    recording = record(vt.Stack([*layers, vt.Interface(conductor="mirror")]), "belcour2018")
    values = {f"m.{place}": np.float32(recording.stack.flat()[name]) for name, place in recording.read.items()}
    values |= {f"wi.{axis}": np.float32([x]) for axis, x in zip("xyz", (np.sqrt(0.99), 0.0, 0.1))}
    energies = [x for name, x in recording.lobes.items() if name.endswith(".energy")]
    assert np.allclose(sum(np.broadcast_to(x, (3, 1)) for x in evaluate(energies, values)), 1, atol=1e-4)


def test_lobes_are_worked_out_once_for_a_direction() -> None:
    """`eval` and `sample` read what `lobes` leaves: no layer is added up again, and no table is read."""
    recording = record(vt.preset("varnished-paint"), "belcour2018")
    assert any(symbol.op == "texels" for symbol in in_order(list(recording.lobes.values())))
    assert not any(symbol.op in ("texels", "value") for symbol in in_order(list(recording.drawn)))
    reads = {symbol.detail for symbol in in_order([recording.value]) if symbol.op == "input"}
    assert {"l.reflected[0].energy.r", "l.reflected[0].energy"} & reads
    assert "l.base_scale" in reads


def test_a_constant_is_no_uniform() -> None:
    stack = vt.preset("coated-gold")
    names = ["layer0_eta", "layer2_eta", "layer2_k"]
    free, fixed = shader(stack, "belcour2018"), shader(stack, "belcour2018", names)
    assert set(free.uniforms) - set(fixed.uniforms) == set(names)
    assert len(fixed.text) < 0.85 * len(free.text)
    assert "m.layer0.eta" not in fixed.text


def test_all_constant_leaves_only_directions() -> None:
    stack = vt.preset("coated-gold")
    recording = record(stack, "belcour2018", constant=list(stack.flat()))
    assert recording.read == {}
    found = evaluate([recording.lobes["reflected[1].energy"]], {"wi.x": 0.6, "wi.y": 0.0, "wi.z": 0.8})[0]
    expected = vt.lobes(stack, cos_theta=0.8, model=recording.model).energy[1]
    np.testing.assert_allclose(np.reshape(found, (3, 1)), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("constant", "switches", "message"),
    [
        (["layer0_ior"], {}, "constant: unknown parameter 'layer0_ior'"),
        ([], {"tir": "perhaps"}, "tir: must be one of"),
        ([], {"channels": "separate"}, "channels=separate: only for lobes and inverse"),
    ],
)
def test_what_cannot_be_recorded_is_said_in_a_line(constant, switches, message: str) -> None:
    with pytest.raises(InvalidInput, match=message) as error:
        record(vt.preset("coated-gold"), "belcour2018", constant, **switches)
    assert "\n" not in str(error.value)


def test_a_base_alone_has_no_lobes() -> None:
    assert record(vt.Stack([vt.Diffuse(albedo=0.5)])).kinds.keys() == {"base_scale", "base_energy"}
    assert "VtLobe " not in str(shader(vt.Stack([vt.Diffuse(albedo=0.5)])))


def test_textures_become_samplers(tmp_path: Path) -> None:
    scratches, wood = tmp_path / "scratches.png", tmp_path / "wood.png"
    for path in (scratches, wood):
        path.touch()
    alpha = {"texture": str(scratches), "scale": 0.5, "offset": 0.1, "channel": "g"}
    albedo = {"texture": str(wood), "encoding": "srgb", "curve": [0, 0.5]}
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=alpha), vt.Diffuse(albedo=albedo)])
    text = shader(stack).text
    assert "// scratches.png\nuniform highp sampler2D vt_map_layer0_alpha_u;\n" in text
    assert "m.layer0.alpha_u = clamp(texture(vt_map_layer0_alpha_u, uv).g * 0.5 + 0.1, 0.0, 1.0);" in text
    assert "// wood.png, to be decoded from sRGB, and taken through the curve 0, 0.5\n" in text
    assert str(tmp_path) not in text
    with pytest.raises(InvalidInput, match="layer0_alpha_u"):
        shader(stack, constant=["layer0_alpha_u"])


@pytest.mark.parametrize("model", ["belcour2018", "velatura"])
def test_no_change_of_a_value_changes_the_code(model: str) -> None:
    """No rotation, no scattering, one number for a colour: all are values. (A pair of equal roughnesses is one.)"""

    def key(eta: object, alpha: object, rotation: float, sigma_s: float, metal: float) -> str:
        coat = {"interface": {"eta": eta, "alpha": alpha, "rotation": rotation}}
        medium = {"medium": {"sigma_a": 0.1, "sigma_s": sigma_s}}
        base = {"interface": {"eta": 0.2, "k": metal, "alpha": 0.3}}
        return shader(vt.Stack([coat, medium, base]), model, values="uniforms").key

    assert key(1.5, [0.1, 0.2], 30, 0.1, 3) == key([1.4, 1.5, 1.6], [0.3, 0.1], 0, 0, 0)
    assert key(1.5, [0.1, 0.2], 30, 0.1, 3) != key(1.5, 0.1, 30, 0.1, 3)


def test_a_uniform_material_is_shaded_without_its_layers() -> None:
    """The program reads neither tables nor media; the tape that works out the lobes does."""
    made = shader(vt.preset("varnished-paint"), "belcour2018", values="uniforms")
    assert isinstance(made.baked, LobeLookUp)
    assert "vt_tables" not in made.text
    assert "sigma_a" not in made.text
    assert "dielectric_multi" in made.baked.tape.tables
    assert "m.layer1.sigma_a" in made.baked.tape.inputs
    assert "layer1_sigma_a" in made.uniforms


def test_another_medium_is_shaded_by_the_same_program() -> None:
    coat, metal = {"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"eta": 0.2, "k": 3, "alpha": 0.3}}
    medium = {"medium": {"depth": 0.5, "sigma_a": 0.4}}
    bare, filled = (
        shader(vt.Stack(layers), "belcour2018", values="uniforms") for layers in ([coat, metal], [coat, medium, metal])
    )
    assert bare.text == filled.text
    assert bare.key != filled.key


# Materials that are solved


@pytest.mark.parametrize(
    ("name", "fetches", "printed", "lines"),
    [
        ("coated-gold", 20, "takes 20 texel fetches for coated brushed gold", 370),
        ("coated-rough-metal", 4, "4 for a coated isotropic metal", 310),
        ("frosted-glass", 54, "54 for a pane", None),
    ],
)
def test_a_solved_material_takes_few_fetches(name: str, fetches: int, printed: str, lines: int | None) -> None:
    """Energies, which neither values nor samples need, are read apart; and nothing of the layers is. The lobe of a
    brushed metal is two. The manual has the same, and in its table of engines 16 bytes each."""
    made = shader(vt.preset(name))
    assert isinstance(made.baked, SolvedLookUp)
    columns, energies = made.baked.groups
    assert (columns.name, energies.name) == ("columns", "energies")
    assert columns.texels * 2 ** len(made.baked.nodes) == made.costs["vt_lobes"].texels == fetches
    assert f"vt_lobes: {made.costs['vt_lobes'].operations} operations, {fetches} texels read" in made.text
    assert made.uniforms == {}
    assert "vt_tables" not in made.text
    assert made.columns is not None
    assert made.columns.shape == (made.baked.height, made.baked.nodes[0], 4)
    assert lines is None or made.text.count("\n") <= lines
    shaders, engines = ((GUIDES / page).read_text(encoding="utf-8") for page in ("shaders.md", "engines.md"))
    assert printed in shaders
    rows = dict(re.findall(r"^\| (\S+) \| `velatura` \|.* (\d+) \| \d+ \|$", engines, re.MULTILINE))
    assert "coated-gold" in rows and int(rows.get(name, 16 * fetches)) == 16 * fetches


@pytest.mark.parametrize(
    ("name", "films"),
    [("coated-gold", True), ("frosted-glass", True), ("tinted-plate", False), ("varnished-paint", False)],
)
def test_values_that_change_are_solved_anew(name: str, films: bool) -> None:
    """What is read of other values is what a shader of these alone reads, though more is drawn of a kind of stack: of a
    pane it has all interfaces shape the light that passes, and any medium scatter it; films are those of the values."""
    stack = vt.preset(name)
    other = stack.replace(layer0_eta=1.4)
    if films:
        stack = stack.replace(layer0_film0_eta=1.3, layer0_film0_thickness_nm=90)
        other = other.replace(layer0_film0_eta=2.2, layer0_film0_thickness_nm=160)
    general, alone = shader(stack, values="uniforms"), shader(other)
    assert general.key == shader(other, values="uniforms").key
    assert isinstance(general.baked, SolvedLookUp)
    found = general.baked.solve(other)
    recordings = [record(stack, parameters=True), record(other)]
    colours = {f"vt_remainder[{k}]": colour[:, None] for k, colour in enumerate(found.remainder)}
    colours |= {f"vt_shown[{k}]": 1.0 for k in range(len(general.shown))}
    colours |= {f"vt_layout[{k}]": float(x) for k, x in enumerate(found.layout)}
    case = random_case((("dielectric" if stack.transmits else "conductor",), "round"), 40, np.random.default_rng(5))
    values = {f"{name}.{axis}": w[k] for name, w in case.directions.items() for k, axis in enumerate("xyz")}
    values |= {f"m.{place(at)}": np.reshape(constant(at, x), (-1, 1)) for at, x in other.values()}
    seen = []
    for recording, read in zip(recordings, (reader(general.baked, found), reader(alone.baked))):
        given = {
            **values,
            **colours,
            "vt_baked": read,
            "vt_films": tables_of_films(other, recording.films, recording.model),
        }
        lobes = dict(zip(recording.lobes, evaluate(list(recording.lobes.values()), given)))
        given |= {f"l.{name}{end}": value for name, value in lobes.items() for end in ("", ".r")}
        seen.append(evaluate([recording.value, *recording.energies], given))
    for a, b in zip(*seen):
        np.testing.assert_allclose(np.broadcast_to(a, (3, 40)), np.broadcast_to(b, (3, 40)), rtol=2e-3, atol=1e-4)


def test_a_measured_metal_has_the_colour_of_its_spectrum() -> None:
    """Expected: what the texture gives, and `solve` of other values, is the light of `vt.lobes`, within .2 %; the same
    metal in numbers is off by 2 %."""
    stack = vt.Stack([vt.Interface(eta=1.4, alpha=0.1), vt.Interface(conductor="Cu", alpha=0.3)])
    made, cosine = shader(stack), 0.7
    given = {"wi.x": np.full(1, (1 - cosine**2) ** 0.5), "wi.y": np.zeros(1), "wi.z": np.full(1, cosine)}
    assert isinstance(made.baked, SolvedLookUp)
    found = vt.lobes(stack, cosine)
    expected, recording = sum(found.energy) + found.remainder, record(stack)
    for contents in (None, made.baked.solve(stack)):
        read = reader(made.baked) if contents is None else reader(made.baked, contents)
        light = sum(np.broadcast_to(x, (3, 1)) for x in evaluate(recording.energies, {**given, "vt_baked": read}))
        np.testing.assert_allclose(light, expected, rtol=2e-3)
    colours = {f"layer1_{part}": rgb(Named("Cu", part)) for part in ("eta", "k")}
    plain = vt.lobes(stack.replace(**colours), cosine)
    assert np.abs((sum(plain.energy) + plain.remainder) / expected - 1).max() > 0.02


# Films

UNDER_A_COAT = """
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 1.3, thickness_nm: 90}]}
  - medium: {sigma_a: 0.1}
  - interface: {conductor: Al, alpha: 0.2, films: [{eta: 1.4, thickness_nm: 50}, {eta: 1.9, thickness_nm: 250}]}
"""
PANE = """
thin: true
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 1.3, thickness_nm: 90}]}
  - interface: {eta: 1, alpha: 0.2, films: [{eta: 2.1, thickness_nm: 250}]}
"""
TINTED = """
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 1.3, k: 0.5, thickness_nm: 90}]}
  - interface: {eta: 1, alpha: 0.2, films: [{eta: 2.1, thickness_nm: 250}]}
"""
OVER_DIFFUSE = """
layers:
  - interface: {eta: 1.5, alpha: 0.1, films: [{eta: 1.3, thickness_nm: 90}]}
  - interface: {eta: 1.7, alpha: 0.1, films: [{eta: 0.4, k: 2.6, thickness_nm: 10}]}
  - diffuse: {albedo: [0.2, 0.5, 0.9]}
"""


@pytest.mark.parametrize("textured", [False, True])
@pytest.mark.parametrize(
    ("text", "model"),
    [
        (UNDER_A_COAT, "weier2020"),
        (UNDER_A_COAT, "realtime"),
        (PANE, "belcour2018"),
        (PANE, "weier2020"),
        (TINTED, "weier2020"),
        (OVER_DIFFUSE, "belcour2018"),
        (OVER_DIFFUSE, "realtime"),
    ],
)
def test_films_may_change(text: str, model: str, textured: bool, tmp_path: Path) -> None:
    """A shader of one stack, given the films and the values of another, has the lobes of that, from either side."""
    (tmp_path / "rough.png").touch()
    other = loads(text)
    changed: dict[str, Any] = {"layer0_eta": 1.9, "layer0_film0_eta": 2.3, "layer0_film0_thickness_nm": 120}
    if textured:
        changed["layer0_alpha"] = {"texture": str(tmp_path / "rough.png")}
    general, alone = record(other.replace(**changed), model, parameters=True), record(other, model)
    cos_theta = np.array([0.2, 0.5, 0.9, 0.2, 0.5, 0.9])
    side = np.repeat([1.0, -1.0 if other.transmits else 1.0], 3)
    given = {"wi.x": np.sqrt(1 - cos_theta**2), "wi.y": 0 * cos_theta, "wi.z": side * cos_theta}
    given |= {f"m.{place(at)}": np.reshape(constant(at, x), (-1, 1)) for at, x in other.values()}
    given |= {f"vt_shown[{k}]": 1.0 for k in range(len(general.shown))}
    given["vt_films"] = tables_of_films(other, general.films | alone.films, general.model)

    def baked(group: Group, at: Any) -> Any:
        assert isinstance(general.baked, LobeLookUp)
        columns = evaluate(general.baked.columns, {**given, **dict(zip(("place.x", "place.y", "place.z"), at))})
        return columns[4 * group.begin : 4 * (group.begin + group.texels)]

    energies = [name for name in alone.lobes if name.endswith("energy")]
    seen = (evaluate([x.lobes[name] for name in energies], {**given, "vt_baked": baked}) for x in (general, alone))
    for name, a, b in zip(energies, *seen, strict=True):
        np.testing.assert_allclose(np.broadcast_to(a, (3, 6)), np.broadcast_to(b, (3, 6)), atol=1e-6, err_msg=name)
    bare = evaluate([record(without_films(other), model).lobes[name] for name in energies], given)
    assert max(np.abs(a - b).max() for a, b in zip(bare, evaluate([alone.lobes[x] for x in energies], given))) > 0.02


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"layer2_film0_eta": 1.5},
            "layer2_film0_eta: is a texture, and in a shader films have textures of a thickness",
        ),
        ({"layer0_eta": 1.5}, "layer0_eta: is a texture, and in a shader films have textures of a thickness"),
        (
            {"layer2_film0_thickness_nm": 9.0, "layer2_film1_thickness_nm": 9.0},
            "layer2_film1_thickness_nm: in a shader only one film of an interface may have a texture",
        ),
    ],
)
def test_other_textures_of_films_are_refused(values: dict[str, float], message: str, tmp_path: Path) -> None:
    (tmp_path / "t.png").touch()
    textured = {key: {"texture": str(tmp_path / "t.png"), "scale": scale} for key, scale in values.items()}
    with pytest.raises(vt.InvalidInput, match=message):
        shader(loads(UNDER_A_COAT).replace(**textured), "belcour2018")


def without_films(stack: vt.Stack) -> vt.Stack:
    layers = [
        layer.model_copy(update={"films": ()}) if isinstance(layer, vt.Interface) else layer for layer in stack.layers
    ]
    return vt.Stack(layers, thin=stack.thin)


def test_indices_beside_films_are_worked_in() -> None:
    """Films are of their neighbours' indices, which no code reads; roughness and media stay parameters."""
    made = shader(loads(UNDER_A_COAT), "belcour2018")
    assert set(made.uniforms) == {
        "layer0_alpha_u",
        "layer1_depth",
        "layer1_sigma_a",
        "layer1_sigma_s",
        "layer1_g",
        "layer2_alpha_u",
    }
    assert made.film_tables == ["film0_above", "film2_above"]
    assert shader(loads(UNDER_A_COAT), "realtime").films is None
    read = shader(loads(UNDER_A_COAT), "weier2020")
    assert read.film_tables == ["film0", "film2"]
    assert read.films is not None and read.films.shape == (2, 257, 4)


# Tapes


def test_a_tape_works_out_what_is_the_same_once() -> None:
    x, c = number("x"), colour("c")
    made = tape([x * c + 2.0, c * x, ops.select(x < 2.0, 1.0, component(c, 1))])
    assert (made.inputs, made.constants) == (["x", "c"], [2.0, 1.0])
    assert [step[0] for step in made.steps] == ["multiply", "add", "less", "component", "select"]
    assert made.outputs == [5, 4, 8]


# Loops


def test_what_is_read_has_loops_and_what_is_run_has_none() -> None:
    def powers(x: object) -> list:
        values = ops.each(lambda node, y: node * y + 1.0, [0.25, 0.5], x)
        return [*values, *ops.repeat(lambda a, b: [b, a + b], 3, 0.0 * x, x)]

    with ops.readable():
        texts = printed(sum(powers(number("x"))))
    assert "const float nodes[2] = float[2](0.25, 0.5);" in texts
    assert texts.count("for (int") == 2
    unrolled = printed(sum(powers(number("x"))))
    assert "for" not in unrolled
    (found,) = evaluate([sum(powers(number("x")))], {"x": X})
    np.testing.assert_allclose(found, 0.75 * X + 2 + 5 * X)


def test_costs_count_channels_rounds_of_loops_and_nodes_between_which_tables_are_read() -> None:
    x, c = number("x"), colour("c")
    assert cost([(x + 1.0) * c], 0) == Cost(1 + 3, 0)
    assert cost([ops.exp(c)], 0) == Cost(12, 0)
    with ops.readable():
        (last,) = ops.repeat(lambda a: [a * x + 1.0], 5, x)
    assert cost([last], 0).operations >= 5 * 2
    name, table = next((name, table) for name, table in tables.load().items() if len(table.shape) == 2)
    (first, *_) = ops.interpolate(table, x, x)
    assert cost([first], 0).texels == 4 * texels(name)


def test_look_ups_that_a_choice_throws_away_are_left_out() -> None:
    """Of a table, what one side of a choice needs; of a channel, what that channel needs; of two sides, the larger."""
    x, y, c, d = number("x"), number("y"), colour("c"), colour("d")
    known = tables.load()
    sides = ops.interpolate(known.dielectric, x, y)[0], ops.interpolate(known.tir_published, x, y, y)[0]
    chosen = ops.select(x < 0.5, sides[0], sides[1])
    text = printed(chosen)
    assert "if (value) { dielectric[texel] = vt_dielectric(texel, x, y); }" in text
    assert "if (!value) { value_2 = vt_tir_published(x, y, y); }" in text
    assert cost([chosen], 0).texels == max(4 * texels("dielectric"), 8)
    apart = ops.select(c < 0.5, ops.interpolate(known.absorbing_inside, x, y, d)[0], d)
    text = printed(apart)
    for k, channel in enumerate("rgb"):
        name = f"absorbing_inside_{k + 1}" if k else "absorbing_inside"
        assert f"if (value.{channel}) {{ {name}[texel] = vt_absorbing_inside(texel, x, y, d.{channel}); }}" in text
    assert cost([apart], 0).texels == 3 * 8 * texels("absorbing_inside")
    mixed = ops.select(c < 0.5, ops.mean(ops.interpolate(known.absorbing_inside, x, y, d)[0]) * d, d)
    assert printed(mixed).count("if (any(value))") == 3
    assert "if (" not in printed(ops.select(x < 0.5, sides[0], 1.0) + sides[0])
    first, second, *_ = ops.interpolate(known.dielectric, x, y)
    assert "if (" not in printed(ops.select(second < 0.5, first, 1.0))


@pytest.mark.parametrize(
    ("model", "lobes"), [("velatura", [[0], [1], [3], [4]]), ("realtime", [[0], [1, 3], [4]])], ids=str
)
def test_every_lobe_belongs_to_its_interfaces(model: str, lobes: list[list[int]]) -> None:
    coat = {"interface": {"eta": 1.5, "alpha": 0.1}}
    film = {"interface": {"eta": 1.3, "alpha": 0.1}}
    made = shader(vt.Stack([coat, film, {"medium": {}}, coat, film]), model, values="uniforms")
    assert made.lobes == lobes
    solved = isinstance(made.baked, SolvedLookUp)
    firsts = [0, 1, 2, 4] if solved else range(len(lobes))  # below the medium, a veil comes after each lobe
    rest = ["remainder"] if solved else []
    assert list(made.shown) == [*(f"reflected[{k}]" for k in firsts), *rest, "transmitted"]


def test_the_texture_holds_the_tables() -> None:
    """Every node of every table, at the place that the readers ask for."""
    recording: Recording = record(vt.preset("coated-gold"), "belcour2018")
    names = {symbol.detail for symbol in recording.symbols if symbol.op in ("texels", "value")}
    flat = shader(vt.preset("coated-gold"), "belcour2018").tables.reshape(-1)
    start = 0
    for name, table in tables.load().items():
        if name in names:
            channels = table.data.shape[-1]
            width = channels if channels == 1 else -(-channels // 4) * 4
            nodes = flat[start : start + width * table.data.size // channels].reshape(*table.shape, width)
            np.testing.assert_array_equal(nodes[..., :channels], table.data)
            start += -(-nodes.size // 4) * 4
    assert not flat[start:].any()


@pytest.mark.parametrize("form", ["byte code", "other comments"])
def test_shaders_need_no_source_text(form: str, tmp_path: Path) -> None:
    """The package as byte code alone, in a folder or a zip, and with other comments, prints what its source prints."""
    own = Path(vt.__file__).parent
    shutil.copytree(own, tmp_path / "velatura", ignore=shutil.ignore_patterns("page", "static", "__pycache__"))
    if form != "other comments":
        compileall.compile_dir(tmp_path / "velatura", quiet=2, legacy=True)
    for path in tmp_path.rglob("*.py"):
        if form == "other comments":
            path.write_text(re.sub(r"(?m)^( *)# .*$", r"\1# Another comment\n\1# of two lines", path.read_text()))
        else:
            path.unlink()
    folders = [tmp_path]
    if form == "byte code":
        folders.append(Path(shutil.make_archive(str(tmp_path / "velatura"), "zip", tmp_path)))
    for folder in folders:
        program = (
            f"import sys; sys.path.insert(0, {str(folder)!r}); import velatura as vt;"
            f"assert vt.__file__.startswith({str(folder / 'velatura')!r}), vt.__file__;"
            "print(vt.shader.shader(vt.preset('coated-gold'), 'belcour2018').key)"
        )
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
        assert done.stdout.strip() == shader(vt.preset("coated-gold"), "belcour2018").key, done.stderr


def test_a_recording_leaves_profilers_alone() -> None:
    seen: list[str] = []

    def profiler(frame: object, event: str, argument: object) -> None:
        seen.append(event)

    sys.setprofile(profiler)
    try:
        shader(vt.preset("bare-gold"), "weier2020")
        assert sys.getprofile() is profiler
        before = len(seen)
        vt.preset("bare-gold")
        assert len(seen) > before
    finally:
        sys.setprofile(None)
