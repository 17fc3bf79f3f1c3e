"""Files of reflectance over angles: CSV tables, and the measurements of the MERL and the RGL database.

MERL: Matusik et al. 2003, isotropic, on a grid over half-vector and difference angles. RGL: Dupuy & Jakob 2018, on
adaptive grids, which Mitsuba reads.
"""

from __future__ import annotations

import csv
import io
import struct
from collections.abc import Callable, Mapping, Sequence
from math import prod
from pathlib import Path

import numpy as np

from velatura import files, kernel
from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import AZIMUTHS, Directions, ReflectanceTable
from velatura.inverse.lobes.partial_stack import Array
from velatura.stack.schema import show

IN_PLANE = ("theta_i", "theta_o", "phi", "r", "g", "b")
ALL_AZIMUTHS = ("theta_i", "phi_i", "theta_o", "phi_o", "r", "g", "b")
GRAZING, BRIGHTEST = 90.0, 1e9  # degrees: directions must be above the surface; 1/sr: more than any lobe has
MERL_SCALES = np.array([1.0, 1.15, 1.66]) / 1500  # of red, green and blue
TAKEN = (24, 9, 8)  # of MERL's half-vector tilts, differences and azimuths: enough for a stack's few values
LARGEST, LARGEST_TEXT = 2**27, 2**25  # bytes of a measurement, and of a CSV file
TENSORS = dict(enumerate(("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"), start=1))
ROUND = 1e-3  # share of the brightest value by which a measurement may depend on its azimuth, and be isotropic


def load_table(path: str | Path) -> ReflectanceTable:
    """The table in a file: CSV, or a measurement of the MERL (`.binary`) or RGL (`_rgb.bsdf`) database.

    The first line of a CSV file is `theta_i,theta_o,phi,r,g,b`, phi the azimuth from wi to wo (180: the mirror
    direction), or `theta_i,phi_i,theta_o,phi_o,r,g,b` for a brushed sample. Angles in degrees, theta in 0 to 90
    (excluded); r, g, b the BRDF in 1/sr, without the cosine, negative where noise makes it so.

    Of a measurement of either database a few thousand directions are taken.

    Raises:
        InvalidInput: no such file, or its content is none of that; one line that names the file and the place in it.
        MissingTool: an RGL file, and there is no Mitsuba, or no LLVM for it.
    """
    path = Path(path)
    return READERS.get(path.suffix.lower(), _csv)(path)


# CSV -----------------------------------------------------------------------------------------------------------------


def _csv(path: Path) -> ReflectanceTable:
    text = files.text_of(path, LARGEST_TEXT)
    with files.budget() as left:
        left.spend(path, "values", text.count(",") + text.count("\n"))
    try:
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise InvalidInput(f"{path}: cannot be read: {error}") from None
    columns = tuple(cell.strip() for cell in lines[0]) if lines else ()
    if columns not in (IN_PLANE, ALL_AZIMUTHS):
        raise InvalidInput(f"{path}: line 1: must be {','.join(IN_PLANE)} or {','.join(ALL_AZIMUTHS)}")
    rows = [_row(f"{path}: line {n}", line, columns) for n, line in enumerate(lines[1:], 2) if line]
    if not rows:
        raise InvalidInput(f"{path}: holds no directions")
    column = dict(zip(columns, np.array(rows).T))
    azimuth = column.get("phi_i", 0.0)
    phi = column["phi"] if columns == IN_PLANE else column["phi_o"] - azimuth
    directions = Directions.of(column["theta_i"], column["theta_o"], phi, azimuth)
    return ReflectanceTable(directions, np.array([column[name] for name in "rgb"]))


def _row(where: str, line: Sequence[str], columns: Sequence[str]) -> list[float]:
    """The numbers of a line."""
    if len(line) != len(columns):
        raise InvalidInput(f"{where}: must hold {len(columns)} numbers, {','.join(columns)}, got {len(line)}")
    numbers: Mapping[str, float] = {name: _number(f"{where}: {name}", cell) for name, cell in zip(columns, line)}
    for name, number in numbers.items():
        if name.startswith("theta") and not 0 <= number < GRAZING:
            raise InvalidInput(f"{where}: {name}: must lie in 0 to 90 (excluded) degrees, got {number:g}")
        if name.startswith("phi") and not -360 <= number <= 360:
            raise InvalidInput(f"{where}: {name}: must lie in -360 to 360 degrees, got {number:g}")
        if name in "rgb" and not abs(number) <= BRIGHTEST:
            raise InvalidInput(f"{where}: {name}: must lie in -{BRIGHTEST:g} to {BRIGHTEST:g}, got {number:g}")
    return list(numbers.values())


def _number(where: str, text: str) -> float:
    try:
        found = files.number(text)
    except ValueError:
        found = float("nan")
    if not np.isfinite(found):
        raise InvalidInput(f"{where}: must be a finite number, got {show(text.strip())}")
    return found


# Measurements --------------------------------------------------------------------------------------------------------


def _merl(path: Path) -> ReflectanceTable:
    """A file of three numbers of steps, then all of red, of green and of blue, the azimuth running first."""
    content = files.content(path, LARGEST)
    counts = [int(n) for n in np.frombuffer(content[: len(content) // 4 * 4][:12], "<i4")]
    if len(counts) < 3 or min(counts) < 1 or len(content) != 12 + 24 * prod(counts):
        raise InvalidInput(f"{path}: is no MERL file, three counts and then as many numbers for each colour")
    value = np.frombuffer(content[12:], "<f8").reshape(3, *counts) * MERL_SCALES[:, None, None, None]
    if not np.isfinite(value).all():
        raise InvalidInput(f"{path}: holds values that are no finite numbers")

    # Take some of the bins, at their centres; tilts of half-vectors are close where lobes are sharp
    some = [np.unique(np.linspace(0, n - 1, min(n, most)).astype(int)) for n, most in zip(counts, TAKEN)]
    shares = ((n + 0.5) / count for n, count in zip(some, counts))
    tilt, apart, turn = (x.ravel() for x in np.meshgrid(*shares, indexing="ij"))
    directions = Directions.about_halves(90 * tilt**2, 90 * apart, 180 * turn)
    found = value[:, some[0][:, None, None], some[1][:, None], some[2]].reshape(3, -1)
    seen = directions.above & (found.min(axis=0) >= 0)  # a bin that was not measured holds negative values
    if not seen.any():
        raise InvalidInput(f"{path}: holds no directions")
    return ReflectanceTable(directions.take(seen), found[:, seen])


def _rgl(path: Path) -> ReflectanceTable:
    """Values at the directions where stacks are compared, of one azimuth unless the sample is brushed."""
    mi = kernel.mitsuba()
    if not mi.is_rgb or mi.variant().startswith("scalar"):
        raise InvalidInput(f"{path}: is read in a vectorised RGB variant, llvm_ad_rgb for one, not in {mi.variant()}")
    _check_tensors(path, files.content(path, LARGEST))

    def at(directions: Directions) -> Array:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(directions.wi)
        return np.array(measured.eval(mi.BSDFContext(), si, mi.Vector3f(directions.wo))) / directions.wo[2]

    plain, all_round = (Directions.about_lobes(turned) for turned in (False, True))
    try:
        with kernel.exclusive:
            measured = mi.load_dict({"type": "measured", "filename": str(path)})
            each, found = [at(plain.turned(azimuth)) for azimuth in AZIMUTHS], at(all_round)
    except RuntimeError as error:
        raise InvalidInput(f"{path}: is no RGB file of the RGL database: {kernel.reason(error)}") from None
    if not np.isfinite(found).all():
        raise InvalidInput(f"{path}: holds values that are no finite numbers")
    brushed = np.ptp(each, axis=0).max() > ROUND * np.max(each)
    return ReflectanceTable(all_round, found) if brushed else ReflectanceTable(plain, each[0])


def _check_tensors(path: Path, content: bytes) -> None:
    """Refuse a file of tensors that Mitsuba would read beyond its end or with memory unset, or whose nodes are none.

    Raises:
        InvalidInput: a head that ends early, numbers outside the file or not finite, grids without an inside, an
            isotropic sample that depends on its azimuth.
    """
    arrays: dict[bytes, Array] = {}
    try:
        (count,), at = struct.unpack_from("<I", content, 14), 18
        for _ in range(count):
            (length,) = struct.unpack_from("<H", content, at)
            name, at = content[at + 2 : at + 2 + length], at + 2 + length
            dimensions, kind, begin = struct.unpack_from("<HBQ", content, at)
            shape = struct.unpack_from(f"<{dimensions}Q", content, at + 11)
            at += 11 + 8 * dimensions
            arrays[name] = np.frombuffer(content, TENSORS[kind], prod(shape), begin).reshape(shape)
        usable = all(
            each.size and (each.dtype.kind != "f" or bool(np.isfinite(each).all())) and (each.ndim < 2 or _inside(each))
            for each in arrays.values()
        ) and all((np.diff(arrays[name]) > 0).all() for name in (b"theta_i", b"phi_i"))
    except (struct.error, KeyError, OverflowError, ValueError) as error:
        raise InvalidInput(f"{path}: is no RGB file of the RGL database: its head is broken ({error})") from None
    if not usable:
        raise InvalidInput(f"{path}: holds values that are no finite numbers, or no grids of them")
    # Mitsuba takes up to two azimuths for an isotropic sample, and then mirrors directions or not by a number not set
    if len(arrays[b"phi_i"]) == 2:
        for name in (b"vndf", b"luminance", b"rgb"):
            if name in arrays and np.ptp(arrays[name], axis=0).any():
                rule = "must be equal at two azimuths, which are an isotropic sample's"
                raise InvalidInput(f"{path}: {name.decode()}: {rule}, or hold more")


def _inside(grid: Array) -> bool:
    return min(grid.shape[-2:]) > 1


#: By the end of the name; all other files are CSV.
READERS: dict[str, Callable[[Path], ReflectanceTable]] = {".binary": _merl, ".bsdf": _rgl}
