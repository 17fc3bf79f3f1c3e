"""Pictures of scenes, and their files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura import files, kernel
from velatura.errors import InvalidInput, whole_number
from velatura.scenes.stage import Name, Size, blamed, scene_dict
from velatura.scenes.views import DEFAULT_VIEW, VIEWS

#: Samples (pixels x spp) of one pass: between two of them progress is reported and an interrupt is handled.
PASS_SAMPLES = 2**20


@kernel.exclusive
def render(
    bsdf: Any,
    scene: Name = "ball",
    env: Name | None = None,
    spp: int = 64,
    size: Size | None = None,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    zoom: float = 1.0,
) -> NDArray[np.float32]:
    """Render a material: linear RGB, float32, of shape (height, width, 3).

    Args:
        bsdf, scene, env, size, zoom: as for `scene_dict`.
        spp: samples per pixel.
        seed: the same seed gives the same picture, except for rounding.
        progress: called after every pass with (samples per pixel done, spp).

    Raises:
        InvalidInput, MissingTool: as `scene_dict`; also for spp < 1, or a seed that is no whole number.
        KeyboardInterrupt: on Ctrl-C, between two passes or within one.
    """
    spp, seed = whole_number("spp", spp, 1), whole_number("seed", seed)
    mi = kernel.mitsuba()
    described = scene_dict(scene, env, bsdf, size, zoom)  # kept to the end, as it owns the parts of a scene file
    with blamed(scene):
        loaded = mi.load_dict(described)
    kernel.limit_threads()
    passes = _passes(spp, int(np.prod(loaded.sensors()[0].film().size())))
    seeds = np.random.SeedSequence(seed).generate_state(len(passes))

    total, done = np.zeros(1, np.float32), 0
    for samples, pass_seed in zip(passes, seeds):
        with blamed(scene):
            total = total + np.float32(samples) * _rendered(mi, loaded, samples, int(pass_seed))
        done += samples
        if progress:
            progress(done, spp)
    return _rgb(total / np.float32(spp))


def _rendered(mi: Any, scene: Any, spp: int, seed: int) -> NDArray[np.float32]:
    """One pass; Mitsuba, when interrupted, may raise an error of its own instead, as Dr.Jit does in its callbacks."""
    try:
        return np.array(mi.render(scene, spp=spp, seed=seed))
    except RuntimeError as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from None
        raise


def _rgb(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """A scene file may ask for grey, for an alpha channel, or for more."""
    return image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, axis=-1)


def _passes(spp: int, pixels: int) -> list[int]:
    """Split spp into passes of nearly equal size, none larger than PASS_SAMPLES where that is possible."""
    count = min(spp, -(-spp * pixels // PASS_SAMPLES))
    return [spp // count + (i < spp % count) for i in range(count)]


def tone_map(linear: ArrayLike, view: str = DEFAULT_VIEW) -> NDArray[np.float64]:
    """Linear RGB, of shape (..., 3), to display values in [0, 1], by a view transform of `scenes.views`.

    By default a picture is unchanged up to .7; above, highlights approach white without ever reaching it.

    Raises InvalidInput for an unknown view transform.
    """
    check_view(view)
    light = np.moveaxis(np.maximum(np.nan_to_num(np.asarray(linear, dtype=np.float64)), 0.0), -1, 0)
    return np.stack(VIEWS[view]((light[0], light[1], light[2])), axis=-1)


def check_view(view: str) -> str:
    """The name of a view transform. Raises InvalidInput for another name."""
    if view not in VIEWS:
        raise InvalidInput(f"view: must be one of {', '.join(VIEWS)}, got {view!r}")
    return view


def _displayed(image: NDArray[Any], view: str) -> NDArray[np.float64]:
    """Display values of RGB, or of RGBA, whose alpha stays."""
    colours, alpha = image[..., :3], np.clip(image[..., 3:], 0.0, 1.0)
    if not alpha.size:
        return tone_map(colours, view)
    return np.concatenate([tone_map(colours / np.maximum(alpha, 1e-6), view), alpha], axis=-1)


def check_writable(path: Name) -> Path:
    """The path of a picture, after a check that it can be written there. Raises InvalidInput."""
    return files.check_writable(path, "a picture", (".png (tone-mapped)", ".exr (linear)"))


def write_image(image: ArrayLike, path: Name, view: str = DEFAULT_VIEW) -> None:
    """Write linear RGB (height, width, 3), whole or not at all: `.png` by a view transform, `.exr` linear float32; or
    RGBA with colours that are weighed by alpha, which those of a PNG are not.

    Raises InvalidInput where `check_writable` does, and for an unknown view transform.
    """
    target, view = check_writable(path), check_view(view)
    mi = kernel.mitsuba()
    formats = mi.Bitmap.FileFormat
    if target.suffix.lower() == ".png":
        pixels: Any = np.round(255.0 * _displayed(np.asarray(image), view)).astype(np.uint8)
        format = formats.PNG
    else:
        pixels = np.asarray(image, dtype=np.float32)
        format = formats.OpenEXR

    # Encode it in memory: Mitsuba's own files end in a RuntimeError where the disk is full
    stream = mi.MemoryStream()
    kernel.allow_pictures()
    mi.Bitmap(pixels).write(stream, format)
    with files.whole(target) as unfinished:
        unfinished.write_bytes(stream.raw_buffer())
