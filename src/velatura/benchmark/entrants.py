"""Entrants: the named models, a baseline, Mitsuba's own BSDFs, and the formulas of OpenPBR, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import api, bakes
from velatura.bakes import TARGETS
from velatura.benchmark.candidates import Candidate, Factory, Walk
from velatura.benchmark.stacks import Case
from velatura.comparison.baked import bsdf as principled
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, MODELS, Model, named
from velatura.programs.closures import ViewAndLight
from velatura.stack import DiffuseValues, InterfaceValues, Material, MediumValues
from velatura.stack.schema import unknown

Array = NDArray[np.floating]

SYMMETRIC = "-symmetric"
WALK = Walk(seed=1, paths=2**19)


def with_bounces(model: Model, often: bool) -> Model:
    """The model, with the reflectance that light has between the facets of an interface, if it averages over these."""
    if not model.reflectance.startswith("fgd"):
        return model
    return model.with_switches(reflectance="fgd-multi" if often else "fgd")


def _model(model: Model) -> Factory:
    return lambda case: api.bsdf(case.stack, with_bounces(model, case.often))


def _weidlich_wilkie(case: Case) -> Candidate:
    media = [layer for layer in Material.of(case.stack).layers if isinstance(layer, MediumValues)]
    if case.stack.transmits or any(np.any(medium.sigma_s) for medium in media):
        return None
    return api.bsdf(case.stack, "weidlich_wilkie")


def _baked(case: Case, target: str) -> bakes.Bake:
    model = with_bounces(named(DEFAULT), case.often)
    return bakes.bake(case.stack, target, model)


def _principled(case: Case) -> Candidate:
    # It refracts what passes, as into a solid
    return None if case.stack.thin else principled(_baked(case, "mitsuba-principled"))


def _openpbr(case: Case) -> Candidate:
    found = _baked(case, "openpbr")

    def value(wi: Array, wo: Array) -> Array:
        """Its formulas are for light from above."""
        light = TARGETS["openpbr"].value(found.values, ViewAndLight(wi.T, wo.T), found.thin)
        return np.where(wi[:, 2:] > 0, light.T, np.nan)

    return value


def _rgb(colour: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": np.broadcast_to(np.asarray(colour, float).ravel(), 3).tolist()}


def _roughplastic(case: Case) -> Candidate:
    if case.stack.kinds != ("dielectric", "diffuse") or case.stack.films[0] or not case.symmetric:
        return None
    coat, base = Material.of(case.stack).layers
    assert isinstance(coat, InterfaceValues) and isinstance(base, DiffuseValues)
    index = float(np.mean(coat.eta))
    colour = {"diffuse_reflectance": _rgb(base.albedo), "nonlinear": True}
    return {"type": "roughplastic", **_indices(index), "alpha": coat.alpha_u, **colour}


def _rough(case: Case) -> Candidate:
    """One interface."""
    if len(case.stack.kinds) > 1 or case.stack.films[0]:
        return None
    (only,) = Material.of(case.stack).interfaces
    if only.kind == "dielectric":
        return {"type": "roughdielectric", **_indices(float(np.mean(only.eta))), "alpha": only.alpha_u}
    if only.rotation % 180 and only.alpha_u != only.alpha_v:
        return None
    index = {"material": "none"} if only.kind == "mirror" else {"eta": _rgb(only.eta), "k": _rgb(only.k)}
    alpha = {"alpha_u": only.alpha_u, "alpha_v": only.alpha_v}
    return {"type": "roughconductor", "distribution": "ggx", **index, **alpha}


def _indices(index: float) -> dict[str, Any]:
    return {"distribution": "ggx", "int_ior": index, "ext_ior": 1.0}


#: By name.
ENTRANTS: Mapping[str, Factory] = {
    "walk": lambda case: WALK,
    **{model.name: _model(model) for model in MODELS},
    **{f"{model.name}{SYMMETRIC}": _model(model.with_switches(form="symmetric")) for model in MODELS},
    "weidlich_wilkie": _weidlich_wilkie,
    "principled": _principled,
    "openpbr": _openpbr,
    "roughplastic": _roughplastic,
    "rough-interface": _rough,
}


def entrant(name: str) -> Factory:
    """The entrant of that name.

    Raises:
        InvalidInput: there is none.
    """
    if name not in ENTRANTS:
        raise InvalidInput(unknown("entrant", name, ENTRANTS, f"known: {', '.join(ENTRANTS)}"))
    return ENTRANTS[name]
