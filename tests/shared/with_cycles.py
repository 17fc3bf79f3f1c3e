"""Pictures of exported materials by Cycles, in the Blender that `make blender` installs."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-blender/bin/python"
NEEDED = pytest.mark.skipif(not PYTHON.exists(), reason="`make blender` installs the Blender that this runs")

SCENE = {
    "camera": [0.0, -1.3, 0.9],
    "fov": 50.0,
    "half": 5.0,
    "threads": int(os.environ.get("OMP_NUM_THREADS", 0)),
}


def pictures(folder: Path, scripts: Mapping[str, Path], job: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Pictures by `in_cycles` of the materials that scripts make, by name."""
    files = {name: folder / f"{name}.npy" for name in scripts}
    materials = [[str(script), str(files[name])] for name, script in scripts.items()]
    described = folder / "job.json"
    described.write_text(json.dumps({**SCENE, **job, "materials": materials}))
    command = [PYTHON, Path(__file__).with_name("in_cycles.py"), described]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-3000:]
    return {name: np.load(file) for name, file in files.items()}
