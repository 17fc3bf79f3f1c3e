"""Shaders with hostile names and paths of textures, as Blender compiles them and Cycles reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from with_cycles import NEEDED, pictures

import velatura as vt

pytestmark = NEEDED


def test_cycles_reads_the_texture_of_a_hostile_path(tmp_path: Path) -> None:
    """Expected: the grey of the picture: Open Shading Language reads octal digits as the characters of the path."""
    path = tmp_path / 'a"b ??' / "'''\\ {0}.exr"
    path.parent.mkdir()
    vt.scenes.write_image(np.full((4, 4, 3), 0.5, np.float32), path)
    stack = vt.Stack([vt.Diffuse(albedo={"texture": path})], name="'''\\ ??/")
    script = vt.export(stack, "blender", "belcour2018").save(tmp_path / "grey.py")[0]
    job = {"size": 8, "spp": 16, "seeds": [1], "cosines": [1.0]}
    assert pictures(tmp_path, {"grey": script}, job)["grey"].mean() == pytest.approx(0.5, abs=0.01)
