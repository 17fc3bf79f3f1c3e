"""Unpolarised part of KAIST's polarised measurements (Baek et al. 2020), of isotropic samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import ReflectanceTable
from velatura.inverse.measured import half_angles, tensors
from velatura.stack import spectra

AXES = ("phi_d", "theta_d", "theta_h", "wvls")  # radians, and nanometres


def read(path: Path) -> ReflectanceTable:
    """Colours of light that comes unpolarised and is seen without a polariser, the first entry of Mueller's matrices.

    The values between the file's wavelengths are straight lines; beyond its ends, in deep red and blue, the last hold.

    Raises:
        InvalidInput: not a file of the database; one line that names the file.
    """
    arrays = tensors.read(path)
    matrices = arrays.get("M")
    axes = [np.asarray(arrays[name], float).ravel() for name in AXES if name in arrays]
    if matrices is None or matrices.shape != (*map(len, axes), 4, 4) or len(axes) != len(AXES):
        raise InvalidInput(f"{path}: is no polarised measurement: M must have the axes {', '.join(AXES)}, 4 and 4")
    turn, apart, tilt, wavelengths = axes
    if not all(len(axis) and np.isfinite(axis).all() and (np.diff(axis) > 0).all() for axis in axes):
        raise InvalidInput(f"{path}: {', '.join(AXES)}: must be finite numbers that ascend")
    if not (abs(turn).max() <= 2 * np.pi and all(axis[0] >= 0 and axis[-1] <= 2 for axis in (apart, tilt))):
        raise InvalidInput(f"{path}: {', '.join(AXES[:3])}: must be angles in radians")
    in_rgb = spectra.srgb_of_samples(wavelengths)
    first = np.asarray(matrices[..., 0, 0])
    return half_angles.thinned(
        path,
        np.degrees(tilt),
        np.degrees(apart),
        np.degrees(turn),
        lambda a, b, c: np.einsum("lw,cbaw->labc", in_rgb, first[np.ix_(c, b, a)], dtype=float),
    )
