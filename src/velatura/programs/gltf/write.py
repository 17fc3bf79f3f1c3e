"""A file of glTF with one material."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote

import numpy as np

from velatura.optics import fresnel
from velatura.programs import embedded
from velatura.programs.gltf import formulas
from velatura.programs.gltf.parameters import (
    CHANNELS,
    CLEARCOAT,
    COAT,
    COATING,
    CORE,
    PARAMETERS,
    VOLUME,
    image_of,
)
from velatura.programs.program import Bake, Fitted, Program, mean_alpha, product, rgb, roughness
from velatura.programs.surface import Alpha, Surface
from velatura.version import __version__

FACETS = ("roughnessFactor", "anisotropyStrength", "anisotropyRotation")
COATED = ("coatFactor", "coatIor", "coatRoughnessFactor", "coatAnisotropyStrength")  # what a clearcoat has of a coat


def start(surface: Surface) -> Fitted:
    """Parameters of a surface, whose coat's colour goes into the base."""
    values, coat = uncoated(surface), surface.coat
    if not surface.clear:
        values["baseColorFactor"] = product(surface.colour, coat.colour)
    return values | (_clearcoat(coat.share, coat.eta, mean_alpha(coat.alpha)) if surface.coated else {})


def uncoated(surface: Surface) -> Fitted:
    """Parameters of a surface without what a coat adds."""
    values: Fitted = {
        "baseColorFactor": rgb(surface.tint if surface.clear else surface.colour),
        "metallicFactor": surface.metalness,
        "ior": surface.eta if surface.metalness < 1 else 1.5,
        "specularFactor": 0.0 if surface.eta == 1 and not (surface.metalness or surface.clear) else 1.0,
        "transmissionFactor": surface.clear,
        **dict(zip(FACETS, facets(surface.alpha, surface.rotation))),
    }
    if surface.film:
        n, nm = surface.film
        thickness = {"iridescenceThicknessMaximum": float(nm)}  # type: ignore[arg-type]
        values |= {"iridescenceFactor": 1.0, "iridescenceIor": n, **thickness}
    return values


def facets(alpha: Alpha, rotation: float) -> tuple[float, float, float]:
    """Roughness, and strength and angle of anisotropy, of facets; of their two axes, the one across is the smoother."""
    u, v = np.asarray(alpha, float)
    strength = float(np.sqrt(np.clip((u - v) / max(1 - v, 1e-6), 0, 1)))
    return roughness(v), strength, float(np.radians(rotation))


def _clearcoat(share: float, eta: float, alpha: float) -> Fitted:
    weight = share * min(fresnel.normal_incidence(eta) / formulas.COAT_F_0, 1)
    return {"clearcoatFactor": weight, "clearcoatRoughnessFactor": roughness(alpha)}


def text(made: Bake, material: Any, files: dict[str, str]) -> str:
    """A document without geometry, with the loss and the stack in `extras` of its material."""
    written: dict[str, Any] = {"name": made.name or "material"}
    extensions: dict[str, dict[str, Any]] = {}
    named = list(dict.fromkeys(files.values()))  # several factors may have one image
    for parameter in (*PARAMETERS, *COATING):
        name, image = parameter.name, made.images.get(parameter.name)
        value = image.factor if image else made.values.get(name, parameter.default)
        if value == parameter.default and not image:
            continue
        part = (written if parameter.within == CORE else extensions).setdefault(parameter.within, {})
        part[name] = [*value, 1.0] if name == "baseColorFactor" and isinstance(value, tuple) else value
        if image:
            part[image_of(name)] = {"index": named.index(files[name])}
        if image and name == "iridescenceThicknessMaximum":
            part["iridescenceThicknessMinimum"] = 0.0
    if COAT in extensions:  # for programs that know none but a clearcoat
        share, eta, rough, strength = (made.values[name] for name in COATED)
        alpha = mean_alpha(formulas.alphas(rough, strength))  # type: ignore[arg-type]
        extensions[CLEARCOAT] = dict(_clearcoat(share, eta, alpha))  # type: ignore[arg-type]
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
    if named:
        document["images"] = [{"uri": quote(file)} for file in named]
        document["textures"] = [{"source": n} for n in range(len(named))]
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
    maps={name: (image_of(name), channel) for name, channel in CHANNELS.items()},
    images=(".png", ".jpg", ".jpeg"),
)
