"""Measured spectra: by name, metals and a few crystals from the data files that Mitsuba's wheel carries and other
dielectrics from dispersion formulas; and from tables of one's own.

Mitsuba itself is not imported, and NumPy only where a spectrum is read.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.machinery import PathFinder
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from velatura.errors import InvalidInput, MissingTool
from velatura.stack import tables
from velatura.stack.tables import Table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MIRROR = "mirror"  # the conductor that reflects all light; it has no spectrum

# Files of the wheel that are no metals: k is 0 over the visible range.
_CRYSTALS = ("CsI", "MgO", "SiC", "ThF4", "TiO2", "TiO2-e", "d-C")

# Files of the wheel with holes: eta is 0 below 440 nm (AlAs), nothing above 590 nm (AlSb), k is 0 throughout (SnTe).
_BROKEN = ("AlAs", "AlSb", "SnTe")

VISIBLE_NM = (360.0, 830.0)  # that Mitsuba renders
LUMINANCE = (0.212671, 0.715160, 0.072169)  # of linear sRGB (ITU-R BT.709), as in Mitsuba

SRGB_FROM_XYZ = (  # ITU-R BT.709 primaries
    (3.240479, -1.537150, -0.498535),
    (-0.969256, 1.875991, 0.041556),
    (0.055648, -0.204043, 1.057311),
)

#: Other names of materials.
ALIASES = {
    "aluminium": "Al",
    "aluminum": "Al",
    "chromium": "Cr",
    "chrome": "Cr",
    "copper": "Cu",
    "gold": "Au",
    "mercury": "Hg",
    "molybdenum": "Mo",
    "nickel": "Ni_palik",
    "rhodium": "Rh",
    "silver": "Ag",
    "tantalum": "Ta",
    "titanium-nitride": "TiN",
    "tungsten": "W",
    "diamond": "d-C",
    "rutile": "TiO2",
    "acrylic": "pmma",
    "alumina": "sapphire",
    "clear-coat": "polyurethane",
    "glass": "bk7",
    "quartz": "fused-silica",
}


class Measured:
    """A value that was measured over wavelength; frozen, so that what follows from it is worked out once."""

    def table(self) -> Table:
        """Wavelengths in nanometres, ascending, and the values there."""
        raise NotImplementedError


@dataclass(frozen=True)
class Named(Measured):
    """The spectrum of a material's index: its real part (`eta`) or its extinction (`k`)."""

    name: str
    part: Literal["eta", "k"]

    def table(self) -> Table:
        return _by_name(self)


@dataclass(frozen=True)
class MeasuredIndex:
    """The index eta + i k of a metal, of which both parts were measured over wavelength."""

    eta: Measured
    k: Measured


@dataclass(frozen=True)
class Dispersion:
    """Refractive index by Sellmeier's formula, n^2 = 1 + sum of b w^2 / (w^2 - c), wavelength w in micrometres.

    One term with c = 0 is a constant index.
    """

    terms: tuple[tuple[float, float], ...]
    source: str


def _constant(index: float, source: str) -> Dispersion:
    return Dispersion(((index**2 - 1, 0.0),), source)


DISPERSIONS = {
    "bk7": Dispersion(
        ((1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)),
        "Schott, data sheet of N-BK7",
    ),
    "sf11": Dispersion(
        ((1.73759695, 0.013188707), (0.313747346, 0.0623068142), (1.89878101, 155.23629)),
        "Schott, data sheet of N-SF11",
    ),
    "fused-silica": Dispersion(
        ((0.6961663, 0.0684043**2), (0.4079426, 0.1162414**2), (0.8974794, 9.896161**2)),
        "Malitson 1965, J. Opt. Soc. Am. 55",
    ),
    "sapphire": Dispersion(
        ((1.4313493, 0.0726631**2), (0.65054713, 0.1193242**2), (5.3414021, 18.028251**2)),
        "Malitson and Dodge 1972, ordinary ray",
    ),
    "water": Dispersion(
        (
            (0.5684027565, 0.005101829712),
            (0.1726177391, 0.01821153936),
            (0.02086189578, 0.02620722293),
            (0.1130748688, 10.69792721),
        ),
        "Daimon and Masumura 2007, Appl. Opt. 46, at 20 degrees Celsius",
    ),
    "pmma": Dispersion(((1.1819, 0.011313),), "Sultanova et al. 2009, Acta Phys. Pol. A 116"),
    "polycarbonate": Dispersion(((1.4182, 0.021304),), "Sultanova et al. 2009, Acta Phys. Pol. A 116"),
    "polystyrene": Dispersion(((1.4435, 0.020216),), "Sultanova et al. 2009, Acta Phys. Pol. A 116"),
    "air": _constant(1.000277, "Mitsuba 3's list of dielectrics"),
    "ice": _constant(1.31, "Mitsuba 3's list of dielectrics"),
    "ethanol": _constant(1.361, "Mitsuba 3's list of dielectrics"),
    "glycerol": _constant(1.4729, "Mitsuba 3's list of dielectrics"),
    "pyrex": _constant(1.47, "Mitsuba 3's list of dielectrics"),
    "polypropylene": _constant(1.49, "Mitsuba 3's list of dielectrics"),
    "salt": _constant(1.544, "Mitsuba 3's list of dielectrics"),
    "amber": _constant(1.55, "Mitsuba 3's list of dielectrics"),
    "pet": _constant(1.575, "Mitsuba 3's list of dielectrics"),
    "polyurethane": _constant(1.5, "chosen: clear coats lie near 1.5"),
    "lacquer": _constant(1.5, "chosen: lacquers and resins lie near 1.5"),
    "varnish": _constant(1.5, "chosen: varnishes lie near 1.5"),
    "oil": _constant(1.47, "chosen: mineral and vegetable oils lie near 1.47"),
}


@functools.cache
def names() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """All names that a material may use: (conductors, dielectrics), each sorted.

    Raises:
        MissingTool: Mitsuba, whose wheel carries the data, is not installed.
    """
    files = {path.name[: -len(".k.spd")] for path in _folder().glob("*.k.spd")}
    files = {name for name in files if name.removesuffix("_palik") not in _BROKEN}
    crystals = {name for name in files if name.removesuffix("_palik") in _CRYSTALS}
    dielectrics = crystals | set(DISPERSIONS)
    metals = files - crystals
    for alias, name in ALIASES.items():
        (metals if name in metals else dielectrics).add(alias)
    return tuple(sorted(metals)), tuple(sorted(dielectrics))


@functools.cache
def source(name: str) -> str:
    """Where the spectrum of a material by name comes from, as far as its file states it.

    Raises:
        MissingTool: Mitsuba, whose wheel carries the data, is not installed.
    """
    name = ALIASES.get(name, name)
    if name in DISPERSIONS:
        return DISPERSIONS[name].source
    with (_folder() / f"{name}.eta.spd").open(encoding="utf-8", errors="replace") as file:
        comments = [line.strip("#; \t\r\n") for line in file if line.startswith("#")]
    # Without the name of the collection, the rule, the heads of columns and words that lead over
    stated = [line for line in comments if line.strip("-") and not line.endswith((":", "database", "n            k"))]
    what, *where = (line.removeprefix("Optical constants for ") for line in stated)
    return ", ".join([f"luxpop.com, as Mitsuba 3 carries it: {what}", *filter(None, [" ".join(where)])])


@functools.cache
def spectrum(measured: Measured) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths in nanometres and the values there, as measured; beyond the ends the last value holds.

    Raises:
        InvalidInput: no such material, or it has no such part.
        MissingTool: Mitsuba, whose wheel carries the data, is not installed.
    """
    import numpy as np

    wavelengths_nm, values = (np.array(column, float) for column in measured.table())
    wavelengths_nm.flags.writeable = values.flags.writeable = False
    return wavelengths_nm, values


def read(path: Path) -> Table:
    """The table in a file: lines of a wavelength in nanometres and a value; what follows # is a comment.

    Raises:
        ValueError: it is none; one line that names the file, without its content.
    """
    return of_rows(tables.read(path, "a wavelength in nanometres", "wavelengths"), str(path))


def of_rows(rows: Sequence[Sequence[float]], where: str) -> Table:
    """The table of rows of a wavelength in nanometres and a value.

    Raises:
        ValueError: it is none of visible light; one line that begins with `where`.
    """
    if any(b[0] <= a[0] for a, b in pairwise(rows)):
        raise ValueError(f"{where}: wavelengths must ascend")
    if len(rows) < 2 or rows[-1][0] < VISIBLE_NM[0] or rows[0][0] > VISIBLE_NM[1]:
        raise ValueError(f"{where}: must hold values at two wavelengths or more, in nanometres, of visible light")
    wavelengths_nm, values = zip(*rows)
    return wavelengths_nm, values


@functools.cache
def _by_name(named: Named) -> Table:
    import numpy as np

    name = ALIASES.get(named.name, named.name)
    conductors, dielectrics = names()
    if name in DISPERSIONS and named.part == "eta":
        wavelengths_nm = np.arange(360.0, 831.0, 5.0)
        values = _sellmeier(DISPERSIONS[name], wavelengths_nm * 1e-3)
    elif name in conductors + dielectrics and name not in DISPERSIONS:
        wavelengths_nm, values = np.loadtxt(_folder() / f"{name}.{named.part}.spd", unpack=True)
    else:
        raise InvalidInput(f"there is no spectrum of {named.part} for {named.name!r}")
    return wavelengths_nm.tolist(), values.tolist()


@functools.cache
def rgb(measured: Measured) -> tuple[float, float, float]:
    """The spectrum reduced to linear sRGB: seen by the CIE 1931 observer under D65, so that a flat one stays flat.

    That is `mitsuba.spectrum_list_to_srgb(..., d65=True)`. Mitsuba's own conductor plugins reduce without D65, which
    tints neutral metals; reflectances computed from these values are closer to those of the whole spectrum.

    Raises:
        InvalidInput, MissingTool: as `spectrum`.
    """
    import numpy as np

    wavelengths_nm, weights = srgb_weights()
    red, green, blue = (weights @ np.interp(wavelengths_nm, *spectrum(measured))).tolist()
    return red, green, blue


@functools.cache
def srgb_weights(d65: bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (95,) and the weights (3, 95) that turn a spectrum into linear sRGB; each row sums to 1.

    d65: seen under D65, else under light of equal energy.
    """
    import numpy as np

    with resources.files("velatura.stack").joinpath("cie1931.csv").open(encoding="utf-8") as file:
        wavelengths_nm, x_bar, y_bar, z_bar, illuminant = np.loadtxt(file, delimiter=",").T
    weights = np.array(SRGB_FROM_XYZ) @ np.stack([x_bar, y_bar, z_bar]) * (illuminant if d65 else 1.0)
    return wavelengths_nm, weights / weights.sum(axis=1, keepdims=True)


def srgb_of_samples(wavelengths_nm: NDArray[np.floating]) -> NDArray[np.float64]:
    """The matrix (3, N) from a spectrum's values at wavelengths (N,), ascending, to linear sRGB under D65.

    Between them the spectrum is straight; beyond its ends the last value holds.
    """
    import numpy as np

    at, weights = srgb_weights()
    shares = np.stack([np.interp(at, wavelengths_nm, each) for each in np.eye(len(wavelengths_nm))], axis=1)
    return np.asarray(weights @ shares)


def srgb_sensitivity(wavelengths_nm: NDArray[np.floating]) -> NDArray[np.float64]:
    """Sensitivities (3, N) of linear sRGB under D65 at wavelengths (N,), in proportion; 0 where light is not visible.

    They are those of `srgb_weights`, with straight lines between.
    """
    import numpy as np

    at, weights = srgb_weights()
    return np.stack([np.interp(wavelengths_nm, at, each, 0.0, 0.0) for each in weights])


def luminance_sensitivity(wavelengths_nm: NDArray[np.floating]) -> NDArray[np.float64]:
    """Sensitivity of luminance (1, N), like `srgb_sensitivity`."""
    import numpy as np

    shares: NDArray[np.float64] = np.array([LUMINANCE]) @ srgb_sensitivity(wavelengths_nm)
    return shares


def lab(rgb: NDArray[np.floating]) -> NDArray[np.float64]:
    """L*, a* and b* (..., 3) of linear sRGB (..., 3), white being that of D65 (CIE 1976)."""
    import numpy as np

    xyz_from_rgb = np.linalg.inv(SRGB_FROM_XYZ)
    t = rgb @ xyz_from_rgb.T / xyz_from_rgb.sum(axis=1)
    edge = 6 / 29
    x, y, z = np.moveaxis(np.where(t > edge**3, np.cbrt(t), t / (3 * edge**2) + 4 / 29), -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _sellmeier(dispersion: Dispersion, wavelength_um: NDArray[np.float64]) -> NDArray[np.float64]:
    square = wavelength_um**2
    index: NDArray[np.float64] = (1 + sum(b * square / (square - c) for b, c in dispersion.terms)) ** 0.5
    return index


@functools.cache
def _folder() -> Path:
    # Looks the package up without importing it, and does not ask Mitsuba, which replaces its own module once imported
    found = PathFinder.find_spec("mitsuba")
    for place in (found and found.submodule_search_locations) or ():
        folder = Path(place) / "data" / "ior"
        if folder.is_dir():
            return folder
    raise MissingTool("Mitsuba, whose wheel carries the spectra of materials, is missing: pip install mitsuba")
