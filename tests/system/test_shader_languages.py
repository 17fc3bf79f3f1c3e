"""Printed shaders in every language but GLSL ES, run on the CPU, against NumPy.

A compiler of the language takes each text, and its values are compared. GLSL ES runs in Chromium
(tests/browser/test_shader.py); `benchmarks/shader.py` runs 10^4 stacks of all patterns.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agreement import (
    PATTERNS,
    Case,
    Changeable,
    Results,
    compare,
    differences,
    in_numpy,
    mixed_case,
    of_material,
    on_machine,
    program,
    random_case,
    recording_of,
    textures,
    together,
)
from machines import MACHINES, SLOTS, Machine
from spirv import counts

import velatura as vt
from velatura.model.solved.bsdf import MAX_SAMPLE_WEIGHT
from velatura.shader import constant, record, shader
from velatura.shader.printers.glsl import Vulkan
from velatura.shader.program import prefixed

coarse = pytest.mark.usefixtures("coarse_solutions")

# Patterns that together have every kind of layer and every shape; merged lobes, films, brushed `velatura`, and the form
# that looks at pairs of directions
CASES: dict[str, list[tuple[int, str, bool, dict[str, str]]]] = {
    "glsl450": [(0, "weier2020", False, {}), (4, "realtime", False, {}), (16, "belcour2018", False, {})],
    "vulkan": [(9, "belcour2018", False, {}), (18, "velatura", True, {}), (20, "yamaguchi2019", False, {})],
    "hlsl": [(10, "belcour2018", True, {}), (29, "weier2020", False, {}), (11, "velatura", False, {})],
    "slang": [(10, "belcour2018", False, {}), (18, "yamaguchi2019", False, {"form": "symmetric"})],
    "wgsl": [(10, "belcour2018", False, {}), (20, "realtime", True, {}), (18, "velatura", False, {})],
}
EVERY = [(name, *case) for name, cases in CASES.items() for case in cases]


@coarse
@pytest.mark.parametrize(("name", "pattern", "model", "films", "switches"), EVERY)
def test_every_language_is_the_model(
    name: str, pattern: int, model: str, films: bool, switches: dict[str, Any]
) -> None:
    """Expected: energies and roughnesses within 1e-4, values and densities within 1e-3 where roughnesses reach .05."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    found = compare(PATTERNS[pattern], model, 60, 7, MACHINES[name], films=films, **switches)
    assert found.energy < 1e-4
    assert found.alpha < 1e-4
    assert found.value < 1e-3
    assert found.density < 1e-3
    assert found.drawn < 1e-4


FOG = vt.Medium(sigma_s=(0.9, 0.7, 0.5), sigma_a=0.1, g=0.8)
AIR, METAL = vt.Interface(eta=1.0), vt.Interface(eta=0.2, k=3.0, alpha=0.2)
TWO_LOBES = {"forward": 0.8, "backward": -0.3, "share": 0.8}
PEAKED = {"table": [(0, 3), (60, 0.3), (90, 0.1), (180, 0.2)]}
#: Media with no step of the index above them, alone and on others, on a base without any interface, and forms.
ON_TOP: dict[str, list[tuple[list[Any], str]]] = {
    "glsl450": [([FOG, AIR], "forward"), ([AIR, FOG, vt.Diffuse(albedo=0.4)], "symmetric")],
    "vulkan": [
        ([FOG, METAL], "forward"),
        ([FOG, vt.Diffuse(albedo=0.4)], "forward"),
        ([vt.Medium(sigma_s=0.9, phase=PEAKED), METAL], "forward"),
    ],
    "hlsl": [([FOG, vt.Interface(eta=1.5, alpha=0.1), AIR], "forward")],
    "slang": [([vt.Medium(sigma_s=0.9, phase="rayleigh"), METAL], "symmetric")],
    "wgsl": [([FOG, AIR], "symmetric"), ([vt.Medium(sigma_s=0.9, phase=TWO_LOBES), AIR], "forward")],
}


@coarse
@pytest.mark.parametrize(("name", "layers", "form"), [(name, *case) for name, each in ON_TOP.items() for case in each])
def test_a_medium_on_top_is_the_model_in_every_language(name: str, layers: list[Any], form: str) -> None:
    """Expected: energies within 1e-4, and values and densities within 1e-3, from both sides."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    stack = vt.Stack(layers)
    case = Case(stack, {}, random_case((stack.kinds, "round"), 60, np.random.default_rng(7)).directions)
    made = shader(stack, printer=MACHINES[name].printer, form=form)
    recording = recording_of(made)
    assert not recording.model.closed_form
    truth, found = in_numpy(case, recording), on_machine(case, recording, made, MACHINES[name])
    # Roughnesses of interfaces without a step of the index do not count
    truth, found = (replace(each, alpha=0 * each.alpha + 1) for each in (truth, found))
    apart = differences(truth, found)
    assert max(apart.energy, apart.drawn) < 1e-4
    assert max(apart.value, apart.density) < 1e-3


#: Panes that pass and reflect light too wide for lobes; the last one is coloured.
WIDE: dict[str, tuple[list[vt.Interface | vt.Medium], str]] = {
    "glsl450": ([vt.Interface(eta=1.5, alpha=0.4), vt.Interface(eta=1.0, alpha=0.3)], "forward"),
    "vulkan": ([vt.Interface(eta=1.4, alpha=0.9), vt.Interface(eta=1.0, alpha=0.6)], "symmetric"),
    "hlsl": ([vt.Interface(eta=1.5, alpha=0.2), vt.Interface(eta=1.0, alpha=0.1)], "forward"),
    "slang": ([vt.Interface(eta=1.5, alpha=[0.4, 0.44]), vt.Interface(eta=1.0, alpha=0.3)], "forward"),
    "wgsl": (
        [vt.Interface(eta=1.5, alpha=0.5), vt.Medium(sigma_a=(0.1, 0.5, 1)), vt.Interface(eta=1, alpha=0.3)],
        "forward",
    ),
}


@coarse
@pytest.mark.parametrize("name", WIDE)
def test_wide_light_is_the_model_in_every_language(name: str) -> None:
    """Expected: energies within 1e-4, and values and densities within 1e-3, from both sides, where the plugin draws
    waves of the azimuth."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    layers, form = WIDE[name]
    stack = vt.Stack(layers, thin=True)
    case = Case(stack, {}, random_case((stack.kinds, "round"), 60, np.random.default_rng(7)).directions)
    made = shader(stack, printer=MACHINES[name].printer, form=form)
    recording = recording_of(made)
    assert "wide_passed[0]" in recording.lobes
    apart = differences(in_numpy(case, recording), on_machine(case, recording, made, MACHINES[name]))
    assert max(apart.energy, apart.alpha, apart.drawn) < 1e-4
    assert max(apart.value, apart.density) < 1e-3


@coarse
def test_a_program_of_dust_on_glass_draws_fog() -> None:
    """Expected: given the values and the solution of a medium alone, which passes light of another shape."""
    if why := MACHINES["wgsl"].missing():
        pytest.skip(why)
    program = Changeable.of(vt.Stack([FOG, vt.Interface(eta=1.5, alpha=0.1)]), MACHINES["wgsl"])
    for layers in ([FOG, AIR], [vt.Medium(sigma_s=0.9, phase="rayleigh"), vt.Interface(eta=1.3, alpha=0.2)]):
        stack = vt.Stack(layers)
        case = Case(stack, {}, random_case((stack.kinds, "round"), 60, np.random.default_rng(7)).directions)
        truth, found = in_numpy(case, program.recording), program.given(case)
        alike = (replace(each, alpha=0 * truth.alpha + 1) for each in (truth, found))
        assert differences(*alike).value < 1e-3


@pytest.mark.parametrize("name", MACHINES)
def test_a_wrong_constant_is_seen(name: str) -> None:
    """The comparison can fail: a shader of a slightly other material differs by more than the bounds."""
    if why := MACHINES[name].missing():
        pytest.skip(why)
    case = random_case(PATTERNS[9], 60, np.random.default_rng(7))
    wrong = shader(case.stack.replace(exterior=1.01), "weier2020", ["exterior"], printer=MACHINES[name].printer)
    recording = record(case.stack, "weier2020")
    found = on_machine(case, recording, wrong, MACHINES[name])
    assert differences(in_numpy(case, recording), found).energy > 1e-4


@coarse
@pytest.mark.parametrize("name", MACHINES)
def test_one_program_holds_two_materials(name: str) -> None:
    """Expected: each has its own functions, structs and textures, and answers as it does alone."""
    machine = MACHINES[name]
    if why := machine.missing():
        pytest.skip(why)
    wi = random_case(PATTERNS[9], 40, np.random.default_rng(7)).directions
    texts, programs, truths, read, bindings = [], [], [], dict[str, np.ndarray](), dict[str, int]()
    of = {0: ("gold", "coated-gold", "velatura"), 4: ("Old_paint", "varnished-paint", "belcour2018")}
    for place, (prefix, preset, model) in of.items():
        case = Case(vt.preset(preset), {}, wi)
        fixed = [] if model == "velatura" else list(case.stack.flat())
        printer = replace(machine.printer, binding=place)
        made = shader(case.stack, model, fixed, printer=printer, prefix=prefix)
        recording = recording_of(made)
        called = program(case, recording, made, printer)
        lines = [line if "vt_read" in line else prefixed(line, prefix) for line in called.lines]
        named = [prefixed(answer, prefix) for answer in called.answers]
        texts.append(made.text)
        programs.append(replace(called, lines=lines, answers=named))
        truths.append(in_numpy(case, recording))
        read |= {prefixed(key, prefix): data for key, data in textures(made).items()}
        bindings |= {prefixed(key, prefix): place + slot for key, slot in SLOTS.items()}
    found = together(programs, "\n".join(texts), machine, read, bindings=bindings)
    for called, answers, truth in zip(programs, found, truths):
        apart = differences(truth, called.results(answers))
        assert max(apart.energy, apart.alpha, apart.drawn) < 1e-4
        assert max(apart.value, apart.density) < 1e-3


MIXED = {
    "glsl450": ((9, 15, 9), "belcour2018", False),
    "vulkan": ((9, 0, 18), "velatura", False),
    "hlsl": ((9, 18, 9), "weier2020", True),
    "slang": ((12, 18, 10), "yamaguchi2019", False),
    "wgsl": ((0, 18, 9), "velatura", False),
}


@coarse
@pytest.mark.parametrize("name", MIXED)
def test_mixtures_in_every_language_are_the_model(name: str) -> None:
    """Expected: values, densities and samples of random mixtures, one within another, within the bounds of stacks."""
    machine, (patterns, model, films) = MACHINES[name], MIXED[name]
    if why := machine.missing():
        pytest.skip(why)
    case = mixed_case([PATTERNS[k] for k in patterns], 60, np.random.default_rng(7), films)
    made = shader(case.whole.stack, model, printer=machine.printer)
    truth, found = case.in_numpy(model), on_machine(case.whole, None, made, machine)
    apart = differences(truth, replace(found, energy=truth.energy, alpha=truth.alpha))
    assert max(apart.value, apart.density) < 1e-3
    assert apart.drawn < 1e-4


BAKED = {
    "glsl450": ("coated-gold", "belcour2018"),
    "vulkan": ("varnished-paint", "weier2020"),
    "hlsl": ("frosted-glass", "yamaguchi2019"),
    "slang": ("varnished-paint", "realtime"),
    "wgsl": ("coated-gold", "weier2020"),
}


@pytest.mark.parametrize("name", BAKED)
def test_lobes_of_any_model_may_be_baked(name: str) -> None:
    """Expected: for 99 of 100 directions energies within 1e-3 and alphas within 2e-3 of what is worked out; the text
    holds no layers, and samples are those of the lobes read."""
    machine, (preset, model) = MACHINES[name], BAKED[name]
    if why := machine.missing():
        pytest.skip(why)
    stack = vt.preset(preset)
    below = "dielectric" if stack.transmits else "conductor"
    case = Case(stack, {}, random_case(((below,), "round"), 300, np.random.default_rng(3)).directions)
    made = shader(stack, model, printer=machine.printer, baking=True)
    recording = recording_of(made)
    assert made.columns is not None and made.uniforms == {}
    assert "vt_tables" not in made.text and "sigma" not in made.text
    found, truth = on_machine(case, recording, made, machine), in_numpy(case, recording)
    assert np.quantile(np.abs(found.energy - truth.energy).max(axis=(0, 1)), 0.99) < 1e-3
    lit = truth.energy.max(axis=1) > 1e-3
    assert np.quantile(np.where(lit, np.abs(found.alpha - truth.alpha).max(axis=1), 0).max(axis=0), 0.99) < 2e-3
    assert np.quantile(np.abs(found.drawn - truth.drawn), 0.9) < 5e-3


@pytest.mark.parametrize("to", ["glsl", "wgsl", "osl", "mtlx"])
def test_a_black_material_has_a_shader(to: str) -> None:
    """Expected: no column of it varies, so that its texture is a line of zeros."""
    black = vt.Stack([vt.Interface(eta=1.0, alpha=0.2), vt.Diffuse(albedo=0.0)])
    columns = shader(black).columns
    assert columns is not None and columns.shape == (1, 1, 4) and not columns.any()
    assert vt.export(black, to)


@coarse
def test_a_program_of_matt_paint_holds_values_that_change() -> None:
    """Expected: a weight for the remainder and one for what passes, which no interface stands before."""
    made = shader(vt.Stack([FOG, vt.Diffuse(albedo=0.4)]), values="uniforms")
    assert made.baked is not None and list(made.shown) == ["remainder"]


@coarse
@pytest.mark.parametrize(("to", "beneath"), [("osl", vt.Interface(eta=1.5, alpha=0.1)), ("mtlx", AIR)], ids=str)
def test_a_medium_on_an_interface_has_closures(to: str, beneath: vt.Interface) -> None:
    """Its lower side ends with a medium. Expected: the stated difference in albedo, of light that goes straight through
    an interface without a step, too, is that of closures."""
    exported = vt.export(vt.Stack([FOG, beneath]), to)
    stated = [float(x) for x in re.findall(r"of the light, albedo ([\d.]+)", exported.text)]
    assert stated and max(stated) < 0.005


def test_what_varies_is_not_baked(tmp_path: Path) -> None:
    (tmp_path / "rough.png").touch()
    stack = vt.Stack([vt.Interface(eta=1.5, k=1, alpha={"texture": str(tmp_path / "rough.png")})])
    with pytest.raises(vt.InvalidInput, match="baked: only for materials without textures"):
        vt.export(stack, "wgsl", "belcour2018", baked=True)


@coarse
@pytest.mark.parametrize("name", MACHINES)
def test_values_that_change_stand_in_a_block(name: str) -> None:
    """Expected: compilers take a program whose material, weights, remainder and layout change."""
    machine = MACHINES[name]
    if why := machine.missing():
        pytest.skip(why)
    for preset, model in (("frosted-glass", "velatura"), ("varnished-paint", "weier2020")):
        made = shader(vt.preset(preset), model, values="uniforms", printer=machine.printer)
        called = machine.printer.declared("colour", "wi", machine.printer.colour(["0.0", "0.0", "1.0"]))
        at = f"vt_material({machine.printer.type('vec2')}(0.5, 0.5))"
        lines = [
            called,
            machine.printer.variable("VtMaterial", "m", at),
            "results[row] = vt_eval_pdf(m, vt_lobes(m, wi), wi, wi);",
        ]
        machine.compile("\n".join([made.text, machine.declarations(1), machine.main(lines)]))


@coarse
@pytest.mark.parametrize(
    ("name", "pattern"), [*((name, 23) for name in MACHINES), ("vulkan", 26), ("glsl450", 30), ("wgsl", 57)]
)
def test_values_that_change_are_those_of_the_program(name: str, pattern: int) -> None:
    """Expected: a program of one random stack that is given the values and the solution of another has that one's
    values, as NumPy has them. Densities differ on purpose: what is hidden may be shown, and is sampled faintly.

    Of two panes one bounces light between two steps of the index, the other has a single step. A medium lies on a
    metal, or on a dielectric.
    """
    machine = MACHINES[name]
    if why := machine.missing():
        pytest.skip(why)
    first, case = (random_case(PATTERNS[pattern], 60, np.random.default_rng((0, pattern, k))) for k in (0, 1))
    program = Changeable.of(first.stack, machine)
    truth, found = in_numpy(case, program.recording), program.given(case)
    assert differences(truth, replace(found, alpha=truth.alpha)).value < 1e-3


@coarse
def test_a_program_of_clear_panes_draws_frosted_ones() -> None:
    """Expected: given the values and the solution of a pane that passes light too wide for lobes, and of one that does
    not. Values count where no sample is as heavy as may be, since densities differ."""
    if why := MACHINES["wgsl"].missing():
        pytest.skip(why)
    clear, frosted = (
        vt.Stack([vt.Interface(eta=1.5, alpha=x), vt.Interface(eta=1.0, alpha=x)], thin=True) for x in (0.06, 0.3)
    )
    program = Changeable.of(clear, MACHINES["wgsl"])
    for stack in (frosted, clear):
        case = Case(stack, {}, random_case((stack.kinds, "round"), 60, np.random.default_rng(7)).directions)
        truth, found = in_numpy(case, program.recording), program.given(case)
        most = MAX_SAMPLE_WEIGHT * np.minimum(truth.density, found.density)
        light = (np.where(each.value < 0.98 * most, each.value, 0.0) for each in (truth, found))
        assert differences(*(replace(truth, value=x) for x in light)).value < 1e-3


@pytest.mark.parametrize("name", MACHINES)
def test_textures_are_read_where_the_material_is(name: str, tmp_path: Path) -> None:
    """Expected: lobes, values and samples are those of the numbers that textures hold, and of the way of brushing."""
    machine = MACHINES[name]
    if why := machine.missing():
        pytest.skip(why)
    for each in ("rough.png", "wood.png"):
        (tmp_path / each).touch()
    rough = {"texture": str(tmp_path / "rough.png"), "scale": 0.5, "offset": 0.1, "channel": "g"}
    brushing = {"brushing": "concentric", "u": 0.25, "v": 0.5, "offset": 10}
    coat = vt.Interface(eta=1.5, alpha=[rough, 0.2], rotation=brushing)
    stack = vt.Stack([coat, vt.Diffuse(albedo={"texture": str(tmp_path / "wood.png"), "scale": 0.9})])
    rng = np.random.default_rng(4)
    maps = {key: rng.integers(16, 240, (2, 2, 4)) / 256 for key in ("vt_map_layer0_alpha_u", "vt_map_layer1_albedo")}
    x, y = rng.integers(0, 2, (2, 40))
    uv = np.array([0.25 + 0.5 * x, 0.25 + 0.5 * y])  # centres of texels

    # What NumPy is given is read by hand
    plain = vt.Stack([vt.Interface(eta=1.5, alpha=[0.1, 0.2], rotation=1), vt.Diffuse(albedo=0.5)])
    values = {at.name: np.multiply.outer(np.ravel(constant(at, value)), np.ones(40)) for at, value in plain.values()}
    values["layer0_alpha_u"] = maps["vt_map_layer0_alpha_u"][y, x, 1] * 0.5 + 0.1
    values["layer0_rotation"] = np.degrees(np.arctan2(uv[1] - 0.5, uv[0] - 0.25)) + 100
    values["layer1_albedo"] = maps["vt_map_layer1_albedo"][y, x, :3].T * 0.9
    values = {
        key: x[0] if key not in ("layer0_eta", "layer1_albedo") and x.ndim == 2 else x for key, x in values.items()
    }
    directions = random_case(PATTERNS[15], 40, rng).directions
    truth = in_numpy(Case(plain, values, directions), record(plain, "weier2020"))

    apart = differences(truth, on_texels(stack, machine, maps, uv, directions))
    assert max(apart.energy, apart.alpha, apart.drawn) < 1e-4
    assert max(apart.value, apart.density) < 1e-3


@pytest.mark.parametrize("name", MACHINES)
def test_thicknesses_of_films_are_read_where_the_material_is(name: str, tmp_path: Path) -> None:
    """Expected: lobes are those of the uniform material of each thickness, within what tables are interpolated by."""
    machine = MACHINES[name]
    if why := machine.missing():
        pytest.skip(why)
    (tmp_path / "oxide.png").touch()
    thickness = {"texture": str(tmp_path / "oxide.png"), "scale": 400.0, "offset": 50.0}
    films = [{"eta": 2.1, "thickness_nm": thickness}, {"eta": 1.4, "thickness_nm": 80}]
    gilt = [{"eta": 0.4, "k": 2.6, "thickness_nm": {**thickness, "scale": 20.0, "offset": 5.0}}]
    stack = vt.Stack([vt.Interface(eta=1.5, alpha=0.2, films=gilt), vt.Interface(eta=1, alpha=0.1, films=films)])
    rng = np.random.default_rng(5)
    texels = rng.integers(16, 240, (2, 2, 4)) / 256
    x, y = np.repeat([[0, 1, 0, 1], [0, 0, 1, 1]], 8, axis=1)
    directions = random_case(PATTERNS[18], 32, rng).directions
    found = on_texels(
        stack,
        machine,
        {f"vt_map_layer{k}_film0_thickness_nm": texels for k in (0, 1)},
        np.array([0.25 + 0.5 * x, 0.25 + 0.5 * y]),
        directions,
    )
    for k, texel in enumerate(texels[..., 0].ravel().tolist()):
        uniform = stack.replace(layer0_film0_thickness_nm=5 + 20 * texel, layer1_film0_thickness_nm=50 + 400 * texel)
        some = slice(8 * k, 8 * k + 8)
        case = Case(uniform, {}, {key: w[:, some] for key, w in directions.items()})
        truth = in_numpy(case, record(uniform, "weier2020"))
        assert found.energy[..., some] == pytest.approx(truth.energy, abs=1e-3)


def on_texels(stack: vt.Stack, machine: Machine, maps: dict[str, Any], uv: np.ndarray, directions: Any) -> Results:
    """The results of a shader of a material with textures, at texture coordinates (2, N)."""
    made = shader(stack, "weier2020", printer=machine.printer)
    assert not any(str(image.texture) in made.text for image in made.maps.values())
    case = Case(stack, {}, {**directions, "at": np.array([*uv, uv[0]])})
    called = program(case, recording_of(made), replace(made, uniforms={}), machine.printer)
    (found,) = together([of_material(called, machine, "at.xy")], made.text, machine, {**textures(made), **maps})
    return called.results(found)


@coarse
@pytest.mark.parametrize(
    ("preset", "model", "exclusive"),
    [
        ("coated-gold", "velatura", 0),
        ("coated-gold", "belcour2018", 8),  # whichever side light that is reflected within comes from
        ("varnished-paint", "weier2020", 0),
        ("varnished-paint", "realtime", 0),
        ("frosted-glass", "yamaguchi2019", 0),
    ],
)
def test_the_texels_of_the_head_are_those_of_compiled_code(preset: str, model: str, exclusive: int) -> None:
    """Expected: what SPIR-V fetches in all rounds of loops, less what the smaller sides of choices read."""
    if why := MACHINES["vulkan"].missing():
        pytest.skip(why)
    made = shader(vt.preset(preset), model, printer=Vulkan())
    found = counts(made.text)
    assert {name: fetched for name, (_, fetched) in found.items()} == {
        name: cost.texels + (exclusive if name == "vt_lobes" else 0) for name, cost in made.costs.items()
    }
