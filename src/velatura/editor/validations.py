"""The model's assumptions beside the reference: the interactive validations of the papers' supplements, as numbers.

Each answers sliders with curves: those of kind `truth` are counted from random walks or evenly spread samples, with
standard errors, those of kind `model` are the approximations of the recursion. Lobes are shown as densities across
the projected disc: over the sine of the outgoing angle in the plane of incidence, summed over the directions beside
that plane.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.editor.brushed_validations import PAGES, numbers_of
from velatura.editor.messages import Answer, Body, Verb
from velatura.editor.validation_page import Slider, Validation, alpha_slider, answer_of, axis_of, curve_of, in_words
from velatura.errors import InvalidInput
from velatura.stack import Interface, Medium, Stack
from velatura.stack.schema import show, unknown

Light = tuple[NDArray[Any], NDArray[Any]]  # directions (3, n), turned up, and their energies (n,)

PATHS = 20_000  # random walks of an answer, so that it takes a fraction of a second
SAMPLES = 2**15  # evenly spread ones
BINS = 64  # across the disc
SMOOTH = 1e-3  # samples a roughness of 0


def listed(body: Body) -> Answer:
    """All `validations`: `name`, `title`, `doc`, `of` (`Validation`), and `sliders` by name, each with `doc`, `low`,
    `high`, `default`."""
    return {"validations": [{"name": name, **_listed(page)} for name, page in VALIDATIONS.items()]}


def _listed(page: Validation) -> Answer:
    sliders = {key: asdict(slider) for key, slider in page.sliders.items()}
    return {"title": page.title, "doc": page.doc, "of": page.of, "sliders": sliders}


def validation(body: Body) -> Answer:
    """The answer of the validation `name` to `parameters`, those left out at their defaults.

    Where a page may take them from an interface, those of `layer` of `material` are the defaults, within the ranges of
    the sliders. The answer has the `parameters` that it is of, and `curves` of `label`, `kind` (truth or model), `x`,
    `y` and, where they are counted, standard `error`; `axes` x and y with `label`, `low`, `high` (None: fitted);
    `says`, the numbers in words.

    Raises:
        InvalidInput: an unknown validation or parameter, or a parameter outside its range.
        MissingTool: LLVM is missing or too old, where random walks are needed.
    """
    name, given = body.get("name"), body.get("parameters") or {}
    if name not in VALIDATIONS:
        raise InvalidInput(f"name: {unknown('validation', name, VALIDATIONS)}")
    chosen = VALIDATIONS[str(name)]
    values = {key: slider.default for key, slider in chosen.sliders.items()}
    if chosen.of == "interface" and body.get("layer") is not None:
        taken = {key: value for key, value in numbers_of(body).items() if key in values}
        ranges = {key: (chosen.sliders[key].low, chosen.sliders[key].high) for key in taken}
        values |= {key: min(max(value, ranges[key][0]), ranges[key][1]) for key, value in taken.items()}
    for key, value in given.items():
        if key not in values:
            raise InvalidInput(f"{name}: {unknown('parameter', key, values)}")
        low, high = chosen.sliders[key].low, chosen.sliders[key].high
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise InvalidInput(f"{name}: {key}: must be a number in {low:g} to {high:g}, got {show(value)}")
        values[key] = float(value)
    found = chosen.answer(**values, body=body) if chosen.of == "pairs" else chosen.answer(**values)
    return {**found, "parameters": values}


# The five pages of Belcour 2018


def reflection(alpha_1: float, alpha_2: float, angle: float) -> dict[str, Any]:
    """Two rough mirrors that face each other, beside the one that is as rough as a map adds them up.

    Belcour 2018, Eq. 5.
    """
    from velatura.figures.bounces import along, bounce, uniform
    from velatura.model.roughness_maps import MAPS

    u = uniform(SAMPLES)
    first, second = max(alpha_1, SMOOTH), max(alpha_2, SMOOTH)
    sine = np.sin(np.radians(angle))
    twice = bounce(bounce(along(_direction(sine), SAMPLES), first, first, *u[:2]), second, second, *u[2:])
    curves, alphas = [_shape("two bounces", twice)], {"two bounces": _equivalent(sine, twice)}
    for name in ("belcour", "weier"):
        f = MAPS[name]
        alphas[name] = float(f.roughness(np.float64(f.variance(alpha_1) + f.variance(alpha_2))))
        curves.append(_shape(f"one of {name}'s map", _lobe(sine, alphas[name]), "model"))
    return answer_of(curves, _ACROSS, f"Equivalent alpha: {in_words(alphas)}.")


def transmission(eta: float, alpha: float, angle: float) -> dict[str, Any]:
    """Light through a rough interface, beside the reflection that stands for it.

    Belcour 2018, Eq. 10.
    """
    from velatura.model.registry import stack_lobes

    stack = Stack([Interface(eta=eta, alpha=alpha)])
    sine = np.sin(np.radians(angle))
    refracted = sine / eta
    _, through = _walk(stack, sine)
    curves, alphas = [_shape("random walk", through)], {"random walk": _equivalent(refracted, through)}
    for label, (model, switches) in _compared(scale="angles").items():
        lobe = stack_lobes(stack, np.cos(np.radians(angle)), model=model, **switches).transmitted
        assert lobe is not None
        alphas[label] = float(lobe.alpha[0, 0])
        curves.append(_shape(label, _lobe(refracted, alphas[label]), "model"))
    return answer_of(curves, _ACROSS, f"Equivalent alpha of the transmitted lobe: {in_words(alphas)}.")


def absorption(depth: float, alpha: float, angle: float) -> dict[str, Any]:
    """A rough mirror below an absorbing slab, beside the mirror's lobe that is dimmed as a whole.

    Belcour 2018, Eqs. 15-17.
    """
    from velatura.model.registry import stack_lobes

    stack = Stack([Medium(sigma_a=depth), Interface(conductor="mirror", alpha=alpha)])
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    light, _ = _walk(stack, sine)
    energies, alphas = {"random walk": _energy(light)}, {"random walk": _equivalent(sine, light)}
    curves = [_density("random walk", light, PATHS)]
    for model in ("belcour2018", "velatura"):
        found = stack_lobes(stack, cosine, model=model, reflectance="fgd")
        energies[model], alphas[model] = float(found.energy[0][0, 0]), float(found.alpha[0][0, 0])
        lobe = _lobe(sine, alphas[model])
        curves.append(_density(model, lobe, _total(lobe) / energies[model], "model"))
    says = f"Energy: {in_words(energies)}. Equivalent alpha: {in_words(alphas)}."
    return answer_of(curves, {**_ACROSS, "y": axis_of("energy across the disc")}, says)


def scattering(depth: float, g: float, angle: float) -> dict[str, Any]:
    """A slab that scatters, by how far it turns the light that comes through, beside one lobe for it.

    Belcour 2018, Eq. 21.
    """
    from velatura.model.registry import stack_lobes

    stack = Stack([Medium(sigma_s=depth, g=g), Interface(eta=1.0)])
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    _, through = _walk(stack, sine)
    curves = [_within("random walk", sine, through)]
    energies = {"random walk": _energy(through)}
    for label, (model, switches) in _compared(medium="weighted").items():
        lobe = stack_lobes(stack, cosine, model=model, **switches).transmitted
        assert lobe is not None
        energies[label] = float(lobe.energy[0, 0])
        curves.append(_within(label, sine, _lobe(sine, float(lobe.alpha[0, 0])), "model"))
    axes = {
        "x": axis_of("turned by less than (\N{DEGREE SIGN})", 0, 90),
        "y": axis_of("share of what comes through", 0, 1),
    }
    return answer_of(curves, axes, f"Energy that comes through: {in_words(energies)}.")


def decoupling(eta: float, alpha: float) -> dict[str, Any]:
    """Light of a rough mirror that leaves through a smooth coat, beside TIR times the mean direction's.

    Belcour 2018, Eq. 33.
    """
    from velatura import tables
    from velatura.figures.bounces import along, bounce, uniform
    from velatura.optics import fresnel

    u, angles = uniform(SAMPLES), np.arange(0, 90, 3.0)
    inside = np.sqrt(1 - (np.sin(np.radians(angles)) / eta) ** 2)
    rough = max(alpha, SMOOTH)
    leaves = []
    for cosine in inside:
        (_, _, z), energy = bounce(along(_direction(float(np.sqrt(1 - cosine**2))), SAMPLES), rough, rough, *u[:2])
        leaves.append(np.average(1 - fresnel.dielectric(np.clip(z, 0, 1), 1 / eta), weights=energy))
    straight = 1 - fresnel.dielectric(inside, 1 / eta)
    share = {"off": np.ones_like(inside)}
    for form in ("published", "clean"):
        share[form] = np.asarray(tables.tir(tables.load(), form, np.float64(1 / eta), inside, np.float64(alpha)))
    curves = [curve_of("integral", "truth", angles, leaves)]
    curves += [curve_of(f"tir={form}", "model", angles, straight * kept) for form, kept in share.items()]
    energies = {curve["label"]: curve["y"][0] for curve in curves}
    axes = {"x": axis_of("angle of incidence (\N{DEGREE SIGN})", 0, 90), "y": axis_of("share that leaves", 0, 1)}
    return answer_of(curves, axes, f"At normal incidence: {in_words(energies)}.")


def _compared(**switches: Any) -> dict[str, tuple[str, dict[str, Any]]]:
    """Models by label: the paper's, as published and with a switch turned, and ours."""
    changed = ", ".join(f"{key}={value}" for key, value in switches.items())
    return {"belcour2018": ("belcour2018", {}), changed: ("belcour2018", switches), "velatura": ("velatura", {})}


# Light and its widths


def _direction(sine: float) -> tuple[float, float, float]:
    return float(sine), 0.0, float(np.sqrt(1 - sine * sine))


def _lobe(sine: float, alpha: float) -> Light:
    """The lobe of a mirror of this roughness, for light whose mirror direction has this sine."""
    from velatura.figures.bounces import along, bounce, uniform

    rough = max(alpha, SMOOTH)
    return bounce(along(_direction(-sine), SAMPLES), rough, rough, *uniform(SAMPLES)[:2])


def _walk(stack: Stack, sine: float) -> tuple[Light, Light]:
    """Light that random walks reflect, and light that they transmit, turned up."""
    from velatura.reference.batches import ends

    found = ends(stack, np.array(_direction(-sine)), PATHS, 0, False)
    up, weight = found.w[2] > 0, found.weight.mean(axis=0)
    x, y, z = found.w
    return tuple((np.stack([x, y, abs(z)])[:, side], weight[side]) for side in (up, ~up))  # type: ignore[return-value]


def _total(light: Light) -> float:
    return float(light[1].sum(dtype=float))


def _energy(light: Light) -> float:
    return _total(light) / PATHS


def _equivalent(sine: float, light: Light) -> float:
    """The roughness of the mirror whose lobe about such a direction is as wide."""
    from velatura.reference import roughness

    wi = np.array(_direction(-sine))
    target, _ = roughness.medians(roughness.slopes(wi, light[0]), light[1], True)
    return float(roughness.matching(wi, target, True)[0])


# Curves


def _shape(label: str, light: Light, kind: str = "truth") -> dict[str, Any]:
    return _density(label, light, _total(light), kind)


def _density(label: str, light: Light, whole: float, kind: str = "truth") -> dict[str, Any]:
    """Energy per sine across the disc, of light of which `whole` is 1."""
    (x, _, _), weight = light
    edges = np.linspace(-1, 1, BINS + 1)
    scale = BINS / (2 * max(whole, 1e-9))
    counted, squared = (np.histogram(x, edges, weights=w)[0] for w in (weight, weight**2))
    error = scale * np.sqrt(squared) if kind == "truth" else None
    return curve_of(label, kind, (edges[1:] + edges[:-1]) / 2, scale * counted, error)


def _within(label: str, sine: float, light: Light, kind: str = "truth") -> dict[str, Any]:
    """The share of light that is turned by less than an angle."""
    from velatura.optics import ggx

    x, y, z = light[0]
    turned = np.degrees(np.arccos(np.clip(ggx.dot((x, y, z), _direction(sine)), -1, 1)))
    angles = np.arange(0, 91, 2.0)
    share = np.array([light[1][turned <= angle + 1e-2].sum() for angle in angles]) / max(_total(light), 1e-9)
    error = np.sqrt(np.maximum(share * (1 - share), 0) / max(len(turned), 1)) if kind == "truth" else None
    return curve_of(label, kind, angles, share, error)


_ACROSS = {"x": axis_of("sine of the outgoing angle", -1, 1), "y": axis_of("density across the disc")}
_ANGLE = Slider("angle of incidence, degrees", 0, 85, 30)


VALIDATIONS: dict[str, Validation] = {
    "reflection": Validation(
        "Reflection",
        "Two rough mirrors face each other. Roughness does not add up, but the variances that a map makes of it should:"
        " one mirror of their sum, as a GGX lobe, stands for both. Smooth mirrors add nothing.",
        {
            "alpha_1": alpha_slider("roughness of the first", 0.2),
            "alpha_2": alpha_slider("of the second", 0.3),
            "angle": _ANGLE,
        },
        reflection,
    ),
    "transmission": Validation(
        "Transmission scale",
        "A rough interface spreads transmitted light less than reflected light. The model treats it as the "
        "reflection of the refracted direction by a roughness that is scaled, by the cosines at normal incidence or by "
        "the real ones.",
        {"eta": Slider("relative index", 0.5, 3, 1.5), "alpha": alpha_slider("roughness", 0.3), "angle": _ANGLE},
        transmission,
    ),
    "absorption": Validation(
        "Absorption",
        "Steep ways through a medium are shorter, so that absorption also moves and narrows a lobe. The model dims it "
        "as a whole, by the way of its mean direction.",
        {"depth": Slider("optical depth", 0, 4, 0.5), "alpha": alpha_slider("roughness of the mirror below", 0.3)}
        | {"angle": _ANGLE},
        absorption,
    ),
    "scattering": Validation(
        "Scattering",
        "A medium scatters by the phase function of Henyey and Greenstein, and lets the rest pass straight on. The "
        "model takes one lobe for both, of a width that depends on g and, but for the shipped form, on the depth.",
        {"depth": Slider("optical depth", 0, 4, 0.5), "g": Slider("mean cosine of scattering", 0.05, 0.98, 0.9)}
        | {"angle": _ANGLE},
        scattering,
    ),
    "tir": Validation(
        "Total internal reflection",
        "Of the light that a rough mirror scatters below a smooth coat, some is totally reflected. The model multiplies"
        " what leaves in the mean direction by one number from a table: published as the mean of 1 - F, which counts "
        "Fresnel twice, or clean, as the energy within the critical cone.",
        {"eta": Slider("index of the coat", 1.05, 3, 1.5), "alpha": alpha_slider("roughness of the mirror", 0.3)},
        decoupling,
    ),
    **PAGES,
}

#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"validations": listed, "validation": validation}
