"""A file of glTF with one material."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote

import numpy as np

from velatura.optics import fresnel
from velatura.programs import embedded
from velatura.programs.gltf import formulas
from velatura.programs.gltf.parameters import CORE, PARAMETERS, VOLUME
from velatura.programs.program import Bake, Fitted, Program, mean_alpha, product, rgb, roughness
from velatura.programs.surface import Surface
from velatura.version import __version__


def start(surface: Surface) -> Fitted:
    """Parameters of a surface, whose coat's colour goes into the base."""
    u, v = np.asarray(surface.alpha, float)  # of two axes, the one across is the smoother one
    values: Fitted = {
        "baseColorFactor": rgb(surface.tint) if surface.clear else product(surface.colour, surface.coat.colour),
        "metallicFactor": surface.metalness,
        "roughnessFactor": roughness(v),
        "anisotropyStrength": float(np.sqrt(np.clip((u - v) / max(1 - v, 1e-6), 0, 1))),
        "anisotropyRotation": float(np.radians(surface.rotation)),
        "ior": surface.eta if surface.metalness < 1 else 1.5,
        "specularFactor": 0.0 if surface.eta == 1 and not (surface.metalness or surface.clear) else 1.0,
        "transmissionFactor": surface.clear,
    }
    if surface.coated:
        values |= {
            "clearcoatFactor": surface.coat.share
            * min(fresnel.normal_incidence(surface.coat.eta) / formulas.COAT_F_0, 1),
            "clearcoatRoughnessFactor": roughness(mean_alpha(surface.coat.alpha)),
        }
    if surface.film:
        n, nm = surface.film
        thickness = {"iridescenceThicknessMaximum": float(nm)}  # type: ignore[arg-type]
        values |= {"iridescenceFactor": 1.0, "iridescenceIor": n, **thickness}
    return values


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """A document without geometry, with the loss and the stack in `extras` of its material."""
    written: dict[str, Any] = {"name": made.name or "material"}
    extensions: dict[str, dict[str, Any]] = {}
    for parameter, value in made.differing(PARAMETERS):
        part = written if parameter.within == CORE else extensions
        number = [*value, 1.0] if parameter.name == "baseColorFactor" and isinstance(value, tuple) else value
        part.setdefault(parameter.within, {})[parameter.name] = number
    for name, image in made.images.items():  # of the base's colour alone
        core = written.setdefault(CORE, {})
        core |= {name: [*rgb(image.factor), 1.0], "baseColorTexture": {"index": 0}}
    if made.passed.any() and not made.thin:
        extensions[VOLUME] = {"thicknessFactor": 1.0}
    if extensions:
        written["extensions"] = extensions
    loss = {
        "cos": list(made.cos_theta),
        "total_variation": made.total_variation.round(4).tolist(),
        "albedo": made.albedo.T.round(4).tolist(),
        "baked_albedo": made.baked_albedo.T.round(4).tolist(),
    }
    about = {"comment": made.comment, "model": made.model, "loss": loss, **embedded.in_gltf(material, written)}
    written["extras"] = {embedded.KEY: about}
    document: dict[str, Any] = {"asset": {"version": "2.0", "generator": f"Velatura {__version__}"}}
    if extensions:
        document["extensionsUsed"] = list(extensions)
    if files:
        document["images"] = [{"uri": quote(file)} for file in files.values()]
        document["textures"] = [{"source": 0}]
    document["materials"] = [written]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


PROGRAM = Program(
    "glTF",
    PARAMETERS,
    formulas.value,
    start,
    text,
    turned=True,
    pane=True,
    colour="baseColorFactor",
    images=(".png", ".jpg", ".jpeg"),
)
