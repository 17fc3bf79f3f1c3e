"""Renders the small pictures of the presets that the editor's Open dialog shows: `python tools/thumbnails.py`."""

from pathlib import Path

import mitsuba as mi
import numpy as np

import velatura as vt
from velatura.scenes.picture import tone_map

FOLDER = Path(__file__).parents[1] / "src/velatura/editor/page/thumbnails"
SIZE = (160, 120)
SPP = 144
QUALITY = 88  # of 100


def main() -> None:
    mi.set_variant("llvm_ad_rgb")
    FOLDER.mkdir(exist_ok=True)
    for name in vt.presets():
        picture = tone_map(vt.render(name, size=SIZE, spp=SPP))
        bitmap = mi.Bitmap(np.asarray(picture, np.float32)).convert(
            mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, False
        )
        bitmap.write(str(FOLDER / f"{name}.jpg"), quality=QUALITY)
        print(name)


if __name__ == "__main__":
    main()
