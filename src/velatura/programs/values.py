"""Values of parameters: numbers, colours, and images, which functions change by their curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from velatura import files
from velatura.stack import RGB, Texture

Array: TypeAlias = NDArray[np.float64]
Value: TypeAlias = float | RGB | Texture

_NODES = 65  # of curves


def listed(text: str, between: str = ",") -> list[float]:
    """The numbers in a text; none where something else is among them."""
    try:
        return [files.number(part) for part in text.split(between)]
    except ValueError:
        return []


def changed(value: Value, function: Callable[[Array], Any]) -> Value:
    """The value that a function of single numbers gives; of an image, one with a curve, or a number if it is level.

    Raises:
        InvalidInput: the numbers of the curve are beyond what textures take.
    """
    if isinstance(value, Texture):
        with np.errstate(all="ignore"):  # numbers that are not finite are refused
            return _with_curve(value, np.broadcast_to(np.asarray(function(_at_nodes(value)), float), _NODES))
    found = np.broadcast_to(np.asarray(function(np.asarray(value, float)), float), np.shape(value))
    return tuple(map(rounded, found.tolist())) if found.ndim else rounded(float(found))  # type: ignore[return-value]


def rounded(number: float) -> float:
    """A number with six digits, as files show it."""
    return float(f"{number:.6g}")


def colour(value: float | RGB) -> RGB:
    """A number or colour as a colour."""
    red, green, blue = np.broadcast_to(np.asarray(value, float), 3).tolist()
    return rounded(red), rounded(green), rounded(blue)


def linear(encoded: Array) -> Array:
    """Numbers that are encoded in sRGB, in linear sRGB (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4)


def middle(value: Value) -> float:
    """One number for a value: the mean of its colours; of an image, the middle of what it may hold."""
    if isinstance(value, Texture):
        return float(np.interp(0.5, np.linspace(0, 1, _NODES), _at_nodes(value)))
    return float(np.mean(value))


def texels(texture: Texture, is_colour: bool = False, name: str = "") -> Array:
    """The values (height, width, channels) of an image, of three channels or one; `name` is that of the value.

    Raises:
        InvalidInput: it cannot be read. MissingTool: LLVM is missing or too old.
    """
    from velatura import kernel
    from velatura.binding.textures import texels as texels_of_file

    found = texels_of_file(kernel.mitsuba(), name or texture.texture.name, texture, is_colour)
    return np.asarray(texture.scale * found.astype(float) + texture.offset)


def _at_nodes(texture: Texture) -> Array:
    nodes = np.linspace(0, 1, _NODES)
    curve = nodes if texture.curve is None else np.interp(nodes, np.linspace(0, 1, len(texture.curve)), texture.curve)
    return np.asarray(texture.scale * curve + texture.offset)


def _with_curve(texture: Texture, values: Array) -> Value:
    first, last = values[0], values[-1]
    if np.ptp(values) == 0:
        return rounded(float(first))
    if np.allclose(values, np.linspace(first, last, _NODES), atol=1e-9):
        line: dict[str, Any] = {"scale": float(last - first), "offset": float(first), "curve": None}
    else:
        line = {"scale": 1.0, "offset": 0.0, "curve": tuple(map(rounded, values.tolist()))}
    return Texture(**{**dict(texture), **line})
