"""Phase functions of media: as written, as distributions, in stacks by the walk and by energies; media in a row.

Energies against outside solvers are in test_validation.py. Comparisons with walks are at 4.5 standard errors
beyond the error that is allowed (a false alarm in 150 000 each, about 20 of them); seeds are fixed.
"""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel, reference
from velatura.errors import InvalidInput
from velatura.media.of_material import phase_of
from velatura.model import MODELS
from velatura.optics.phase import HenyeyGreenstein, PhaseFunction
from velatura.stack import Material, dumps, load, loads, save

TABLE = {"table": [[0, 10], [20, 3], [100, 0], [150, 0], [180, 0.4]]}
PHASES: dict[str, Any] = {
    "rayleigh": "rayleigh",
    "two lobes": {"forward": 0.9, "backward": -0.3, "share": 0.8},
    "one lobe": {"forward": 0.5, "backward": -0.3, "share": 1},
    "table": TABLE,
    "a part of the angles": {"table": [[10, 2], [90, 1]]},
    "small spheres": {"eta": 1.5, "size": 0.1},
    "spheres": {"eta": 1.33, "size": 20.0, "k": 0.01},
}
WITHOUT_MIE = [name for name, phase in PHASES.items() if "eta" not in phase]
ENERGY, SIGMAS = 0.005, 4.5
METAL = vt.Interface(eta=0.2, k=3.0, alpha=0.2)


def medium(phase: Any, **values: Any) -> vt.Medium:
    if isinstance(phase, dict) and "eta" in phase:
        pytest.importorskip("miepython")
    return vt.Medium(**{"sigma_s": 1.0, **values}, phase=phase)


def function(phase: Any) -> PhaseFunction:
    layer = Material.of(vt.Stack([medium(phase), METAL])).layers[0]
    return phase_of(layer)


# Distributions


@pytest.mark.parametrize("phase", PHASES.values(), ids=PHASES)
def test_a_phase_function_is_a_distribution_that_its_samples_have(phase: Any) -> None:
    """Expected: its integral is 1, its mean cosine the asymmetry that other models read, and samples invert it."""
    found, cosines = function(phase), np.cos(np.linspace(pi, 0, 100_001))
    density = 2 * pi * found.density(cosines)
    assert np.trapezoid(density, cosines) == pytest.approx(1, abs=1e-6)
    asymmetry = vt.Stack([medium(phase), METAL]).flat()["layer0_g"]
    assert np.trapezoid(density * cosines, cosines) == pytest.approx(asymmetry, abs=1e-6)
    below = np.concatenate([[0], np.cumsum(0.5 * np.diff(cosines) * (density[1:] + density[:-1]))])
    u = (np.arange(1000) + 0.5) / 1000
    np.testing.assert_allclose(np.interp(np.sort(found.sample(u)), cosines, below), u, atol=1.001e-3)
    for angle in (0.05, 0.2, 2.0):
        assert found.within(angle) == pytest.approx(1 - np.interp(np.cos(angle), cosines, below), abs=1e-5)


def test_a_needle_is_finite_in_single_precision_either_way() -> None:
    """Expected: cosines are drawn as in double precision, to 2e-6, within -1 to 1 but for rounding; densities at them,
    and where rounding has a cosine beyond 1, are finite, and both are those of the opposite asymmetry turned round."""
    kernel.require_llvm()
    import drjit.llvm as types

    u = np.linspace(0, 1, 1000, endpoint=False, dtype=np.float32)
    for g in (0.9, 0.999, 0.99995):
        ahead, back = HenyeyGreenstein(g), HenyeyGreenstein(-g)
        cosine = ahead.sample(types.Float(u)).numpy()
        np.testing.assert_allclose(cosine, ahead.sample(u.astype(float)), atol=2e-6)
        assert np.abs(cosine).max() < 1 + 3e-7
        turned = -back.sample(types.Float(1 - u)).numpy()
        np.testing.assert_allclose(turned, cosine, atol=4e-6)
        most = np.append(cosine, np.float32([-1.0000002, 1.0000002]))
        density = ahead.density(types.Float(most)).numpy()
        assert np.isfinite(density).all() and (density > 0).all()
        np.testing.assert_array_equal(back.density(types.Float(-most)).numpy(), density)


def test_a_medium_of_needles_is_seen_from_below() -> None:
    """Values, and samples with their weights, are finite; NaN and infinity came of what is lost to rounding."""
    mi = kernel.mitsuba("llvm_ad_rgb")
    needle = vt.Medium(depth=3.5, sigma_s=9.8, g=-0.99995)
    bsdf = vt.bsdf(vt.Stack([vt.Interface(eta=2.4, alpha=0.9), needle, vt.Interface(eta=2.4)]))
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.51**0.5, 0, -0.7)
    u = mi.Float(np.linspace(0, 0.999, 200))
    sample, weight = bsdf.sample(mi.BSDFContext(), si, u, mi.Point2f(u, 0.3))
    value = bsdf.eval(mi.BSDFContext(), si, sample.wo)
    assert all(np.isfinite(np.array(found)).all() for found in (sample.wo, sample.pdf, weight, value))


@pytest.mark.parametrize("phase", PHASES.values(), ids=PHASES)
def test_a_phase_function_is_the_same_in_all_dialects(phase: Any) -> None:
    kernel.require_llvm()
    import drjit.llvm as types

    found, u = function(phase), np.linspace(0.01, 0.99, 50)
    cosine = found.sample(u)
    assert [found.sample(float(x)) for x in u] == pytest.approx(cosine, abs=1e-12)
    np.testing.assert_allclose(found.sample(types.Float(u)).numpy(), cosine, atol=2e-5)
    np.testing.assert_allclose(found.density(types.Float(cosine)).numpy(), found.density(cosine), rtol=2e-3)


@pytest.mark.parametrize(
    "size, eta, k, asymmetry", [(10, 1.5, 0.0, 0.742913), (100, 1.5, 0.0, 0.818246), (1, 1.5, 1.0, 0.192136)]
)
def test_spheres_scatter_as_published(size: float, eta: float, k: float, asymmetry: float) -> None:
    """Asymmetries of Wiscombe (1979), NCAR/TN-140+STR, to what tables of straight lines hold."""
    found = vt.Stack([medium({"eta": eta, "k": k, "size": size}), METAL]).flat()["layer0_g"]
    assert found == pytest.approx(asymmetry, abs=1e-4)


def test_small_spheres_scatter_as_rayleigh_has_it() -> None:
    """Expected: for a size parameter x, with an error of the order of x^2."""
    cosines = np.linspace(-1, 1, 41)
    small = function({"eta": 1.5, "size": 0.05}).density(cosines)
    np.testing.assert_allclose(small, function("rayleigh").density(cosines), rtol=5e-3)


# Stacks


def stacks(phase: Any) -> dict[str, vt.Stack]:
    return {
        "slab": vt.Stack([medium(phase), vt.Interface(eta=1.0)]),
        "coated": vt.Stack([vt.Interface(eta=1.5, alpha=0.2), medium(phase, sigma_a=0.1), METAL]),
        "two": vt.Stack([medium(phase, sigma_a=0.1), vt.Medium(sigma_s=0.5, g=0.7), vt.Diffuse(albedo=0.5)]),
    }


@pytest.mark.parametrize("name", ["slab", "coated", "two"])
@pytest.mark.parametrize("phase", [PHASES[x] for x in ("rayleigh", "two lobes", "table", "spheres")])
def test_energies_are_those_of_walks(phase: Any, name: str) -> None:
    stack, cosines = stacks(phase)[name], [0.9, 0.3]
    walked = reference.statistics(stack, cosines, paths=40_000, microsurface=True)
    assert walked.standard_error
    lobes = vt.lobes(stack, cosines)
    pairs = [(np.sum([*lobes.energy, lobes.remainder], axis=0), sum(walked.energy))]
    errors = [np.sqrt(sum(x**2 for x in walked.standard_error.energy))]
    if stack.transmits:
        assert walked.transmitted and walked.standard_error.transmitted
        pairs.append((lobes.passed, walked.transmitted.energy))
        errors.append(walked.standard_error.transmitted.energy)
    for (value, truth), error in zip(pairs, errors):
        assert np.all(np.abs(value - truth) < ENERGY + SIGMAS * error)


@pytest.mark.parametrize("phase", [PHASES[x] for x in WITHOUT_MIE], ids=WITHOUT_MIE)
def test_values_of_the_walk_sum_up_to_its_energy(phase: Any) -> None:
    """Expected: what is connected to a direction by the density is what samples of the phase function give."""
    mi = kernel.mitsuba()
    import drjit as dr

    stack = stacks(phase)["two"]
    bsdf, u = vt.bsdf(stack, "reference"), np.random.default_rng(1).random((2, 40_000))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0.6, 0, 0.8)
    wo = np.sqrt(u[0]) * np.cos(2 * pi * u[1]), np.sqrt(u[0]) * np.sin(2 * pi * u[1]), np.sqrt(1 - u[0])
    values = pi * np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*wo)))[0] / wo[2]
    walked = reference.statistics(stack, 0.8, paths=40_000)
    assert walked.standard_error
    error = np.hypot(values.std() / 200, np.sqrt(sum(x[0, 0] ** 2 for x in walked.standard_error.energy)))
    assert abs(values.mean() - sum(x[0, 0] for x in walked.energy)) < SIGMAS * error


@pytest.mark.parametrize("model", [model.name for model in MODELS])
def test_media_in_a_row_are_as_with_an_interface_without_a_step_between(model: str) -> None:
    """Expected: the same energies but for the lobe of what reflects nothing; where total reflection counts, belcour2018
    looks at it once more for any interface."""
    above, first, second = vt.Interface(eta=1.5, alpha=0.1), medium("rayleigh", sigma_a=0.2), vt.Medium(sigma_s=0.5)
    row, apart = [above, first, second, METAL], [above, first, vt.Interface(eta=1.5), second, METAL]
    switches = {"tir": "off"} if model == "belcour2018" else {}
    found, known = (vt.lobes(vt.Stack(layers), 0.7, model=model, **switches) for layers in (row, apart))
    np.testing.assert_allclose(found.energy[-1], known.energy[-1], atol=2e-4)
    np.testing.assert_allclose(found.remainder, known.remainder, atol=2e-4)


def test_the_walk_counts_no_surface_between_media_in_a_row() -> None:
    layers: list[Any] = [vt.Interface(eta=1.5, alpha=0.1), medium("rayleigh"), vt.Medium(sigma_a=0.5), METAL]
    walked = reference.statistics(vt.Stack(layers), 0.7, paths=20_000)
    assert len(walked.energy) == 2
    one = reference.statistics(vt.Stack([*layers[:2], METAL]), 0.7, paths=20_000)
    assert walked.energy[0] == pytest.approx(one.energy[0], abs=0.01)


def test_a_plugin_offers_no_asymmetry_that_follows_from_a_phase_function() -> None:
    mi = kernel.mitsuba()
    stack = vt.Stack([medium("rayleigh"), vt.Medium(sigma_s=0.5, g=0.3), METAL])
    for model in ("velatura", "reference", "belcour2018"):
        offered = mi.traverse(vt.bsdf(stack, model)).keys()
        assert "layer0_g" not in offered and {"layer0_sigma_s", "layer1_g"} <= set(offered)


# As written


@pytest.mark.parametrize("phase", PHASES.values(), ids=PHASES)
def test_a_phase_function_is_written_and_read(phase: Any) -> None:
    stack = vt.Stack([vt.Medium(sigma_s=1.0, phase=phase), METAL])
    assert loads(dumps(stack)) == loads(dumps(stack, "json"), "m.json") == stack


def test_a_table_is_read_from_a_file_beside_the_material(tmp_path: Path) -> None:
    (tmp_path / "haze.csv").write_text("# degrees, any unit\n0, 10\n20, 3\n100, 0\n150, 0\n180, 0.4\n")
    (tmp_path / "m.yaml").write_text("layers: [{medium: {sigma_s: 1, phase: {table: haze.csv}}}, {diffuse: {}}]")
    stack = load(tmp_path / "m.yaml")
    assert stack.flat()["layer0_g"] == pytest.approx(vt.Stack([medium(TABLE), METAL]).flat()["layer0_g"], abs=1e-12)
    (tmp_path / "other").mkdir()
    save(stack, tmp_path / "other" / "m.yaml")
    assert "{table: ../haze.csv}" in (tmp_path / "other" / "m.yaml").read_text()


def test_a_phase_function_and_an_asymmetry_replace_each_other() -> None:
    stack = vt.Stack([vt.Medium(sigma_s=1.0, g=0.3), METAL])
    scattered = stack.replace(layer0_phase="rayleigh")
    assert scattered.layers[0] == vt.Medium(sigma_s=1.0, phase="rayleigh")
    assert scattered.replace(layer0_g=0.3) == stack


@pytest.mark.parametrize(
    "phase, reason",
    {
        "raileigh": "unknown phase function 'raileigh' (did you mean rayleigh?); or write keys",
        "3": "must be rayleigh, or keys of which one is forward, table, eta, got 3",
        "{g: 0.5}": "must be rayleigh, or keys of which one is forward, table, eta, got {'g': 0.5}",
        "{forward: 0.9, share: 1}": "backward: missing",
        "{forward: 1, backward: 0, share: 1}": "forward: must lie in -1 to 1, both excluded, got 1",
        "{forward: 0.5, backward: 0, share: 2}": "share: must lie in 0 to 1, got 2",
        "{table: [[0, 1]]}": "table: must be a file, or a list of 2 to 4096 rows [angle, value], got [[0, 1]]",
        "{table: [[0, 1], [180, .nan]]}": "table: must be finite, got nan",
        "{table: [[0, 1], [181, 1]]}": "table: must lie in 0 to 180, got 181",
        "{table: [[0, 1], [0, 1]]}": "table: angles must ascend",
        "{table: [[0, 0], [9, 0]]}": "table: must have a value above 0",
        "{table: [[0, 1], [180, -1]]}": "table: must lie in 0 to 1e9, got -1",
        "{eta: 1.5}": "radius_um: write radius_um or size, one of them",
        "{eta: 1.5, size: 1, radius_um: 1}": "radius_um: write radius_um or size, one of them",
        "{eta: 1.5, radius_um: 100}": (
            "radius_um: the circumference over the wavelength in the medium must lie in 0.001 to 200, got 1142"
        ),
        "{eta: 1.5, size: .inf}": "size: must be finite, got inf",
        "{eta: 1.5, size: 1, colour: red}": "unknown key 'colour' (known: eta, ",
    }.items(),
)
def test_a_wrong_phase_function_gets_one_line(phase: str, reason: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        loads(f"layers: [{{medium: {{phase: {phase}}}}}, {{diffuse: {{}}}}]", "m.yaml")
    assert str(caught.value).startswith(f"m.yaml: layer 0 (medium): phase: {reason}")
    with pytest.raises(InvalidInput, match="g: not together with phase, which has an asymmetry of its own"):
        vt.Medium(phase="rayleigh", g=0.1)


@pytest.mark.parametrize(
    "text, reason",
    {
        "": "must hold values at two angles or more",
        "0 1": "must hold values at two angles or more",
        "0 1\n10 x": "line 2: must be an angle in degrees and a value",
        "0 1\n10 1 1": "line 2: must be an angle in degrees and a value",
        "angle,value\n0,1\n1,1": "line 1: must be an angle in degrees and a value",
        "0 1\n0 1": "line 2: angles must ascend",
        "0 1\n10 nan": "line 2: must be finite",
        "0 1\n10 -1": "angles must lie in 0 to 180, and values in 0 to 1e+09",
        "-1 1\n10 1": "angles must lie in 0 to 180, and values in 0 to 1e+09",
        "0 1\n181 1": "angles must lie in 0 to 180, and values in 0 to 1e+09",
        "0 0\n180 0": "must have a value above 0",
        "0 1\n1 1\n" + 2**20 * "#": "is larger than 1 MiB",
    }.items(),
)
def test_a_wrong_file_gets_one_line(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(text)
    with pytest.raises(InvalidInput) as caught:
        loads("layers: [{medium: {phase: {table: own.csv}}}, {diffuse: {}}]", "m.yaml", tmp_path)
    assert str(caught.value) == f"m.yaml: layer 0 (medium): phase: {(tmp_path / 'own.csv').resolve()}: {reason}"


def test_what_no_package_works_out_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "miepython", None)
    with pytest.raises(vt.MissingTool, match=r"miepython is not installed: run `.* -m pip install .*velatura\[mie\]"):
        vt.lobes(vt.Stack([vt.Medium(phase={"eta": 1.123, "size": 0.777}), METAL]), 1.0)
