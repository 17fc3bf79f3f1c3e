"""The validations of Weier & Belcour 2020's supplement: what brushed interfaces fetch, their lobes, pairs of roughness.

The first two may take their numbers from an interface of the material, the last is of the material itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from velatura import kernel
from velatura.editor.messages import Answer, Body, array, model_of, stack_of
from velatura.editor.validation_page import Slider, Validation, alpha_slider, answer_of, axis_of, curve_of, in_words
from velatura.errors import InvalidInput
from velatura.optics import fresnel
from velatura.stack import Interface, InterfaceValues, Material, Stack, number

SAMPLES = 2**12  # normals of an average
SIDE = 192  # points of a lobe along a side of the disc
LEVEL = 0.5  # of a lobe's height, at which its outline is taken
SIZE, PASSES, SPP = 64, 3, 16  # pixels along a side of a picture, and samples of each in a pass
SMOOTH = 1e-3  # evaluated for a roughness of 0


def chosen_interface(body: Body) -> tuple[Stack, int]:
    """The material, and which of its layers is the chosen interface.

    Raises:
        InvalidInput: no material, or not an interface.
    """
    stack, layer = stack_of(body, "validation"), body.get("layer")
    if layer is None or layer >= len(stack.layers) or not isinstance(stack.layers[layer], Interface):
        raise InvalidInput(f"layer: must be the number of an interface of the material, got {layer!r}")
    return stack, layer


def numbers_of(body: Body) -> dict[str, float]:
    """Numbers for sliders of the chosen interface: its mean reflectance at normal incidence when smooth, its roughness.

    Raises:
        InvalidInput: as `chosen_interface`, and a texture.
    """
    stack, layer = chosen_interface(body)
    material = Material.of(stack, number)
    own = material.layers[layer]
    assert isinstance(own, InterfaceValues)
    above = [part.eta for part in material.layers[:layer] if isinstance(part, InterfaceValues)]
    eta_1 = above[-1] if above else material.exterior
    indices = [index / eta_1 for index in (own.eta, own.k) if index is not None]
    reflectance = float(np.mean(fresnel.normal_incidence(*indices))) if indices else 1.0
    return {"reflectance": reflectance, "alpha_u": float(own.alpha_u), "alpha_v": float(own.alpha_v)}


def fetch(reflectance: float, alpha_u: float, alpha_v: float, azimuth: float) -> dict[str, Any]:
    """Schlick's Fresnel averaged over a brushed interface, beside what models fetch for that.

    Weier & Belcour 2020, section 3.2 and Listing 1.
    """
    from velatura.figures.weier2020_05 import averaged, fetched

    angles, turn = np.arange(0, 90, 3.0), np.radians(azimuth)
    sine = np.sin(np.radians(angles))
    wi = sine * np.cos(turn), sine * np.sin(turn), np.cos(np.radians(angles))
    root = np.sqrt(reflectance)
    eta, alpha = float((1 + root) / (1 - root)), (max(alpha_u, SMOOTH), max(alpha_v, SMOOTH))
    truth = averaged(wi, eta, alpha, SAMPLES)
    forms = {"isotropic": (min(alpha), "stretched"), "stretched": (alpha, "stretched"), "averaged": (alpha, "averaged")}
    found = {name: fetched(wi, eta, *form) for name, form in forms.items()}
    curves = [curve_of("integral", "truth", angles, truth)]
    curves += [curve_of(name, "model", angles, values) for name, values in found.items()]
    worst = {name: float(np.abs(values - truth).max()) for name, values in found.items()}
    axes = {"x": axis_of("angle of incidence (\N{DEGREE SIGN})", 0, 90), "y": axis_of("albedo", 0, None)}
    return answer_of(curves, axes, f"Largest difference: {in_words(worst)}.")


def aligned(alpha_u: float, alpha_v: float, angle: float, azimuth: float) -> dict[str, Any]:
    """The lobe of a brushed mirror on the disc, beside an ellipse along the axes of its roughness.

    Weier & Belcour 2020, section 3.1. `disc` has the `picture` (rows from the lowest y on, highest 1) and `outlines` of
    `label`, `kind` and `points`.
    """
    from velatura.figures import disc

    x, y = disc.grid(SIDE)
    lobe = disc.reflected(disc.incidence(angle, azimuth), x, y, max(alpha_u, SMOOTH), max(alpha_v, SMOOTH))
    points = np.stack([x[lobe >= LEVEL], y[lobe >= LEVEL]])
    if points.shape[1] < 3:
        raise InvalidInput("alpha_u, alpha_v: the lobe is too sharp to be seen on the disc")
    spread, middle = np.cov(points) + np.eye(2) / (3 * SIDE**2), points.mean(axis=1)
    values, vectors = np.linalg.eigh(spread)
    turn = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    turn = float((turn + 45) % 90 - 45) if values[1] > 1.05 * values[0] else 0.0
    outlines = [
        _outline("ellipse of the lobe", "truth", middle, vectors * np.sqrt(values)),
        _outline("along the axes", "model", middle, np.diag(np.sqrt(np.diag(spread)))),
    ]
    aspect = float(np.sqrt(values[1] / values[0]))
    says = f"Where it is half as high as its peak, the lobe is {aspect:.2f} times as long as wide, and turned by "
    return {
        "curves": [],
        "axes": {},
        "disc": {"picture": array(lobe.T), "outlines": outlines},
        "says": f"{says}{turn:.1f}\N{DEGREE SIGN} from the axes of the roughness.",
    }


def _outline(label: str, kind: str, middle: Any, axes: Any) -> dict[str, Any]:
    """An ellipse that is evenly filled with these standard deviations along its axes (columns)."""
    t = np.radians(np.arange(0, 360, 5.0))
    points = middle[:, None] + 2 * axes @ np.stack([np.cos(t), np.sin(t)])
    return {"label": label, "kind": kind, "points": points.T.tolist()}


def pairs(alpha_u: float, alpha_v: float, body: Body) -> Answer:
    """The material with other roughnesses of one interface, on a sphere, by its model and by random walks.

    Weier & Belcour 2020, sections 4.1 and 5. `pictures`: RGB to be shown (h, w, 3) by `model` and `truth`; `rmse`
    between them, freed of noise, and its standard `error`.
    """
    from velatura.figures.canvas import rmse
    from velatura.scenes import tone_map

    stack, layer = chosen_interface(body)
    changed = stack.replace(**{f"layer{layer}_alpha_u": alpha_u, f"layer{layer}_alpha_v": alpha_v})
    model = model_of(body)
    truth = _rendered(range(PASSES), changed, "reference", microsurface=model.microsurface)
    modelled = _rendered(range(PASSES, 2 * PASSES), changed, model)
    missed, error = rmse(modelled, truth)
    return {
        "curves": [],
        "axes": {},
        "pictures": {
            name: array(np.round(255 * tone_map(passes.mean(axis=0))), "uint8")
            for name, passes in (("model", modelled), ("truth", truth))
        },
        "rmse": missed,
        "error": error,
        "says": f"Root mean square difference {missed:.4f} \N{PLUS-MINUS SIGN} {error:.4f}.",
    }


@kernel.exclusive
def _rendered(seeds: Iterable[int], stack: Stack, model: Any, **switches: Any) -> Any:
    """A sphere in the studio in passes of these seeds, (passes, h, w, 3)."""
    from velatura import scenes
    from velatura.api import bsdf

    made = bsdf(stack, model, **switches)
    return np.array([scenes.render(made, "sphere", "studio", SPP, (SIZE, SIZE), seed) for seed in seeds])


_BRUSHED = {"alpha_u": alpha_slider("roughness along x", 0.05), "alpha_v": alpha_slider("roughness along y", 0.3)}
_AZIMUTH = Slider("azimuth from x, degrees", 0, 180, 45)

PAGES: dict[str, Validation] = {
    "fetch": Validation(
        "Anisotropic fetch",
        "What a brushed interface reflects on average, by Schlick's Fresnel. Tables hold round interfaces only: the "
        "paper looks the lower roughness up, for a direction that the other one stretches; averaged takes several.",
        {"reflectance": Slider("reflectance at normal incidence", 0.001, 0.98, 0.04), **_BRUSHED, "azimuth": _AZIMUTH},
        fetch,
        "interface",
    ),
    "aligned": Validation(
        "Anisotropic lobe",
        "The lobe of a brushed mirror on the projected disc. The model adds up variances along the axes of the "
        "roughness, as if every lobe were an ellipse along them: so it is but towards grazing angles.",
        {**_BRUSHED, "angle": Slider("angle of incidence, degrees", 0, 85, 45), "azimuth": _AZIMUTH},
        aligned,
        "interface",
    ),
    "pairs": Validation(
        "Roughness pairs",
        "The material on a sphere with pairs of roughnesses of one interface: left the random walk, right the model.",
        dict(_BRUSHED),
        pairs,
        "pairs",
    ),
}
