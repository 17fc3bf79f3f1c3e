"""The lights of the stage: a studio of softboxes, a clear sky, a furnace, photographs, or an image file."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.errors import InvalidInput

#: Photographs of light, which come with the editor's page, by name.
PHOTOGRAPHS = {path.stem: path for path in sorted(Path(__file__).parents[1].glob("editor/static/environments/*.exr"))}

#: What `env` may name, besides an .exr or .hdr file.
ENVIRONMENTS = ("studio", "sky", "furnace", *PHOTOGRAPHS)

SUN = (-0.55, 0.62, 0.55)  # where it stands in the sky
NEAR_SUN = 1.2  # degrees from its centre, whose texels are averages over a grid of FINER ones
FINER = 64

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


def emitter(mi: Any, env: str | os.PathLike[str] | NDArray[np.float32], rotation: float = 0.0) -> dict[str, Any]:
    """The Mitsuba emitter of an environment, or of an equirectangular picture, y up, turned about y by degrees.

    Raises:
        InvalidInput: an unknown name or an unreadable file.
    """
    turned = mi.ScalarTransform4f().rotate([0, 1, 0], rotation)
    if isinstance(env, np.ndarray):
        return {"type": "envmap", "bitmap": mi.Bitmap(env), "to_world": turned}
    if env == "furnace":
        return {"type": "constant", "radiance": 1.0}
    if env == "sky":
        # Mitsuba's sky has z up and W/(m2 sr nm) for a unit; the scale brings it to the studio's exposure
        sky: dict[str, Any] = {"type": "sunsky", "turbidity": 5.0, "sun_scale": 2.5, "sky_scale": 2.5}
        return sky | {"sun_direction": turned @ mi.ScalarVector3f(SUN), "to_world": turned.rotate([1, 0, 0], -90)}
    return {"type": "envmap", "bitmap": _picture(mi, env), "to_world": turned}


def _picture(mi: Any, env: str | os.PathLike[str]) -> Any:
    if env == "studio":
        return mi.Bitmap(studio())
    if env in PHOTOGRAPHS:
        # They were made smaller with a filter that overshoots below 0
        return mi.Bitmap(np.maximum(_rgb(mi, PHOTOGRAPHS[str(env)]), 0.0))
    return _read(mi, Path(str(env)))


def _read(mi: Any, path: Path) -> Any:
    if path.suffix.lower() not in (".exr", ".hdr"):
        raise InvalidInput(f"unknown environment {str(path)!r}: give {', '.join(ENVIRONMENTS)}, or a file .exr or .hdr")
    if not os.path.isfile(path):
        raise InvalidInput(f"{path}: no such environment file")
    texels = _rgb(mi, path)
    if not np.all((texels >= 0) & (texels <= BRIGHTEST)):
        raise InvalidInput(f"{path}: has texels that are negative, not finite, or above {BRIGHTEST:g}")
    return mi.Bitmap(texels)


def _rgb(mi: Any, path: Path) -> NDArray[np.float32]:
    """The texels of a file, linear RGB."""
    picture = kernel.bitmap(path)
    try:
        if picture.channel_count() > 4:
            raise InvalidInput(f"{path}: has {picture.channel_count()} channels; a light has one or three, and opacity")
        return np.array(picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False))
    except (RuntimeError, MemoryError) as error:
        raise InvalidInput(f"{path}: {' '.join(str(error).split())}") from error


@functools.cache
def studio(width: int = 256) -> NDArray[np.float32]:
    """The studio as an equirectangular picture (width / 2, width, 3): softboxes over a dark grey gradient."""
    look = _directions(width)
    radiance = 0.03 + 0.085 * (1.0 + look[..., 1])
    for box in SOFTBOXES:
        radiance += box.radiance * _shape(box, look)
    return np.repeat(radiance[..., None], 3, axis=-1).astype(np.float32)


@functools.cache
def sky(width: int = 512) -> NDArray[np.float32]:
    """The sky as an equirectangular picture (width / 2, width, 3); those near the sun are averages."""
    mi = kernel.mitsuba()
    described = {"type": "scene", "light": emitter(mi, "sky"), "object": {"type": "sphere"}}
    light = mi.load_dict(described).emitters()[0]

    def radiance(look: NDArray[np.float64]) -> NDArray[np.float32]:
        hit = mi.SurfaceInteraction3f()
        hit.wi = mi.Vector3f(-look.reshape(-1, 3).T)
        return np.array(light.eval(hit)).T.reshape(look.shape)

    look = _directions(width)
    found = radiance(look)
    sun = look @ np.array(SUN) / np.linalg.norm(SUN)
    for row, column in np.argwhere(sun > np.cos(np.radians(NEAR_SUN))):
        found[row, column] = radiance(_directions(width, row, column, FINER)).mean(axis=(0, 1))
    return found


def _directions(width: int, row: int = 0, column: int = 0, finer: int = 0) -> NDArray[np.float64]:
    """Directions of all texels (width / 2, width, 3), or within one of them (finer, finer, 3).

    In Mitsuba +y is at the top, +z in the middle, and +x to the left of it.
    """
    count = (finer, finer) if finer else (width // 2, width)
    rows, columns = np.meshgrid(*(np.arange(n) + 0.5 for n in count), indexing="ij")
    if finer:
        rows, columns = row + rows / finer, column + columns / finer
    theta, phi = np.pi * rows / (width // 2), 2.0 * np.pi * columns / width
    return np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], axis=-1)


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
