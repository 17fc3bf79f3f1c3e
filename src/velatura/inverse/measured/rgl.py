"""Measurements of the RGL database (Dupuy & Jakob 2018), on adaptive grids, which Mitsuba reads: `_rgb` and `_spec`."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path

import numpy as np

from velatura import kernel
from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import AZIMUTHS, Directions, ReflectanceTable
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.measured import rows, tensors
from velatura.stack import spectra

ROUND = 1e-3  # share of the brightest value by which a measurement may depend on its azimuth, and be isotropic


def read(path: Path) -> ReflectanceTable:
    """Values at the directions where stacks are compared, of one azimuth unless the sample is brushed.

    A spectrum becomes linear sRGB under D65, on the file's own grids, before it is interpolated.

    Raises:
        InvalidInput: not a file of the database, or a variant that cannot read it; one line that names the file.
        MissingTool: there is no Mitsuba, or no LLVM for it.
    """
    mi = kernel.mitsuba()
    if not mi.is_rgb or mi.variant().startswith("scalar"):
        raise InvalidInput(f"{path}: is read in a vectorised RGB variant, llvm_ad_rgb for one, not in {mi.variant()}")
    arrays = tensors.read(path)
    _check(path, arrays)
    if "spectra" not in arrays:
        return _interpolated(path, path)
    with tempfile.TemporaryDirectory(prefix="velatura-") as folder:
        in_rgb = Path(folder, "rgb.bsdf")
        with contextlib.redirect_stdout(io.StringIO()):  # it says what it wrote
            mi.tensor_io.write(str(in_rgb), **_in_rgb(path, arrays))
        return _interpolated(path, in_rgb)


def _in_rgb(path: Path, arrays: tensors.Arrays) -> tensors.Arrays:
    """The arrays with colours in place of spectra."""
    wavelengths, values = arrays.get("wavelengths"), arrays["spectra"]
    if wavelengths is None or wavelengths.ndim != 1 or values.ndim != 5 or values.shape[2] != len(wavelengths):
        raise InvalidInput(f"{path}: spectra: must have as many values as there are wavelengths")
    colours = np.einsum("cw,ptwij->ptcij", spectra.srgb_of_samples(wavelengths).astype(np.float32), values)
    rest = {name: np.array(each) for name, each in arrays.items() if name not in ("spectra", "wavelengths", "rgb")}
    return {**rest, "rgb": np.ascontiguousarray(colours, np.float32)}


def _interpolated(path: Path, in_rgb: Path) -> ReflectanceTable:
    """Mitsuba's values of a file in RGB; `path` is the name in messages."""
    mi = kernel.mitsuba()

    def at(directions: Directions) -> Array:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(directions.wi)
        return np.array(measured.eval(mi.BSDFContext(), si, mi.Vector3f(directions.wo))) / directions.wo[2]

    plain, all_round = (Directions.about_lobes(turned) for turned in (False, True))
    try:
        with kernel.exclusive:
            measured = mi.load_dict({"type": "measured", "filename": str(in_rgb)})
            each, found = [at(plain.turned(azimuth)) for azimuth in AZIMUTHS], at(all_round)
    except RuntimeError as error:
        raise InvalidInput(f"{path}: is no file of the RGL database: {kernel.reason(error)}") from None
    if not np.isfinite(found).all():
        raise InvalidInput(f"{path}: holds values that are no finite numbers")
    brushed = np.ptp(each, axis=0).max() > ROUND * np.max(each)
    return ReflectanceTable(all_round, found) if brushed else ReflectanceTable(plain, each[0])


def _check(path: Path, arrays: tensors.Arrays) -> None:
    """Refuse arrays with memory unset, or whose nodes are none.

    Raises:
        InvalidInput: numbers that are not finite, or too large, grids without an inside, an isotropic sample
            that depends on its azimuth.
    """
    missing = [name for name in ("theta_i", "phi_i") if name not in arrays]
    if missing:
        raise InvalidInput(f"{path}: is no file of the RGL database: it holds no {missing[0]}")
    usable = all(
        each.size and (each.dtype.kind != "f" or bool(np.isfinite(each).all())) and (each.ndim < 2 or _inside(each))
        for each in arrays.values()
    ) and all((np.diff(arrays[name]) > 0).all() for name in ("theta_i", "phi_i", "wavelengths") if name in arrays)
    if not usable:
        raise InvalidInput(f"{path}: holds values that are no finite numbers, or no grids of them")
    for name in ("rgb", "spectra"):
        if name in arrays and np.abs(arrays[name]).max() > rows.BRIGHTEST:
            raise InvalidInput(f"{path}: {name}: must lie in -{rows.BRIGHTEST:g} to {rows.BRIGHTEST:g}")
    # Mitsuba takes up to two azimuths for an isotropic sample, and then mirrors directions or not by a number not set
    if len(arrays["phi_i"]) == 2:
        for name in ("vndf", "luminance", "rgb", "spectra"):
            if name in arrays and np.ptp(arrays[name], axis=0).any():
                rule = "must be equal at two azimuths, which are an isotropic sample's"
                raise InvalidInput(f"{path}: {name}: {rule}, or hold more")


def _inside(grid: Array) -> bool:
    return min(grid.shape[-2:]) > 1
