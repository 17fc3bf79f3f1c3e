"""A material as parameters of programs that take no code: fitted, with the loss written into the file."""

from __future__ import annotations

import json

import numpy as np

from velatura.exports.request import Export, Request, relative, stated
from velatura.programs.fit import TARGETS, bake
from velatura.shader.closures import Loss
from velatura.stack import dumps


def write(request: Request) -> Export:
    """The file of the program that has the format's name."""
    made, program = bake(request.material, request.to, request.model), TARGETS[request.to]
    folder = None if program.anywhere else request.folder
    files = {name: relative(image.texture.texture, folder) for name, image in made.images.items()}
    text = program.text(made, json.loads(dumps(request.material, "json", request.folder)), files)
    differences = np.abs(made.baked_albedo - made.albedo).max(axis=0)
    losses = map(Loss, made.cos_theta, made.total_variation.tolist(), differences.tolist())
    return Export(text, notes=tuple(made.summary), facts={"loss": stated(losses), "left_out": list(made.lost)})
