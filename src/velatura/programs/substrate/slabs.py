"""A material as slabs of Unreal's Substrate: a base, and a coat above it, from the parameters of OpenPBR that are
fitted to it and the lobes that it has.

How Substrate evaluates slabs is not published as formulas, so that no loss is stated. What is known of it, from its
documentation: Schlick's Fresnel with colours F0 and F90, the latter of full brightness; GGX of roughness squared,
(1 + anisotropy) times along the tangent and (1 - anisotropy) times across it; a second roughness with a weight; an
absorbing coat by its transmittance along the normal. Bounces between coat and base are part of the base's colours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from velatura.model import Model
from velatura.optics import fresnel
from velatura.programs.openpbr import formulas
from velatura.programs.openpbr.parameters import PARAMETERS, TURNS
from velatura.programs.parameters import RGB, Values, complete
from velatura.programs.program import rgb, roughness
from velatura.stack import Described, Material, Stack

THICKNESS_CM = 0.01  # of a coat, as the engine's own slabs have
DISTINCT = 1.25  # ratio of roughnesses, from which there are two
FAINT = 0.02  # share of a base's lobes, below which there is no second roughness


@dataclass(frozen=True)
class Slab:
    """Parameters of a slab, named as its inputs are.

    turn: degrees from the tangent of the surface to that of the slab. transmittance: of light that crosses it once
    along the normal; None of a base. coverage: the share of the surface that has it.
    """

    diffuse_albedo: RGB
    f0: RGB
    f90: RGB
    roughness: float
    anisotropy: float
    turn: float
    second_roughness: float = 0.0
    second_roughness_weight: float = 0.0
    transmittance: RGB | None = None
    thickness_cm: float = THICKNESS_CM
    coverage: float = 1.0

    @property
    def mean_free_path_cm(self) -> RGB | None:
        """The mean free path of light by which the slab has its transmittance, at most a metre."""
        if self.transmittance is None:
            return None
        depth = -np.log(np.clip(self.transmittance, 1e-6, 1.0))
        return rgb(self.thickness_cm / np.maximum(depth, self.thickness_cm / 100.0))

    @property
    def facts(self) -> dict[str, Any]:
        """Its parameters, as facts of an export."""
        return {**asdict(self), "mean_free_path_cm": self.mean_free_path_cm}


def slabs(given: Values, material: Described, model: Model) -> list[Slab]:
    """The slabs of an opaque material, the lowest first, of fitted parameters of OpenPBR."""
    v = complete((*PARAMETERS, *TURNS), given)
    f0, f90 = _edges(v)
    shown = formulas.darkening(v)[:, 0]
    diffuse = (1 - v["base_metalness"]) * v["base_weight"] * np.asarray(v["base_color"])
    alphas = formulas.alphas(v["specular_roughness"], v["specular_roughness_anisotropy"])
    base = Slab(rgb(shown * diffuse), rgb(shown * f0), f90, *_facets(*alphas), v["geometry_tangent"])
    if isinstance(material, Stack):
        base = _hazy(base, material, model, v)
    if v["coat_weight"] <= 0:
        return [base]
    coat = Slab(
        (0.0, 0.0, 0.0),
        (float(fresnel.normal_incidence(v["coat_ior"])),) * 3,
        (1.0, 1.0, 1.0),
        *_facets(*formulas.alphas(v["coat_roughness"], v["coat_roughness_anisotropy"])),
        v["geometry_coat_tangent"],
        transmittance=rgb(np.sqrt(v["coat_color"])),
        coverage=v["coat_weight"],
    )
    return [base, coat]


def _edges(v: Mapping[str, Any]) -> tuple[np.ndarray, RGB]:
    """F0 (3,), and F90 of full brightness, by which Schlick's Fresnel has the base's colours at the normal and at about
    82 degrees."""
    cosines = np.array([1.0, fresnel.EDGE])
    metal, dielectric = formulas.reflectances(v, cosines, formulas.base_index(v))
    metalness, tint = v["base_metalness"], np.reshape(v["specular_color"], (3, 1))
    f0, edge = ((1 - metalness) * tint * dielectric + metalness * v["specular_weight"] * metal).T
    f90 = np.maximum(f0 + (edge - f0) / (1 - fresnel.EDGE) ** 5, 0)
    return f0, rgb(tuple((f90 / f90.max() if f90.max() > 0 else np.ones(3)).tolist()))


def _facets(u: Any, v: Any) -> tuple[float, float]:
    """Roughness and anisotropy, by which GGX has these two."""
    u, v = float(u), float(v)
    return roughness(0.5 * (u + v)), (u - v) / (u + v) if u + v > 0 else 0.0


def _hazy(base: Slab, stack: Stack, model: Model, v: Mapping[str, Any]) -> Slab:
    """A base whose lobes, at normal incidence, have two roughnesses that differ."""
    solid = Material.of(stack).solid()
    x, y, z = (np.array([w]) for w in (0.0, 0.0, 1.0))
    seen = model.statistics(solid, (x, y, z))
    coated = v["coat_weight"] > 0
    energy = np.array([float(each[:, 0].mean()) for each in seen.energy])[coated:]
    alphas = np.array([float(np.sqrt(np.prod(each[:, 0]))) for each in seen.alpha])[coated:]
    if len(energy) < 2 or energy.sum() <= 0:
        return base
    # The engine blurs what lies below a coat again, as OpenPBR does
    alphas = np.sqrt(np.maximum(alphas**2 - 2 * coated * v["coat_roughness"] ** 4, 1e-6))
    first = int(np.argmax(energy))
    others = np.delete(energy, first)
    second = float(np.sqrt(np.average(np.delete(alphas, first) ** 2, weights=others + 1e-12)))
    weight = float(others.sum() / energy.sum())
    if weight < FAINT or max(second / alphas[first], alphas[first] / second) < DISTINCT:
        return base
    return replace(
        base,
        roughness=roughness(float(alphas[first])),
        second_roughness=roughness(second),
        second_roughness_weight=weight,
    )
