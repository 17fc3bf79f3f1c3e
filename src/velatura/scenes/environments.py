"""The lights of the stage: a studio of softboxes, a clear sky, a furnace, or an image file."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura.errors import InvalidInput

#: What `env` may name, besides an .exr or .hdr file.
ENVIRONMENTS = ("studio", "sky", "furnace")

#: The largest radiance of a texel, so that what many of them send together is still a number.
BRIGHTEST = 1e12


class Softbox(NamedTuple):
    """A rectangular light that faces the origin: its centre, its size (degrees across and up) and its radiance."""

    centre: tuple[float, float, float]
    width: float
    height: float
    radiance: float


SOFTBOXES = (
    Softbox((-1.0, 0.75, 0.75), 44.0, 44.0, 4.5),  # the key, upper left and in front
    Softbox((0.2, 1.0, 0.1), 26.0, 84.0, 4.0),  # a strip overhead, from front to back
    Softbox((1.0, 0.3, -0.25), 26.0, 84.0, 5.5),  # two upright strips at the sides, for the rims
    Softbox((-1.0, 0.2, -0.8), 16.0, 84.0, 5.5),
    Softbox((0.9, -0.05, 1.1), 20.0, 70.0, 1.0),  # a weak fill in front
)


def emitter(mi: Any, env: str | os.PathLike[str]) -> dict[str, Any]:
    """The Mitsuba emitter of an environment, y up. Raises InvalidInput for an unknown name or an unreadable file."""
    if env == "studio":
        return {"type": "envmap", "bitmap": mi.Bitmap(studio())}
    if env == "furnace":
        return {"type": "constant", "radiance": 1.0}
    if env == "sky":
        # Mitsuba's sky has z up and W/(m2 sr nm) for a unit; the scale brings it to the studio's exposure
        sky: dict[str, Any] = {"type": "sunsky", "turbidity": 5.0, "sun_scale": 2.5, "sky_scale": 2.5}
        return sky | {"sun_direction": [-0.55, 0.62, 0.55], "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90)}
    return {"type": "envmap", "bitmap": _read(mi, Path(env))}


def _read(mi: Any, path: Path) -> Any:
    if path.suffix.lower() not in (".exr", ".hdr"):
        raise InvalidInput(f"unknown environment {str(path)!r}: give {', '.join(ENVIRONMENTS)}, or a file .exr or .hdr")
    if not os.path.isfile(path):
        raise InvalidInput(f"{path}: no such environment file")
    try:
        picture = mi.Bitmap(str(path))
        if picture.channel_count() > 4:
            raise InvalidInput(f"{path}: has {picture.channel_count()} channels; a light has one or three, and opacity")
        light = picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    except (RuntimeError, MemoryError) as error:
        raise InvalidInput(f"{path}: {' '.join(str(error).split())}") from error
    texels = np.array(light)
    if not texels.size:
        raise InvalidInput(f"{path}: has no texels")
    if not np.all((texels >= 0) & (texels <= BRIGHTEST)):
        raise InvalidInput(f"{path}: has texels that are negative, not finite, or above {BRIGHTEST:g}")
    return light


@functools.cache
def studio(width: int = 256) -> NDArray[np.float32]:
    """The studio as an equirectangular picture (width / 2, width, 3): softboxes over a dark grey gradient."""
    # Find every pixel's direction: in Mitsuba +y is at the top, +z in the middle, and +x to the left of it
    rows, columns = np.meshgrid(np.arange(width // 2) + 0.5, np.arange(width) + 0.5, indexing="ij")
    theta, phi = np.pi * rows / (width // 2), 2.0 * np.pi * columns / width
    look = np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], axis=-1)

    radiance = 0.03 + 0.085 * (1.0 + look[..., 1])
    for box in SOFTBOXES:
        radiance += box.radiance * _shape(box, look)
    return np.repeat(radiance[..., None], 3, axis=-1).astype(np.float32)


def _shape(box: Softbox, look: NDArray[np.float64], feather: float = 0.12) -> NDArray[np.float64]:
    """1 inside a softbox, 0 outside, with a soft border."""
    # Span the rectangle's plane at distance 1
    normal = np.asarray(box.centre) / np.linalg.norm(box.centre)
    right = np.cross((0.0, 1.0, 0.0), normal)
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)

    # Measure how far inside of its edges a direction crosses it
    ahead = look @ normal
    across, along = (look @ axis / np.maximum(ahead, 1e-6) for axis in (right, up))
    half_width, half_height = np.tan(np.radians([box.width / 2.0, box.height / 2.0]))
    inside = np.minimum(half_width - np.abs(across), half_height - np.abs(along)) / feather
    return np.where(ahead > 0.0, np.clip(inside, 0.0, 1.0), 0.0)
