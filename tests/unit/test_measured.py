"""Files of measurements: written here as their formats have them, with the values of a stack, and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing.imports import rgl, tensors

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.inverse import Directions, load_table, table_of
from velatura.model import named
from velatura.stack import Interface, Medium, Stack

pytestmark = pytest.mark.usefixtures("one_thread")

AVERAGED = named("bati2021")
COATED = Stack(
    [
        Interface(eta=1.5, alpha=0.2),
        Medium(sigma_a=(0.1, 0.3, 0.6)),
        Interface(eta=(1.2, 1.1, 0.9), k=(3.0, 2.5, 2.0), alpha=(0.25, 0.4), rotation=20),
    ]
)
ROUND = COATED.replace(layer2_alpha=0.3, layer2_rotation=0)
WAVELENGTHS = [450, 500, 550, 600, 650]
REFLECTED = [0.2, 0.3, 0.5, 0.4, 0.1]
SRGB = 3e-3  # Mitsuba sums over its own steps of wavelength


def direction(theta: Any, phi: Any) -> np.ndarray:
    """Unit vectors, from degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi])


def brdf(wi: np.ndarray, wo: np.ndarray, stack: Stack = COATED) -> np.ndarray:
    """Colours (3, N)."""
    return table_of(stack, Directions(wi, wo, np.degrees(np.arccos(wi[2]))), AVERAGED).value


def colour(reflected: list[float]) -> np.ndarray:
    """Linear sRGB of values at WAVELENGTHS, by Mitsuba; what lies outside of them has the first or last value."""
    mi = kernel.mitsuba()
    held = [reflected[0], *reflected, reflected[-1]]
    return np.array(mi.spectrum_list_to_srgb([360, *WAVELENGTHS, 830], held, bounded=False, d65=True))


# ASTM E1392 ----------------------------------------------------------------------------------------------------------

HEADER = "TITLE a sample\nNUM_POINTS 40\n"


def test_text_by_astm(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    angles = np.array(
        [rng.uniform(5, 70, 40), rng.uniform(0, 180, 40), rng.uniform(0, 70, 40), rng.uniform(0, 180, 40)]
    )
    value = brdf(direction(*angles[:2]), direction(*angles[2:]))
    lines = [",".join(repr(float(x)) for x in (*np.radians(angle), *v)) for angle, v in zip(angles.T, value.T)]
    path = tmp_path / "brushed.astm"
    path.write_text(f"{HEADER}VARS theta_i,phi_i,theta_s,phi_s,R,G,B\r\n" + "\n".join(lines))
    table = load_table(path)
    assert np.allclose(table.value, value) and table.directions.brushed
    assert np.allclose(table_of(COATED, table.directions, AVERAGED).value, value, rtol=1e-6)


def test_spectra_by_astm(tmp_path: Path) -> None:
    """Expected: the colour that Mitsuba gives the spectrum, and grey where there is one value."""
    path = tmp_path / "paint.astm"
    names, values = (",".join(map(str, each)) for each in ([f"{nm}nm" for nm in WAVELENGTHS], REFLECTED))
    path.write_text(f"VARS theta_i,phi_i,theta_s,phi_s,{names}\n0.1,0,0.2,3,{values}\n")
    assert np.allclose(load_table(path).value[:, 0], colour(REFLECTED), rtol=SRGB)
    path.write_text("VARS theta_i,phi_i,theta_s,phi_s,BRDF\n0.1,0,0.2,3,0.7\n")
    assert load_table(path).value[:, 0].tolist() == [0.7] * 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no text by ASTM E1392: no line begins with VARS"),
        ("VARS theta_i,phi_i\n", "line 1: VARS must be theta_i,phi_i,theta_s,phi_s and names of values"),
        ("x\nVARS theta_i,phi_i,theta_s,phi_s,a,b\n", "line 2: values must be one value, R,G,B, X,Y,Z, or wavelengths"),
        ("VARS theta_i,phi_i,theta_s,phi_s,600nm,500nm\n", "line 1: values must be one value, R,G,B, X,Y,Z, or"),
        ("VARS theta_i,phi_i,theta_s,phi_s,f\n", "holds no directions"),
        ("VARS theta_i,phi_i,theta_s,phi_s,f\n0,0,45,0,1\n", "line 2: theta_s: must lie in 0 to 90 (excluded) degrees"),
        ("VARS theta_i,phi_i,theta_s,phi_s,f\n\n0,0,1\n", "line 3: must hold 5 numbers, theta_i,phi_i,theta_s,phi_s,f"),
        ("VARS theta_i,phi_i,theta_s,phi_s,f\n0,0,0,0,nan\n", "line 2: f: must be a finite number, got 'nan'"),
    ],
)
def test_what_is_no_text_by_astm(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.astm"
    path.write_text(text)
    with pytest.raises(InvalidInput) as error:
        load_table(path)
    assert str(error.value).startswith(f"{path}: {message}")


# Zemax ---------------------------------------------------------------------------------------------------------------

ROTATION, THETA, AZIMUTH, RADIAL = [0, 30], [0, 20, 60], [0, 45, 90, 180, 300], [0, 2, 10, 40]


def zemax(value: np.ndarray, content: str = "XYZ", names: tuple[str, ...] = ("X", "Y", "Z")) -> str:
    """The text of a file of values over its axes."""
    text = f"# made\nSource  Measured\nSymmetry  Asymmetrical4D\nSpectralContent  {content}\nScatterType  BRDF\n"
    axes = {"SampleRotation": ROTATION, "AngleOfIncidence": THETA, "ScatterAzimuth": AZIMUTH, "ScatterRadial": RADIAL}
    for key, axis in axes.items():
        text += f"{key}  {len(axis)}\n{' '.join(map(str, axis))}\n"
    for name, each in zip(names, value):
        text += f"\n{name if content == 'Monochrome' else 'Tristimulus' + name}\nDataBegin\n"
        for block in each.reshape(-1, len(AZIMUTH), len(RADIAL)):
            text += "TIS 0.5\n" + "\n".join(" ".join(map(repr, row)) for row in block.tolist()) + "\n"
        text += "DataEnd\n"
    return text


def test_a_zemax_file(tmp_path: Path) -> None:
    """Values about the mirror direction: the azimuth about it is 0 towards the normal, and at rotation 0 the plane of
    incidence is that of y and z."""
    rotation, theta, azimuth, radial = (x.ravel() for x in np.meshgrid(ROTATION, THETA, AZIMUTH, RADIAL, indexing="ij"))
    wi, mirror = direction(theta, 90 + rotation), direction(theta, 270 + rotation)
    tilted = direction(theta - 90, 270 + rotation)  # at a right angle from it, towards the normal
    aside = np.cross(mirror, tilted, axis=0)
    a, r = np.radians(azimuth), np.radians(radial)
    wo = np.cos(r) * mirror + np.sin(r) * (np.cos(a) * tilted + np.sin(a) * aside)
    above = wo[2] > 1e-3
    value = np.zeros((3, len(theta)))
    value[:, above] = brdf(wi[:, above], wo[:, above])
    xyz = np.linalg.inv(np.array([[3.240479, -1.53715, -0.498535], [-0.969256, 1.875991, 0.041556],
                                  [0.055648, -0.204043, 1.057311]])) @ value  # fmt: skip
    path = tmp_path / "brushed.bsdf"
    path.write_text(zemax(xyz))
    table = load_table(path)
    assert table.value.shape[1] == np.count_nonzero(above) < len(theta)
    assert np.allclose(table_of(COATED, table.directions, AVERAGED).value, table.value, rtol=1e-6, atol=1e-9)

    path.write_text(zemax(value[:1], "Monochrome", ("Monochrome",)))
    assert np.allclose(load_table(path).value, value[0, above])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ScatterType  BRDF", "ScatterType  BTDF", "line 5: must be BRDF, got 'BTDF'"),
        ("SampleRotation  2", "SampleRotation  1e9", "line 6: number of SampleRotation: must lie in 1 to 10000"),
        ("0 20 60", "0 20 95", "line 9: AngleOfIncidence: must lie in 0 to 90, got 95"),
        ("TIS 0.5", "TIS x", "line 17: TIS: must be a finite number, got 'x'"),
        ("DataEnd", "", "ends before DataEnd"),
        ("ScatterRadial  4", "ScatterRadial  5", "line 15: ScatterRadial: must be a finite number, got 'Monochrome'"),
    ],
)
def test_what_is_no_zemax_file(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.bsdf"
    text = zemax(np.ones((1, 2, 3, 5, 4)), "Monochrome", ("Monochrome",))
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InvalidInput) as error:
        load_table(path)
    assert message in str(error.value)


# Tensors -------------------------------------------------------------------------------------------------------------


def test_a_polarised_measurement(tmp_path: Path) -> None:
    """Expected: the values of Mitsuba's own plugin for such files at one wavelength, since the others are the same; no
    directions where the file has no numbers; and of a spectrum the colour that Mitsuba gives it."""
    mi, single = kernel.mitsuba(), np.float32
    turn, apart, tilt = np.linspace(-np.pi, np.pi, 9), np.linspace(0, 1.2, 7), np.linspace(0, 1.2, 9)
    grid = np.degrees(np.meshgrid(turn, apart, tilt, indexing="ij")).reshape(3, -1)
    at = Directions.about_halves(*grid[::-1])
    value = np.full(grid.shape[1], np.nan)
    value[at.above] = brdf(at.wi[:, at.above], at.wo[:, at.above], ROUND).mean(axis=0)
    matrices = np.zeros((9, 7, 9, 5, 4, 4), single)
    matrices[..., 0, 0] = value.reshape(9, 7, 9, 1)
    fields: dict[str, Any] = {
        "phi_d": turn[None].astype(single),
        "theta_d": apart[None].astype(single),
        "theta_h": tilt[None].astype(single),
        "wvls": np.array(WAVELENGTHS, np.uint16),
        "M": matrices,
    }
    path = tmp_path / "gold.pbsdf"
    path.write_bytes(tensors(fields))
    table = load_table(path)
    assert 100 < table.value.shape[1] <= np.count_nonzero(at.above)
    assert np.allclose(table_of(ROUND, table.directions, AVERAGED).value.mean(axis=0), table.value, rtol=1e-4)
    plugin = mi.load_dict({"type": "measured_polarized", "filename": str(path), "wavelength": 550.0})
    si = mi.SurfaceInteraction3f()
    si.wi, wo = mi.Vector3f(table.directions.wo), mi.Vector3f(table.directions.wi)  # light arrives along wo
    drawn = np.array(plugin.eval(mi.BSDFContext(), si, wo)) / table.directions.wi[2]
    inside = np.abs(table.directions.tilt) > 1  # Mitsuba has no azimuth at the normal
    near = np.isfinite(drawn).all(axis=0) & inside & (drawn[0] > 0)
    assert np.count_nonzero(near) > 50
    assert np.allclose(drawn[:, near], table.value[:, near], rtol=0.02)

    matrices[..., 0, 0] = np.array(REFLECTED, single)
    path.write_bytes(tensors({**fields, "M": matrices}))
    assert np.allclose(load_table(path).value[:, 0], colour(REFLECTED), rtol=SRGB)
    path.write_bytes(tensors({**fields, "M": matrices[1:]}))
    with pytest.raises(InvalidInput, match=r"gold\.pbsdf: is no polarised measurement: M must have the axes phi_d"):
        load_table(path)
    path.write_bytes(tensors({**fields, "phi_d": np.degrees(fields["phi_d"])}))
    with pytest.raises(InvalidInput, match=r"gold\.pbsdf: phi_d, theta_d, theta_h: must be angles in radians"):
        load_table(path)
    signalling = np.full((1, len(turn)), 0x7F800001, np.uint32).view(single)  # no numbers, of which casts warn
    path.write_bytes(tensors({**fields, "phi_d": signalling}))
    message = r"gold\.pbsdf: phi_d, theta_d, theta_h, wvls: must be finite numbers"
    with np.errstate(invalid="raise"), pytest.raises(InvalidInput, match=message):
        load_table(path)
    path.write_bytes(b"")
    with pytest.raises(InvalidInput, match=r"gold\.pbsdf: cannot be read"):
        load_table(path)


def test_spectra_of_rgl(tmp_path: Path) -> None:
    """With a constant NDF D and projected area s, f cos is the spectrum D / (4 s), in the colour by Mitsuba."""
    path = tmp_path / "paint_spec.bsdf"
    spectra = np.tile(np.array(REFLECTED)[:, None, None], (1, 3, 1, 4, 4))
    grids = np.full((4, 4), 0.5), np.full((4, 4), 0.25)
    fields = rgl(*grids, wavelengths=np.array(WAVELENGTHS), spectra=spectra)
    path.write_bytes(tensors(fields))
    table = load_table(path)
    assert not table.directions.brushed
    cosine = table.value * table.directions.wo[2]
    assert np.allclose(cosine, 0.5 * colour(REFLECTED)[:, None], rtol=SRGB)
    path.write_bytes(tensors({**fields, "spectra": 1e30 * fields["spectra"]}))
    with pytest.raises(InvalidInput, match=r"paint_spec\.bsdf: spectra: must lie in -1e\+09 to 1e\+09"):
        load_table(path)
    path.write_bytes(tensors({**fields, "wavelengths": fields["wavelengths"][1:]}))
    with pytest.raises(InvalidInput, match=r"paint_spec\.bsdf: spectra: must have as many values as there are wave"):
        load_table(path)
