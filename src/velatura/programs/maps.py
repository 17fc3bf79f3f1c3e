"""A textured material's parameters texel by texel: fits of a few of its stacks, interpolation, and the images."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import pictures
from velatura.errors import InvalidInput
from velatura.programs.parameters import Input
from velatura.programs.program import Carried, Fitted, Program
from velatura.programs.textures import Means, within
from velatura.programs.values import Array, linear, rounded
from velatura.stack import Described, Texture
from velatura.stack.paths import hold
from velatura.stack.schema import show

LARGEST = 4096  # texels of an image across
NODES, AT_ONCE = 64, 8  # stacks that are fitted, at most and between two looks at what the last ones changed
NEAR = 0.01  # of a parameter's greatest value, to which interpolation has to predict fits in the mean
LEVELS = 255  # steps of a number, in images and between values that count as different
SAME = 0.5 / LEVELS  # of the greatest value, by which a parameter may vary without an image


def checked(size: object) -> int:
    """The greatest size of images. Raises InvalidInput if it is none."""
    if type(size) is not int or not 1 <= size <= LARGEST:
        raise InvalidInput(f"maps: must be a whole number of texels, 1 to {LARGEST}, got {show(size)}")
    return size


@dataclass(frozen=True)
class Grid:
    """The values of a material's textures over a surface.

    shape: height and width. channels: numbers of each value, by flat name. values: distinct rows of numbers (N, D);
    which: the row of each texel (height * width,).
    """

    shape: tuple[int, int]
    channels: dict[str, int]
    values: Array
    which: NDArray[np.intp]

    @classmethod
    def of(cls, material: Described, largest: int) -> Grid | None:
        """The values on a grid as fine as the finest image, at most `largest` texels across; None without textures.

        Values that differ by less than a 255th of their range are one.

        Raises:
            InvalidInput: an image that cannot be read. MissingTool: LLVM is missing or too old.
        """
        images = {at.name: within(at, value) for at, value in material.values() if isinstance(value, Texture)}
        if not images:
            return None
        sizes = np.array([image.shape[:2] for image in images.values()])
        height, width = np.minimum(sizes.max(axis=0), largest).tolist()
        rows = np.concatenate([_resampled(image, height, width) for image in images.values()], axis=-1)
        rows = rows.reshape(height * width, -1)
        low, span = rows.min(axis=0), np.maximum(np.ptp(rows, axis=0), 1e-12)
        which, first = np.zeros(len(rows), np.intp), np.zeros(1, np.intp)
        for column, least, wide in zip(rows.T, low, span):
            steps = np.rint((column - least) / wide * LEVELS).astype(np.intp)
            _, first, which = np.unique(which * (LEVELS + 1) + steps, return_index=True, return_inverse=True)
        return cls((height, width), {name: image.shape[-1] for name, image in images.items()}, rows[first], which)

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Texels of each row."""
        return np.bincount(self.which, minlength=len(self.values))

    @cached_property
    def placed(self) -> Array:
        """The rows, with each of their numbers from 0 to 1."""
        low = self.values.min(axis=0)
        return (self.values - low) / np.maximum(np.ptp(self.values, axis=0), 1e-12)

    def at(self, row: int) -> Means:
        """The values of a row, by flat name."""
        ends = np.cumsum(list(self.channels.values()))[:-1]
        parts = [tuple(part.tolist()) for part in np.split(self.values[row], ends)]
        return {name: part[0] if len(part) == 1 else part for name, part in zip(self.channels, parts)}

    def spread(self) -> Iterator[int]:
        """All rows, each as far as can be from those before it (Gonzalez 1985), from the one nearest to the mean."""
        mean = np.average(self.placed, axis=0, weights=self.counts)
        row = int(np.argmin(np.sum((self.placed - mean) ** 2, axis=1)))
        apart = np.full(len(self.placed), np.inf)
        for _ in range(len(self.placed)):
            yield row
            apart = np.minimum(apart, np.sum((self.placed - self.placed[row]) ** 2, axis=1))
            row = int(np.argmax(apart))

    def shares(self, nodes: Sequence[int]) -> Array:
        """Shares of the surface that are nearest to each of some rows."""
        apart = [np.sum((self.placed - self.placed[node]) ** 2, axis=1) for node in nodes]
        return np.bincount(np.argmin(apart, axis=0), self.counts, len(nodes)) / len(self.which)


def _resampled(image: Array, height: int, width: int) -> Array:
    """An image of another size, which repeats: means of its texels where it becomes smaller, else between them."""
    from scipy.ndimage import map_coordinates

    if image.shape[:2] == (height, width):
        return image
    fine = [-(-old // new) for old, new in zip(image.shape, (height, width))]
    at = [(np.arange(new * k) + 0.5) / (new * k) * old - 0.5 for old, new, k in zip(image.shape, (height, width), fine)]
    where = np.meshgrid(*at, indexing="ij")
    channels = [map_coordinates(channel, where, order=1, mode="grid-wrap") for channel in np.moveaxis(image, -1, 0)]
    blocks = np.reshape(channels, (len(channels), height, fine[0], width, fine[1]))
    return np.moveaxis(blocks.mean(axis=(2, 4)), 0, -1)


# Parameters ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mapped:
    """Parameters over a surface: a program's, with those rows of a grid that were fitted, their values, and the error
    of interpolation at the last of them, as a share of a parameter's greatest value, root mean square."""

    parameters: tuple[Input, ...]
    grid: Grid
    nodes: list[int]
    fitted: list[Fitted]
    missed: float

    @cached_property
    def columns(self) -> dict[str, Array]:
        """Numbers of each parameter for all rows of the grid (rows, 1 or 3), within its range."""
        found = _interpolated(self.grid.placed[self.nodes], _numbers(self.parameters, self.fitted), self.grid.placed)
        ends = np.cumsum([3 if each.is_colour else 1 for each in self.parameters])[:-1]
        parts = np.split(found, ends, axis=1)
        return {each.name: np.clip(part, each.low, each.high) for each, part in zip(self.parameters, parts)}

    @cached_property
    def varying(self) -> list[str]:
        """Parameters that need an image."""
        return [name for name, x in self.columns.items() if np.ptp(x, axis=0).max() > SAME * max(x.max(), SAME)]

    def means(self) -> Fitted:
        """Means of all parameters over the surface."""
        means = {name: np.average(x, axis=0, weights=self.grid.counts) for name, x in self.columns.items()}
        return {name: _value([rounded(number) for number in x.tolist()]) for name, x in means.items()}

    def images(self, program: Program, name: str) -> dict[str, Carried]:
        """Images of 8 bits for what varies, by parameter, in files of this process; colours are in sRGB.

        Channels of an image in which nothing varies are 1, so that the parameter stays a factor.
        """
        texels: dict[str, NDArray[np.uint8]] = {}
        factors: dict[str, float] = {}
        for each in self.varying:
            image, channel = program.maps[each]
            values = self.columns[each]
            factors[each] = rounded(max(float(values.max()), 1.0))
            numbers = _in_srgb(values) if channel == "rgb" else np.rint(values / factors[each] * LEVELS)
            into = texels.setdefault(image, np.full((len(self.grid.which), 4), LEVELS, np.uint8))
            into[:, ["rgba".index(letter) for letter in channel]] = numbers[self.grid.which]
        files = {}
        for image, pixels in texels.items():
            used = {program.maps[each][1] for each in self.varying if program.maps[each][0] == image}
            count = 4 if "a" in used else 1 if used == {"r"} else 3
            data = pictures.png(pixels[:, :count].reshape(*self.grid.shape, count))
            files[image] = hold(data, f"{name[:20]}-{image}", ".png")
        found = {}
        for each in self.varying:
            image, channel = program.maps[each]
            texture = Texture(texture=files[image], channel=channel, encoding="srgb" if channel == "rgb" else "linear")
            found[each] = Carried(texture, (1.0, 1.0, 1.0) if channel == "rgb" else factors[each])
        return found


def mapped(
    grid: Grid, parameters: tuple[Input, ...], fit: Callable[[Means], Fitted], progress: Callable[[int, int], None]
) -> Mapped:
    """Parameters over a surface, by fits of stacks that lie as far apart as can be, until the last of these were
    predicted by the others, or there are no more, or `NODES`."""
    nodes: list[int] = []
    fitted: list[Fitted] = []
    most, missed = min(NODES, len(grid.values)), 0.0
    for row in grid.spread():
        progress(len(nodes), most)
        nodes.append(row)
        fitted.append(fit(grid.at(row)))
        if len(nodes) > AT_ONCE and (len(nodes) % AT_ONCE == 0 or len(nodes) == most):
            known = len(nodes) - AT_ONCE
            numbers = _numbers(parameters, fitted)
            found = _interpolated(grid.placed[nodes[:known]], numbers[:known], grid.placed[nodes[known:]])
            apart = (found - numbers[known:]) / np.maximum(np.abs(numbers).max(axis=0), NEAR)
            missed = float(np.sqrt(np.mean(apart**2)))
            if missed < NEAR:
                break
        if len(nodes) == most:
            break
    progress(most, most)
    return Mapped(parameters, grid, nodes, fitted, missed if len(nodes) < len(grid.values) else 0.0)


def _numbers(parameters: tuple[Input, ...], values: Sequence[Mapping[str, Any]]) -> Array:
    """Numbers (values, numbers) of all parameters."""
    return np.array([np.concatenate([np.ravel(each[p.name]) for p in parameters]) for each in values], float)


def _interpolated(at: Array, numbers: Array, wanted: Array) -> Array:
    """Numbers between those at some points: piecewise linear on a line, biharmonic in space."""
    from scipy.interpolate import RBFInterpolator

    if len(at) == 1:
        return np.repeat(numbers, len(wanted), axis=0)
    return np.asarray(RBFInterpolator(at, numbers, kernel="linear", degree=0)(wanted))


def _value(numbers: list[float]) -> Any:
    return tuple(numbers) if len(numbers) > 1 else numbers[0]


def _in_srgb(values: Array) -> NDArray[np.intp]:
    """The levels that are nearest to linear numbers."""
    return np.searchsorted(linear((np.arange(LEVELS) + 0.5) / LEVELS), values)
