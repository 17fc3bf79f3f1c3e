"""A material as parameters of programs that take no code: fitted, with the loss written into the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.exports.request import Export, Request, relative, stated
from velatura.model.context import in_silence
from velatura.programs.fit import TARGETS, bake
from velatura.programs.program import Bake
from velatura.shader.closures import Loss
from velatura.stack import dumps


def write(request: Request) -> Export:
    """The file of the program that has the format's name."""
    program = TARGETS[request.to]
    made, apart = placed(fitted(request, request.to), request)
    text = program.text(made, held(request), files(made, None if program.anywhere else request.folder))
    return Export(text, notes=tuple(made.summary), apart=apart, facts=facts(made))


def fitted(request: Request, target: str) -> Bake:
    """The material as parameters of a target."""
    maps = request.options.get("maps")
    if maps is not None and request.folder is None:
        raise InvalidInput(f"maps: {target} has its images in files beside it; name its folder")
    return bake(request.material, target, request.model, maps=maps, progress=request.progress or in_silence)


def placed(made: Bake, request: Request) -> tuple[Bake, dict[Path, bytes]]:
    """A bake whose baked images lie in the folder of the request, and what is to be written there."""
    if not made.maps:
        return made, {}
    folder = request.folder or Path()
    folder = folder.resolve() if TARGETS[made.target].anywhere else folder
    images, apart = {}, {}
    for name, image in made.images.items():
        path = folder / image.texture.texture.name
        apart[path] = image.texture.texture.read_bytes()
        images[name] = replace(image, texture=image.texture.model_copy(update={"texture": path}))
    return replace(made, images=images), apart


def held(request: Request) -> Any:
    """The material, as a file holds it."""
    return json.loads(dumps(request.material, "json", request.folder))


def files(made: Bake, folder: Path | None) -> dict[str, str]:
    """Paths of images by parameter."""
    return {name: relative(image.texture.texture, folder) for name, image in made.images.items()}


def facts(made: Bake) -> dict[str, Any]:
    """Loss of a bake, as facts."""
    differences = np.abs(made.baked_albedo - made.albedo).max(axis=0)
    losses = map(Loss, made.cos_theta, made.total_variation.tolist(), differences.tolist())
    return {"loss": stated(losses), "left_out": list(made.lost)}
