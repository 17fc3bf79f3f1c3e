"""Questions of a sweep to a material: named ones, and functions of one's own.

An answer holds arrays by name, each with the names of its dimensions: `{"energy": (("interface", "colour"), array)}`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, registry
from velatura.model.registry import stack_lobes
from velatura.optics.directions import directions
from velatura.stack import Described, InterfaceValues, Material, SlabValues, single

Array = NDArray[Any]
Answer: TypeAlias = dict[str, tuple[tuple[str, ...], Array]]
Coordinates: TypeAlias = dict[str, tuple[tuple[str, ...], Array]]

#: Names along dimensions that have them.
NAMES = {"colour": ("r", "g", "b"), "axis": ("u", "v"), "moment": ("xx", "xy", "yy"), "component": ("x", "y")}

#: Dimensions of the quantities of a lobe, for every direction of incidence.
LOBE = {
    "energy": ("colour",),
    "alpha": ("axis",),
    "rotation": (),
    "covariance": ("moment",),
    "mean": ("component",),
    "own_alpha": ("axis",),
    "own_rotation": (),
}
#: The unit and the meaning of a quantity, by name without `transmitted_` and `_error`.
MEANINGS = {
    "own_alpha": ("1", "GGX roughness in the medium that the lobe is drawn in"),
    "own_rotation": ("rad", "angle from the tangent to the first axis, in that medium"),
    "alpha": ("1", "GGX roughness along two axes"),
    "rotation": ("rad", "angle from the tangent to the first axis, anticlockwise seen from outside"),
    "covariance": ("1", "variances and covariance of the lobe"),
    "mean": ("1", "mean direction on the projected disc"),
    "energy": ("1", "fraction of the incident energy"),
    "remainder": ("1", "energy that is reflected in no lobe"),
    "passed": ("1", "energy that leaves below"),
    "absorbed": ("1", "energy that does not leave"),
    "reflected": ("1", "energy that is reflected"),
    "transmitted": ("1", "energy that leaves below"),
    "truncated": ("1", "energy of paths that were cut off"),
    "image": ("1", "linear RGB"),
    "value": ("1", "number by which a law is decided"),
    "bound": ("1", "largest number that the law allows"),
    "kept": ("1", "1 where the law is kept"),
    "declared": ("1", "1 where the model declares that it does not keep the law"),
    "asked_energy": ("1", "energy of the lobe that is asked for"),
    "asked_alpha": ("1", "GGX roughness of the lobe that is asked for"),
    "eta": ("1", "absolute index of refraction that is found"),
    "k": ("1", "absolute extinction that is found"),
    "depth": ("1", "optical depth that is found above the interface"),
    "cos_theta": ("1", "cosine of incidence"),
    "phi": ("rad", "azimuth of incidence from the tangent"),
    "x": ("1", "component of the outgoing direction along the tangent"),
    "y": ("1", "component of the outgoing direction along the bitangent"),
}


@dataclass(frozen=True)
class Question:
    """A question.

    Args:
        ask: called with a material, a seed and the options; returns arrays by name, with or without names of their
            dimensions.
        coordinates: of the dimensions, for options.
    """

    ask: Callable[..., Mapping[str, Any]]
    coordinates: Callable[..., Coordinates] = lambda **options: {}


def meaning(name: str) -> dict[str, str]:
    """Attributes of a quantity: its unit and its meaning, where they are known."""
    error = name.endswith("_error")
    for known, (unit, words) in MEANINGS.items():
        if name.removesuffix("_error") in (known, f"transmitted_{known}"):
            side = ", of light that leaves below" if name.startswith("transmitted_") else ""
            return {"units": unit, "long_name": f"{'standard error: ' * error}{words}{side}"}
    return {}


# What may be asked ---------------------------------------------------------------------------------------------------


def lobes(
    material: Described, seed: int, cos_theta: ArrayLike, phi: ArrayLike = 0.0, model: str = DEFAULT, **switches: str
) -> Answer:
    """The lobes of a model, as `velatura.lobes` returns them."""
    found = registry.lobes(material, cos_theta, phi, model, **switches)
    answer = _lists(found, ("energy", "alpha", "rotation", "covariance", "own_alpha", "own_rotation"))
    answer |= _below(found.transmitted, ("energy", "alpha", "rotation", "covariance"))
    return answer | {name: (_BY_COLOUR, getattr(found, name)) for name in ("remainder", "passed", "absorbed")}


def albedo(
    material: Described, seed: int, cos_theta: ArrayLike, phi: ArrayLike = 0.0, model: str = DEFAULT, **switches: str
) -> Answer:
    """The energy that a model reflects, transmits and absorbs."""
    found = registry.lobes(material, cos_theta, phi, model, **switches)
    energies = {"reflected": sum(found.energy) + found.remainder, "transmitted": found.passed}
    return {name: (_BY_COLOUR, energy) for name, energy in (energies | {"absorbed": found.absorbed}).items()}


def statistics(
    material: Described,
    seed: int,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 10**6,
    microsurface: bool = False,
    polarised: bool = False,
) -> Answer:
    """Statistics of the reference's lobes, as `velatura.reference.statistics` returns them, with standard errors."""
    from velatura import reference

    found = reference.statistics(material, cos_theta, phi, paths, seed, microsurface, polarised)
    answer: Answer = {}
    for side, ending in ((found, ""), (found.standard_error, "_error")):
        assert side is not None
        answer |= {f"{name}{ending}": lobe for name, lobe in _lists(side, _WALKED).items()}
        answer |= {f"{name}{ending}": lobe for name, lobe in _below(side.transmitted, _WALKED).items()}
    return answer | {"truncated": (("direction",), found.truncated)}


def distribution(
    material: Described,
    seed: int,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    paths: int = 3 * 10**6,
    microsurface: bool = False,
    bins: int = 40,
    polarised: bool = False,
) -> Answer:
    """Energies of the reference over the projected disc, as `velatura.reference.distribution` returns them."""
    from velatura import reference

    found = reference.distribution(material, cos_theta, phi, paths, seed, microsurface, bins, polarised)
    sides = {"reflected": found.reflected, "transmitted": found.transmitted}
    return {name: ((*_BY_COLOUR, "x", "y"), grid) for name, grid in sides.items() if grid is not None}


def check(material: Described, seed: int, model: str = DEFAULT, **switches: Any) -> Answer:
    """Values that decide each law, as `velatura.check` reports them; NaN for laws that say nothing of the material."""
    from velatura import api
    from velatura.checks import LAWS

    report = api.check(material, model, **switches)
    found = {finding.law: finding for finding in report.findings}
    rows = [found.get(law.name) for law in LAWS]
    numbers = {
        "value": [row.value if row else np.nan for row in rows],
        "bound": [row.bound if row else np.nan for row in rows],
        "kept": [float(row.passed) if row else np.nan for row in rows],
        "declared": [float(row.declared) if row else np.nan for row in rows],
    }
    return {name: (("law",), np.array(column, float)) for name, column in numbers.items()}


def render(
    material: Described,
    seed: int,
    scene: str = "ball",
    env: str | None = None,
    spp: int = 64,
    size: int | str | Sequence[int] = 128,
    model: str = DEFAULT,
    **switches: Any,
) -> Answer:
    """A picture, as `velatura.render` returns it: linear RGB, (height, width, 3)."""
    from velatura import api

    picture = api.render(material, scene, env, spp, size, model, seed, **switches)
    return {"image": (("row", "column", "colour"), np.asarray(picture))}


def inverse(material: Described, seed: int, model: str = DEFAULT, **switches: str) -> Answer:
    """The stack that inverse design finds for lobes of a stack at normal incidence, its films kept: as asked, and by
    interface."""
    from velatura.inverse import invert_stack
    from velatura.inverse.lobes.target import ROUND

    stack = single(material, "inverse")
    if stack.base:
        raise InvalidInput("inverse: not of a stack with a diffuse base")
    asked = stack_lobes(stack, 1.0, 0.0, model, **switches)
    wanted = [
        {
            "energy": tuple(energy[:, 0].tolist()),
            "alpha": tuple(alpha[:, 0].tolist()),
            "base": layer.kind,
            **({"fixed": {"films": [layer.films]}} if layer.films else {}),
            **({"rotation": float(np.degrees(rotation[0]))} if abs(alpha[0, 0] - alpha[1, 0]) > ROUND else {}),
        }
        for energy, alpha, rotation, layer in zip(asked.energy, asked.alpha, asked.rotation, stack.interfaces)
    ]
    solution = invert_stack({"lobes": wanted, "exterior": stack.exterior}, model, **switches)
    found = stack_lobes(solution.stack, 1.0, 0.0, model, **switches)
    layers = Material.of(solution.stack).layers
    surfaces = [layer for layer in layers if isinstance(layer, InterfaceValues)]
    tau = [0.0]
    for layer in layers:
        if isinstance(layer, SlabValues):
            tau[-1] = tau[-1] + layer.tau_a
        elif isinstance(layer, InterfaceValues):
            tau.append(0.0)
    coloured, along = ("interface", "colour"), ("interface", "axis")
    return {
        "asked_energy": (coloured, np.array(asked.energy)[..., 0]),
        "energy": (coloured, np.array(found.energy)[..., 0]),
        "asked_alpha": (along, np.array(asked.alpha)[..., 0]),
        "alpha": (along, np.array(found.alpha)[..., 0]),
        "eta": (coloured, _coloured([layer.eta for layer in surfaces])),
        "k": (coloured, _coloured([layer.k for layer in surfaces])),
        "own_alpha": (along, np.array([(layer.alpha_u, layer.alpha_v) for layer in surfaces])),
        "depth": (coloured, _coloured(tau[: len(surfaces)])),
    }


def _coloured(values: Sequence[Any]) -> Array:
    """Values by colour (K, 3); NaN where there is none."""
    return np.array([np.broadcast_to(np.nan if x is None else np.ravel(x), (3,)) for x in values])


_BY_COLOUR = ("colour", "direction")
_WALKED = ("energy", "alpha", "rotation", "covariance", "mean")


def _lists(found: Any, names: Sequence[str]) -> Answer:
    """Quantities of lobes in lists over interfaces."""
    return {name: _dims(name, np.stack(getattr(found, name)), "interface") for name in names}


def _below(lobes: Any, names: Sequence[str]) -> Answer:
    """Quantities of what is transmitted, if anything is: a lobe, or of a mixture one of every part that transmits."""
    if isinstance(lobes, list):
        each = {name: [getattr(lobe, name) for lobe in lobes] for name in names if lobes}
        return {f"transmitted_{name}": _dims(name, np.stack(values), "part") for name, values in each.items()}
    return {f"transmitted_{name}": _dims(name, getattr(lobes, name)) for name in names if lobes}


def _dims(name: str, values: Array, *first: str) -> tuple[tuple[str, ...], Array]:
    """A quantity with the names of its dimensions, which include colours where there is one of it for each."""
    own = (*LOBE[name], "direction")
    return (*first, *(("colour",) if values.ndim > len(first) + len(own) else ()), *own), values


# Coordinates ---------------------------------------------------------------------------------------------------------


def _of_directions(cos_theta: ArrayLike, phi: ArrayLike = 0.0, **_: Any) -> Coordinates:
    x, y, z = directions(cos_theta, phi).T
    return {"cos_theta": (("direction",), z), "phi": (("direction",), np.arctan2(y, x))}


def _of_disc(bins: int = 40, **others: Any) -> Coordinates:
    centres = (np.arange(bins) + 0.5) / (0.5 * bins) - 1
    return {**_of_directions(**others), "x": (("x",), centres), "y": (("y",), centres)}


def _of_laws(**_: Any) -> Coordinates:
    from velatura.checks import LAWS

    return {"law": (("law",), np.array([law.name for law in LAWS]))}


QUESTIONS = {
    "lobes": Question(lobes, _of_directions),
    "albedo": Question(albedo, _of_directions),
    "statistics": Question(statistics, _of_directions),
    "distribution": Question(distribution, _of_disc),
    "check": Question(check, _of_laws),
    "render": Question(render),
    "inverse": Question(inverse),
}
