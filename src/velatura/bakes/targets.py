"""How each target is started from a look, and which of its parameters are fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from velatura.bakes.look import Look
from velatura.optics import fresnel
from velatura.targets import blender, closures, gltf, openpbr, principled
from velatura.targets.closures import Array, Pair
from velatura.targets.parameters import RGB, Parameter, Values

Range: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Target:
    """A program's material: its formulas, the parameters of a look, and the ranges of those that are fitted.

    base: fitted for every stack; others only where it has what they stand for.
    metal, clear: shares of the base, fitted where media scatter light. rough, brushed: of a base that is seen through
        others, or passes light. tint: where reflectances at the normal are not those of one index.
    coat_eta, coat_brushed, coat_colour, coat_depth: whether the coat has an index, a brushing, a colour, and one that
        deepens where light crosses it at an angle.
    turned, pane: whether brushing can be turned, and light pass without refraction.
    colour, roughness: the parameter that takes an image of a diffuse base's colour, where `metal` is less than .5, and
        of the root of the one interface's alpha; none if empty.
    images: endings of the files that it reads, which are then in sRGB; any where there are none.
    """

    title: str
    parameters: tuple[Parameter, ...]
    value: Callable[[Values, Pair, bool], Array]
    start: Callable[[Look], dict[str, float | RGB]]
    metal: str
    clear: str
    base: dict[str, Range]
    coat: dict[str, Range]
    tint: dict[str, Range]
    rough: dict[str, Range]
    brushed: dict[str, Range]
    film: dict[str, Range]
    coat_eta: bool = False
    coat_brushed: bool = False
    coat_colour: bool = False
    coat_depth: bool = False
    turned: bool = False
    pane: bool = False
    colour: str = ""
    roughness: str = ""
    images: tuple[str, ...] = ()


UNIT = (0.0, 1.0)
ROUGH = (closures.ALPHA_MIN**0.5, 1.0)  # smoother is evaluated alike


def _product(a: RGB, b: RGB) -> RGB:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _mean(alpha: tuple[float, float]) -> float:
    return float(np.sqrt(0.5 * (alpha[0] ** 2 + alpha[1] ** 2)))


def _roughness(alpha: float) -> float:
    return float(np.sqrt(np.clip(alpha, 0, 1)))


def _openpbr(look: Look) -> dict[str, float | RGB]:
    # The coat roughens the base again
    base, coat = np.array(look.alpha), np.array(look.coat_alpha)
    coated = look.coat_eta > 1
    mean = np.sqrt(max(np.sqrt(base[0] * base[1]) ** 2 - 2 * coat[0] * coat[1] * coated, 1e-6))

    def split(u: float, v: float) -> float:
        return float(1 - v / u) if u > 0 else 0.0

    def rough(u: float, v: float) -> float:
        """The roughness whose alphas, by `openpbr.alphas`, are these."""
        return _roughness(np.sqrt(0.5 * (u**2 + v**2)))

    anisotropy = split(*base)
    u = mean / np.sqrt(1 - min(anisotropy, 0.99))
    values: dict[str, float | RGB] = {
        "base_color": look.color,
        "base_metalness": look.metalness,
        "specular_roughness": rough(u, mean**2 / u if u else 0.0),
        "specular_roughness_anisotropy": anisotropy,
        "geometry_tangent": float(np.degrees(look.turn)),
        "specular_ior": look.eta * look.coat_eta,  # in air
        "transmission_weight": look.clear,
        "transmission_color": look.tint,
    }
    if coated:
        values |= {
            "coat_weight": 1.0,
            "coat_ior": look.coat_eta,
            "coat_roughness": rough(*look.coat_alpha),
            "coat_roughness_anisotropy": split(*coat),
            "geometry_coat_tangent": float(np.degrees(look.coat_turn)),
            "coat_color": look.coat_tint,
        }
    if look.film:
        n, nm = look.film
        values |= {"thin_film_weight": 1.0, "thin_film_ior": n, "thin_film_thickness": nm / 1000}
    return values


def _gltf(look: Look) -> dict[str, float | RGB]:
    u, v = look.alpha
    # Of two axes, the one across is the smoother one; the tint of a coat goes into the base
    values: dict[str, float | RGB] = {
        "baseColorFactor": look.tint if look.clear else _product(look.color, look.coat_tint),
        "metallicFactor": look.metalness,
        "roughnessFactor": _roughness(v),
        "anisotropyStrength": float(np.sqrt(np.clip((u - v) / max(1 - v, 1e-6), 0, 1))),
        "anisotropyRotation": look.turn,
        "ior": look.eta if look.metalness < 1 else 1.5,
        "specularFactor": 0.0 if look.eta == 1 and not (look.metalness or look.clear) else 1.0,
        "transmissionFactor": look.clear,
    }
    if look.coat_eta > 1:
        share = fresnel.normal_incidence(look.coat_eta) / gltf.COAT_F_0
        values |= {
            "clearcoatFactor": min(share, 1.0),
            "clearcoatRoughnessFactor": _roughness(_mean(look.coat_alpha)),
        }
    if look.film:
        n, nm = look.film
        values |= {"iridescenceFactor": 1.0, "iridescenceIor": n, "iridescenceThicknessMaximum": nm}
    return values


def _blender(look: Look) -> dict[str, float | RGB]:
    values: dict[str, float | RGB] = {
        "Base Color": _product(look.tint, look.tint) if look.clear else look.color,
        "Metallic": look.metalness,
        **_burley(look, "Roughness", "Anisotropic"),
        "Anisotropic Rotation": float(look.turn / (2 * np.pi) % 1),
        "IOR": look.eta,
        "Transmission Weight": look.clear,
    }
    if look.coat_eta > 1:
        values |= {
            "Coat Weight": 1.0,
            "Coat Roughness": _roughness(_mean(look.coat_alpha)),
            "Coat IOR": look.coat_eta,
            "Coat Tint": look.coat_tint,
        }
    if look.film:
        values |= {"Thin Film IOR": look.film[0], "Thin Film Thickness": look.film[1]}
    return values


def _principled(look: Look) -> dict[str, float | RGB]:
    # It cannot be turned: across the tangent it is brushed less, never more
    along = abs(np.cos(look.turn)) > 0.5
    values: dict[str, float | RGB] = {
        "base_color": _product(look.tint, look.tint) if look.clear else _product(look.color, look.coat_tint),
        "metallic": look.metalness,
        **_burley(look, "roughness", "anisotropic"),
        "eta": look.eta,
        "spec_trans": look.clear,
    }
    if not along:
        values["anisotropic"] = 0.0
    if look.coat_eta > 1:
        alpha = _mean(look.coat_alpha)
        smooth, rough = principled.COAT_ALPHA[1], principled.COAT_ALPHA[0]
        values |= {
            "clearcoat": min(fresnel.normal_incidence(look.coat_eta) / principled.COAT_F_0, 1.0),
            "clearcoat_gloss": float(np.clip((rough - alpha) / (rough - smooth), 0, 1)),
        }
    return values


def _burley(look: Look, roughness: str, anisotropic: str) -> dict[str, float | RGB]:
    u, v = np.maximum(look.alpha, 1e-6)
    return {roughness: _roughness(np.sqrt(u * v)), anisotropic: float(np.clip((1 - v / u) / 0.9, 0, 1))}


#: By the name of the format.
TARGETS: dict[str, Target] = {
    "openpbr": Target(
        "OpenPBR",
        (*openpbr.PARAMETERS, *openpbr.TURNS),
        openpbr.value,
        _openpbr,
        metal="base_metalness",
        clear="transmission_weight",
        base={
            "base_color": UNIT,
            "transmission_color": UNIT,
            "specular_ior": (1.001, 4.0),
            "base_diffuse_roughness": UNIT,
        },
        coat={"coat_color": UNIT, "coat_ior": (1.001, 3.0), "coat_darkening": UNIT},
        tint={"specular_color": UNIT},
        rough={"specular_roughness": ROUGH},
        brushed={
            "specular_roughness_anisotropy": UNIT,
            "coat_roughness_anisotropy": UNIT,
            "geometry_tangent": (-180.0, 180.0),
        },
        film={"thin_film_ior": (1.001, 3.0), "thin_film_thickness": (0.01, 2.0)},
        coat_eta=True,
        coat_brushed=True,
        coat_colour=True,
        turned=True,
        pane=True,
        colour="base_color",
        roughness="specular_roughness",
    ),
    "gltf": Target(
        "glTF",
        gltf.PARAMETERS,
        gltf.value,
        _gltf,
        metal="metallicFactor",
        clear="transmissionFactor",
        base={"baseColorFactor": UNIT, "ior": (1.001, 4.0)},
        coat={},
        tint={"specularColorFactor": UNIT},
        rough={"roughnessFactor": ROUGH},
        brushed={"anisotropyStrength": UNIT, "anisotropyRotation": (-np.pi, np.pi)},
        film={
            "iridescenceIor": (1.001, 3.0),
            "iridescenceThicknessMaximum": (10.0, 2000.0),
        },
        turned=True,
        pane=True,
        colour="baseColorFactor",
        images=(".png", ".jpg", ".jpeg"),
    ),
    "blender-principled": Target(
        "Blender's Principled BSDF",
        blender.PARAMETERS,
        blender.value,
        _blender,
        metal="Metallic",
        clear="Transmission Weight",
        base={
            "Base Color": UNIT,
            "IOR": (1.001, 4.0),
            "Diffuse Roughness": UNIT,
        },
        coat={"Coat IOR": (1.001, 4.0), "Coat Tint": UNIT},
        tint={"Specular Tint": UNIT},
        rough={"Roughness": ROUGH},
        brushed={"Anisotropic": UNIT, "Anisotropic Rotation": (-1.0, 2.0)},
        film={"Thin Film IOR": (1.001, 3.0), "Thin Film Thickness": (10.0, 2000.0)},
        coat_eta=True,
        coat_colour=True,
        coat_depth=True,
        turned=True,
        colour="Base Color",
        roughness="Roughness",
    ),
    "mitsuba-principled": Target(
        "Mitsuba's principled",
        principled.PARAMETERS,
        principled.value,
        _principled,
        metal="metallic",
        clear="spec_trans",
        base={"base_color": UNIT, "eta": (1.001, 4.0), "flatness": UNIT},
        coat={"clearcoat": UNIT, "clearcoat_gloss": UNIT},
        tint={"spec_tint": UNIT},
        rough={"roughness": ROUGH},
        brushed={"anisotropic": UNIT},
        film={},
    ),
}
