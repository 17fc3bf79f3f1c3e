"""Pictures without their noise, by Open Image Denoise, where it is installed."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.errors import MissingTool

DENOISER = "mitsuba_oidn"  # by the makers of Mitsuba


def can_denoise() -> bool:
    """Whether Open Image Denoise is installed."""
    return importlib.util.find_spec(DENOISER) is not None


def check_denoiser() -> None:
    """Raises MissingTool where Open Image Denoise is not installed."""
    if not can_denoise():
        mend = f"{sys.executable} -m pip install 'velatura[denoise]'"
        raise MissingTool(f"Open Image Denoise is missing: run `{mend}`")


def denoised(image: ArrayLike) -> NDArray[np.float32]:
    """A picture, linear RGB (height, width, 3), without its noise, which neighbouring pixels must not share.

    Such is a picture of a film with the filter `box`; noise that neighbours share is taken for a pattern.

    Raises MissingTool where Open Image Denoise is not installed.
    """
    check_denoiser()
    found = importlib.import_module(DENOISER).denoise(np.ascontiguousarray(image, dtype=np.float32), hdr=True)
    return np.asarray(found, dtype=np.float32)
