"""The light of a material as a sum of closures, and its text in Open Shading Language."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from agreement import PATTERNS, coated, mixed_case, random_case
from evaluation import evaluate

import velatura as vt
from velatura.films.of_material import films_of
from velatura.model import MODELS, named
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf
from velatura.shader import closures, variance
from velatura.shader.closures import Closure
from velatura.shader.lookups import films
from velatura.shader.mixture import shares
from velatura.shader.printers.osl import _Part, osl
from velatura.shader.recorder import recording
from velatura.shader.recorder.symbol import in_order
from velatura.stack import Material

CLOSED = [model.name for model in MODELS if model.closed_form]
PASSING = ("refraction", "straight", "translucent")


def _numbers(found: list[Closure]) -> list:
    return [x for closure in found for x in (closure.weight, *closure.roughness, closure.eta)]


BARE = [(pattern, CLOSED[k % len(CLOSED)], False) for k, pattern in enumerate(PATTERNS[1::4])]
COATED = [(PATTERNS[k], "weier2020", True) for k in (0, 18)]


@pytest.mark.parametrize(("pattern", "model", "filmed"), BARE + COATED, ids=str)
def test_recorded_closures_are_those_of_numpy(pattern, model: str, filmed: bool) -> None:
    """Random stacks: what the text computes, run in double precision."""
    case = random_case(pattern, 12, np.random.default_rng(3))
    case = coated(case) if filmed else case
    stack, chosen, wi = case.stack, named(model), recording.direction("wi")
    recorded = films.recorded(recording.symbols(stack, films.beside(stack)), stack, general=False)
    body = bsdf.body(recorded, chosen, variance(stack), at_a_point())
    found = closures.of_body(body, wi, straight=stack.thin)
    alone = Material.of(stack)
    material = Material.from_flat(stack, {**alone.flat(), **case.values}).coated(films_of(alone))
    known = bsdf.body(material, chosen, variance(stack), at_a_point())
    truth = closures.of_body(known, tuple(case.directions["wi"]), straight=stack.thin)

    places = {f"m.{recording.material.place(at)}": case.values.get(at.name) for at, _ in stack.values()}
    values = places | {f"wi.{axis}": x for axis, x in zip("xyz", case.directions["wi"])}
    values["vt_films"] = films.tables(stack, films.read_by(in_order(_numbers(found))), chosen)
    assert [closure.kind for closure in found] == [closure.kind for closure in truth]
    for a, b in zip(evaluate(_numbers(found), values), _numbers(truth)):
        np.testing.assert_allclose(np.broadcast_to(a, (3, 12)), np.broadcast_to(b, (3, 12)), rtol=1e-6, atol=1e-12)


@pytest.mark.usefixtures("coarse_solutions")
@pytest.mark.parametrize("preset", ["turned-brushing", "frosted-glass"])
def test_tabulated_closures_have_the_light_of_the_lobes(preset: str) -> None:
    """Between nodes: all energy that `velatura.lobes` reports, and its roughness, above the grazing directions."""
    material = Material.of(vt.preset(preset)).solid()
    cosine, phi = np.array([0.93, 0.71, 0.44, 0.27]), 0.6
    sine = np.sqrt(1 - cosine**2)
    wi = sine * np.cos(phi), sine * np.sin(phi), cosine
    found, lobes = closures.tabulated(material, named("velatura")).above(wi), vt.lobes(preset, cosine, phi)
    reflected = [c for c in found if c.kind == "reflection"]
    for closure, energy, alpha in zip(reflected, lobes.energy, lobes.alpha):
        np.testing.assert_allclose(closure.weight * closures.albedo(closure, wi), energy, rtol=0.02, atol=1e-4)
        np.testing.assert_allclose(np.sort(closure.roughness[:2], axis=0), np.sort(alpha, axis=0), rtol=0.02)
    (diffuse,) = (c for c in found if c.kind == "diffuse")
    np.testing.assert_allclose(diffuse.weight, lobes.remainder, rtol=0.02, atol=1e-4)
    passed = sum(
        c.weight * (closures.albedo(c, wi) if c.kind != "translucent" else 1.0) for c in found if c.kind in PASSING
    )
    np.testing.assert_allclose(passed, lobes.passed, rtol=0.02, atol=1e-4)


@pytest.mark.parametrize("kind", ["reflection", "refraction", "straight", "diffuse", "translucent"])
@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
def test_closures_are_sampled_by_their_density(kind: closures.Kind, eta: float) -> None:
    """The density integrates to the share of samples that land on the right side, the value to the albedo."""
    if kind == "straight":
        eta = closures.STRAIGHT
    v = 0.3 if kind in PASSING else 0.5
    own = closures.Roughness(np.array([0.3]), np.array([v]), np.array([0.4]))
    closure, wi = Closure(kind, np.ones(3), own, eta), (np.array([0.6]), np.array([0.0]), np.array([0.8]))
    n = 1200
    x, y = np.meshgrid(*[(np.arange(n) + 0.5) / n * 2 - 1] * 2)
    inside = x * x + y * y < 1
    z = np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)
    side = -1 if kind in PASSING else 1
    value, density = closures.eval_pdf(closure, wi, (x[inside], y[inside], side * z))
    area = (2 / n) ** 2 / z
    u1, u2 = closures.square(2**14)
    drawn = closures.sample(closure, wi, u1, u2)
    there = closures.eval_pdf(closure, wi, drawn)[1] > 0
    assert np.sum(density * area) == pytest.approx(np.mean(there), abs=4e-3)
    if kind not in ("diffuse", "translucent"):
        assert np.sum(value * area) == pytest.approx(float(closures.albedo(closure, wi)[0]), abs=6e-3)


def test_losses_are_small_where_the_model_is_a_sum_of_lobes_and_grow_with_what_is_wrong() -> None:
    """Only masking differs for opaque stacks in closed form, and its loss of energy is corrected; lobes that are a
    tenth too rough are 5 % of the light off."""
    material, model = Material.of(vt.preset("coated-rough-metal")), named("weier2020")
    body = bsdf.body(material, model)
    known = partial(closures.of_body, body, straight=False)

    def rougher(w):
        return [c._replace(roughness=c.roughness.scaled(1.1)) for c in known(w)]

    for right, wrong in zip(*(closures.losses([(1.0, material)], model, each) for each in (known, rougher))):
        assert right.variation < 0.03 and right.albedo < 0.006
        assert wrong.variation > 0.04


def test_parameters_have_defaults_labels_and_ranges() -> None:
    text = osl("coated-gold", "weier2020").text
    assert "shader coated_brushed_gold(" in text
    layer = r'string label = "Layer 0: alpha_u", string help = ".*", string page = "Layer 0 \(dielectric\)"'
    assert re.search(rf"float layer0_alpha_u = 0\.05\n +\[\[ {layer}, float min = 0, float max = 1 \]\]", text)
    assert "color layer1_sigma_a = color(0.1, 0.5, 2.0)" in text
    assert "vector Tangent = dPdu" in text and "output closure color BSDF = 0" in text
    assert len(re.findall(r"BSDF \+= .*generalized_schlick_bsdf", text)) == 2
    fixed = osl("coated-gold", "weier2020", constant=["layer0_eta", "exterior"]).text
    assert "layer0_eta" not in fixed and "layer0_alpha_u" in fixed


def test_the_header_states_model_and_loss() -> None:
    made = osl(vt.Stack([vt.Interface(eta=1.5, alpha=0.2), vt.Diffuse(albedo=0.4)], name="2nd paint"), "belcour2018")
    assert made.name == "vt_2nd_paint" and not made.turns
    assert made.text.startswith("// 2nd paint, by the model belcour2018; Open Shading Language")
    assert re.search(r"//    cosine 0\.7: 0\.\d{3} of the light, albedo 0\.\d{4}\n", made.text)
    assert "BSDF += " in made.text and "* diffuse(shading)" in made.text


def test_solved_materials_are_tabulated() -> None:
    """All numbers that are read are in one array, with a place for each of a node, a side, and a column."""
    made = osl("coated-lens")
    size = int(re.search(r"float vt_columns\[(\d+)\]", made.text)[1])
    columns = int(re.search(r"float columns\[(\d+)\]", made.text)[1])
    assert size == 2 * closures.LINE[0] * columns
    array = made.text.split("float vt_columns")[1].split("{", 1)[1].split("}")[0]
    assert len(array.split(",")) == size
    assert "float layer0" not in made.text


def test_textures_are_read_by_parameters(tmp_path: Path) -> None:
    (tmp_path / "wood.png").touch()
    wood = {"texture": str(tmp_path / "wood.png"), "scale": 0.5, "offset": 0.1, "channel": "g", "encoding": "srgb"}
    brushed = {"brushing": "concentric", "u": 0.25}
    stack = vt.Stack([vt.Interface(conductor="Au", alpha=[wood, 0.2], rotation=brushed)])
    made = osl(stack)
    assert f'string layer0_alpha_u_map = "{tmp_path}/wood.png"' in made.text and made.turns
    expected = "clamp(vt_linear(vt_channel(layer0_alpha_u_map, 1, UV)) * 0.5 + 0.1, 0.0, 1.0)"
    assert f"float layer0_alpha_u = {expected};" in made.text
    assert "float layer0_rotation = degrees(atan2(UV[1] - 0.5, UV[0] - 0.25)) + 90.0;" in made.text
    assert "float layer0_alpha_v = 0.2" in made.text


def test_curves_of_textures_are_arrays(tmp_path: Path) -> None:
    (tmp_path / "wood.png").touch()
    curved = {"texture": str(tmp_path / "wood.png"), "curve": [0, 0.5, 0.6]}
    made = osl(vt.Stack([vt.Interface(conductor="Au", alpha=curved)])).text
    assert re.search(r"float vt_layer0_alpha_u_curve\[3\] = \{\s*0, 0\.5, 0\.6\s*\};", made)
    texel = "vt_curve(vt_layer0_alpha_u_curve, vt_channel(layer0_alpha_u_map, 0, UV))"
    assert f"float layer0_alpha_u = clamp({texel} * 1.0 + 0.0, 0.0, 1.0);" in made


def test_a_pane_of_measured_glass_is_a_closure_that_goes_straight_on() -> None:
    """Its index is one of three channels, and in closed form the same on both sides."""
    made = osl("frosted-glass", "weier2020").text
    assert "BSDF += (" in made and 'microfacet("ggx", view, x, ' in made


def test_closures_of_a_mixture_are_those_of_its_stacks_by_their_shares() -> None:
    """Random mixtures in double precision: recorded weights, roughnesses and indices against those of each stack in
    NumPy, with names of the mixture for all inputs."""
    case = mixed_case([PATTERNS[k] for k in (9, 15, 18)], 12, np.random.default_rng(3))
    model, wi = named("weier2020"), recording.direction("wi")
    mix, values = case.whole.stack, case.whole.values
    parts = [_Part.of(path, stack, model, (), wi) for path, stack in mix.leaves()]
    found = closures.weighted(shares(mix, ()), [part.found for part in parts])
    inputs = {f"m.{recording.material.place(at)}": values[at.name] for at, _ in mix.values() if at.name in values}
    inputs |= {f"wi.{axis}": x for axis, x in zip("xyz", case.whole.directions["wi"])}
    truth: list[Closure] = []
    for share, (_, own) in zip(mix.shares(values), case.parts):
        material = Material.from_flat(own.stack, {**Material.of(own.stack).flat(), **own.values})
        body = bsdf.body(material, model, variance(own.stack), at_a_point())
        truth += closures.weighted([share], [closures.of_body(body, tuple(own.directions["wi"]), straight=False)])
    assert [closure.kind for closure in found] == [closure.kind for closure in truth]
    for a, b in zip(evaluate(_numbers(found), inputs), _numbers(truth)):
        np.testing.assert_allclose(np.broadcast_to(a, (3, 12)), np.broadcast_to(b, (3, 12)), rtol=1e-6, atol=1e-12)


@pytest.mark.usefixtures("coarse_solutions")
def test_a_mixture_is_one_shader(tmp_path: Path) -> None:
    """Expected: parameters by flat name, a weight from its texture, columns of each solved stack."""
    (tmp_path / "worn.png").touch()
    mask = {"texture": str(tmp_path / "worn.png"), "channel": "g"}
    mix = vt.Mix([(mask, "coated-gold"), (0.5, "varnished-paint"), (None, vt.Stack([vt.Diffuse(albedo=0.3)]))])
    made = osl(mix)
    assert made.turns and made.text.count("shader ") == 1
    assert f'string part0_weight_map = "{tmp_path}/worn.png"' in made.text
    assert "float part0_weight = clamp(vt_channel(part0_weight_map, 1, UV) * 1.0 + 0.0, 0.0, 1.0);" in made.text
    assert re.search(r'float part1_weight = 0\.5\n +\[\[ string label = "Part 1: weight"', made.text)
    assert 'color part2_layer0_albedo = color(0.3)\n        [[ string label = "Part 2, Layer 0: albedo"' in made.text
    for name in ("part0", "part1"):
        assert re.search(rf"float vt_{name}_columns\[\d+\] = ", made.text)
    fixed = osl(mix, "weier2020", constant=["part1_weight", "part0_layer0_eta"]).text
    assert "part1_weight" not in fixed and "part0_layer0_eta" not in fixed and "part1_layer0_eta" in fixed
    for loss in re.findall(r"cosine .*: (0\.\d+) of the light", made.text):
        assert float(loss) < 0.1


def test_losses_of_a_mixture_are_those_of_its_light() -> None:
    """Expected: of two equal parts those of one; the closures of one alone are off by the share of the other."""
    gold, model = Material.of(vt.preset("coated-rough-metal")), named("weier2020")
    black = Material.of(vt.Stack([vt.Diffuse(albedo=0.0)]))
    known = partial(closures.of_body, bsdf.body(gold, model), straight=False)
    for one, two in zip(*(closures.losses(m, model, known) for m in ([(1.0, gold)], [(0.5, gold), (0.5, gold)]))):
        assert two.variation == pytest.approx(one.variation, abs=5e-3)
    for loss in closures.losses([(0.25, gold), (0.75, black)], model, known):
        assert loss.variation == pytest.approx(1.5, abs=0.05)  # half of 3/4 over 1/4
