"""Image files of tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from velatura import kernel


def write_image(texels: Any, path: Path) -> str:
    """Write texels (H, W) or (H, W, C) as Mitsuba writes them, by the ending of the path, which is returned.

    Mitsuba leaves OpenEXR to another thread of Dr.Jit, which tests with `one_thread` have not.
    """
    mi = kernel.mitsuba()
    kernel.allow_pictures()
    try:
        mi.Bitmap(np.ascontiguousarray(texels)).write(str(path))
    finally:
        kernel.limit_threads()
    return str(path)
