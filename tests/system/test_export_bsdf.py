"""Measurements that are written, drawn by Mitsuba's own plugin for them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import velatura as vt
from velatura import kernel
from velatura.inverse import load_table, table_of

pytestmark = pytest.mark.usefixtures("one_thread")

Run = Callable[..., tuple[int, str, str]]

SAMPLES = 200_000  # directions; their weights have a mean whose error is below .001
NAME = '"""*/ é 漢字 --> </bsdf>'


@pytest.mark.parametrize(
    ("preset", "bound"), [("wet-copper", 0.02), ("coated-gold", 0.04), ("half-metallic-paint", 0.02)]
)
def test_mitsuba_reflects_as_much_as_the_lobes_say(preset: str, bound: float, tmp_path: Path) -> None:
    """Expected: the albedo of directions that `measured` samples is that of the lobes, of a smooth coat, of a brushed
    material and of a mixture, at any azimuth; and values are those of the stack where a fit compares them."""
    path, material = tmp_path / "a.bsdf", vt.preset(preset)
    made = vt.export(material, "bsdf")
    assert made.save(path)[0] == path and "of reflected light in total variation" in made.notes[0]
    mi, rng = kernel.mitsuba(), np.random.default_rng(0)
    measured = mi.load_dict({"type": "measured", "filename": str(path)})
    for cosine, phi in ((0.9, 0.0), (0.5, 2.0), (0.25, -1.0)):
        sine = np.sqrt(1 - cosine**2)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(np.tile([[sine * np.cos(phi)], [sine * np.sin(phi)], [cosine]], SAMPLES))
        u = rng.uniform(0, 1, (3, SAMPLES))
        _, weight = measured.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
        lobes = vt.lobes(material, cosine, phi)
        expected = (sum(lobes.energy) + lobes.remainder)[:, 0]
        assert np.abs(np.array(weight).mean(axis=1) - expected).max() < bound
    if isinstance(material, vt.Stack):
        table = load_table(path)
        cosine = table.directions.wo[2]
        own = table_of(material, table.directions, "velatura").value
        size = np.sqrt(np.mean((own * cosine) ** 2))
        assert np.sqrt(np.mean(((own - table.value) * cosine) ** 2)) < 1.5 * bound * size


def test_a_measurement_is_written_to_a_file_alone(run: Run, tmp_path: Path) -> None:
    """Expected: one line for what has no place in it; a name is only bytes; what passes is stated."""
    assert run("export", "bare-gold", "--to", "bsdf")[::2] == (
        2,
        "velatura: --to bsdf: is no text; name its file with -o\n",
    )
    path = tmp_path / "glass.bsdf"
    status, out, err = run("export", "frosted-glass", "--to", "bsdf", "-o", str(path))
    assert (status, out) == (0, f"{path}, and beside it {path}.json\n") and "What passes is left out" in err
    status, _, err = run("export", "dusty-varnish", "--to", "bsdf", "-o", str(tmp_path / "b.bsdf"))
    assert status == 2 and "part0_weight: a measurement is of one point, and has no textures" in err
    assert not (tmp_path / "b.bsdf").exists()
    named = vt.export(vt.Stack([vt.Diffuse(albedo=0.5)], name=NAME), "bsdf")
    assert named.data and NAME.encode() in named.data
    path.write_bytes(named.data)
    table = load_table(path)
    cosine = table.directions.wo[2]
    assert np.allclose(table.value * cosine, 0.5 / np.pi * cosine, atol=3e-3)
