"""Measurements of reflectance over angles, a file a format; all become a `ReflectanceTable`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from velatura.inverse.fitting.angles import ReflectanceTable
from velatura.inverse.measured import astm, csv_table, merl, pbrdf, rgl, tensors, zemax

Reader = Callable[[Path], ReflectanceTable]


def load_table(path: str | Path) -> ReflectanceTable:
    """The table in a file: CSV, or a measurement in a format of a database or of a goniometer.

    The first line of a CSV file is `theta_i,theta_o,phi,r,g,b`, phi the azimuth from wi to wo (180: the mirror
    direction), or `theta_i,phi_i,theta_o,phi_o,r,g,b` for a brushed sample. Angles in degrees, theta in 0 to 90
    (excluded); r, g, b the BRDF in 1/sr, without the cosine, negative where noise makes it so.

    By the end of the name: `.binary` is a file of MERL; `.bsdf` one of RGL (`_rgb` or `_spec`) or of Zemax, by its
    content; `.pbsdf` one of KAIST's polarised measurements, of which the unpolarised part is read; `.astm` is text by
    ASTM E1392. Of a measurement a few thousand directions are taken; spectra become linear sRGB under D65.

    Raises:
        InvalidInput: no such file, or its content is none of that; one line that names the file and the place in it.
        MissingTool: an RGL file, and there is no Mitsuba, or no LLVM for it.
    """
    path = Path(path)
    with np.errstate(invalid="ignore"):  # readers refuse what is no number, which warns where it is cast
        return READERS.get(path.suffix.lower(), csv_table.read)(path)


def _bsdf(path: Path) -> ReflectanceTable:
    return (rgl if tensors.begins(path) else zemax).read(path)


#: By the end of the name; all other files are CSV.
READERS: dict[str, Reader] = {".binary": merl.read, ".bsdf": _bsdf, ".pbsdf": pbrdf.read, ".astm": astm.read}
