"""Measures how far the default model is from random walks for each preset: `python tools/preset_distances.py > FILE`.

Prints a JSON object, by preset: total_variation, in the mean over the cosines of incidence, the part of it that is the
walks' own noise, and albedo, the greatest error over colours and cosines. The manual shows them on the presets' cards.
"""

import json

import numpy as np

import velatura as vt
from velatura.model import DEFAULT
from velatura.programs.textures import means

PLACES = 4


def distances(preset: str, paths: int = 1_000_000) -> dict[str, float]:
    """How far the default model is from `paths` walks for each direction of incidence; of textures, for the mean."""
    material = vt.preset(preset)
    found = vt.compare(material.replace(**means(material)), [DEFAULT], paths=paths)
    model = found.models[DEFAULT]
    numbers = {
        "total_variation": np.mean(found.total_variation[DEFAULT]),
        "noise": np.mean(found.noise),
        "albedo": np.max(np.abs(model.albedo - found.truth.albedo)),
    }
    return {name: round(float(number), PLACES) for name, number in numbers.items()}


if __name__ == "__main__":
    print(json.dumps({name: distances(name) for name in vt.presets()}, indent=1))
