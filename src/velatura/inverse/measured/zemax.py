"""Tabular BSDF files of Zemax OpticStudio: values about the mirror direction, for angles of incidence and rotations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np

from velatura.errors import InvalidInput
from velatura.inverse.fitting.angles import Directions, ReflectanceTable, evenly
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.measured import rows
from velatura.stack import spectra
from velatura.stack.schema import show

AXES = {"SampleRotation": 360.0, "AngleOfIncidence": 90.0, "ScatterAzimuth": 360.0, "ScatterRadial": 180.0}  # degrees
TAKEN = (4, 8, 9, 24)  # of these, enough for a stack's few values
WORDS = {
    "Source": ("Measured",),
    "Symmetry": ("PlaneSymmetrical", "Asymmetrical", "ASymmetrical", "Asymmetrical4D", "ASymmetrical4D"),
    "SpectralContent": ("Monochrome", "XYZ"),
    "ScatterType": ("BRDF",),
}
BLOCKS = {"Monochrome": ("Monochrome",), "XYZ": ("TristimulusX", "TristimulusY", "TristimulusZ")}


@dataclass
class _Words:
    """The words of a file, in turn, each with the number of its line; lines that begin with # are comments."""

    path: Path
    rest: Iterator[tuple[int, str]]

    @classmethod
    def of(cls, path: Path) -> _Words:
        lines = enumerate(rows.text_of(path).splitlines(), 1)
        return cls(path, ((n, word) for n, line in lines if not line.startswith("#") for word in line.split()))

    def next(self, expected: str) -> tuple[str, str]:
        """Where the next word stands, and the word. Raises InvalidInput at the end of the file."""
        found = next(self.rest, None)
        if found is None:
            raise InvalidInput(f"{self.path}: ends before {expected}")
        return f"{self.path}: line {found[0]}", found[1]

    def must_be(self, *allowed: str) -> str:
        """Next word, one of those. Raises InvalidInput otherwise."""
        where, word = self.next(allowed[0])
        if word not in allowed:
            raise InvalidInput(f"{where}: must be {' or '.join(allowed)}, got {show(word)}")
        return word

    def numbers(self, count: int, what: str, least: float, most: float) -> Array:
        """Numbers, as many as that, each in a range. Raises InvalidInput otherwise."""
        found = []
        for _ in range(count):
            where, word = self.next(what)
            value = rows.number(f"{where}: {what}", word)
            if not least <= value <= most:
                raise InvalidInput(f"{where}: {what}: must lie in {least:g} to {most:g}, got {value:g}")
            found.append(value)
        return np.array(found)


def read(path: Path) -> ReflectanceTable:
    """Colours of some of the directions; what is tabulated below the surface is left out.

    At rotation 0 the plane of incidence holds the sample's y axis. XYZ becomes linear sRGB.

    Raises:
        InvalidInput: it is none, or of light that passes (BTDF); one line that names the file and the line in it.
    """
    words = _Words.of(path)
    head = {key: _value(words, key, allowed) for key, allowed in WORDS.items()}
    axes = [_axis(words, key, most) for key, most in AXES.items()]
    shape = tuple(map(len, axes))
    blocks = [_block(words, name, shape) for name in BLOCKS[head["SpectralContent"]]]
    value = np.stack(blocks * 3 if len(blocks) == 1 else blocks)
    if len(blocks) == 3:
        value = np.tensordot(np.array(spectra.SRGB_FROM_XYZ), value, 1)

    some = [evenly(n, most) for n, most in zip(shape, TAKEN)]
    rotation, theta_i, azimuth, radial = (
        x.ravel() for x in np.meshgrid(*(axis[n] for axis, n in zip(axes, some)), indexing="ij")
    )
    directions = _about_mirror(theta_i, azimuth, radial).turned(90 + rotation)
    value = value[np.ix_(np.arange(3), *some)].reshape(3, -1)
    if not directions.above.any():
        raise InvalidInput(f"{path}: holds no directions above the surface")
    return ReflectanceTable(directions.take(directions.above), value[:, directions.above])


def _value(words: _Words, key: str, allowed: tuple[str, ...]) -> str:
    words.must_be(key)
    return words.must_be(*allowed)


def _axis(words: _Words, key: str, most: float) -> Array:
    words.must_be(key)
    (count,) = words.numbers(1, f"number of {key}", 1, 10_000)
    return words.numbers(int(count), key, 0, most)


def _block(words: _Words, name: str, shape: tuple[int, ...]) -> Array:
    """The values of one spectral content, over the axes; before those of an angle of incidence stands its total."""
    words.must_be(name)
    words.must_be("DataBegin")
    found = []
    for _ in range(prod(shape[:2])):
        words.must_be("TIS")
        words.numbers(1, "TIS", 0, rows.BRIGHTEST)
        found.append(words.numbers(prod(shape[2:]), "value", -rows.BRIGHTEST, rows.BRIGHTEST))
    words.must_be("DataEnd")
    return np.reshape(found, shape)


def _about_mirror(theta_i: Array, azimuth: Array, radial: Array) -> Directions:
    """Directions at an angle from the mirror direction, and at an azimuth about it, 0 towards the normal."""
    t, a, r = map(np.radians, (theta_i, azimuth, radial))
    zero = np.zeros_like(t)
    mirror, towards = np.array([-np.sin(t), zero, np.cos(t)]), np.array([np.cos(t), zero, np.sin(t)])
    aside = np.array([zero, zero + 1, zero])
    wo = np.cos(r) * mirror + np.sin(r) * (np.cos(a) * towards + np.sin(a) * aside)
    return Directions(np.array([np.sin(t), zero, np.cos(t)]), wo, theta_i)
