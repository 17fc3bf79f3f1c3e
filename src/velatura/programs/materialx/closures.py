"""Surfaces of MaterialX that are graphs of closures, those of pbrlib and Lama's: layers are stacks, and mixes mixtures.

What generators of code weigh by albedos are layers here: a closure over another is an interface above it, of its own
index, and light passes between them as optics has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from velatura import files
from velatura.errors import InvalidInput
from velatura.programs import parts
from velatura.programs.given import ROUNDING, Given
from velatura.programs.imported import Notes
from velatura.programs.metals import of_edge_tint, of_f82_tint
from velatura.programs.mixture import Share, beside
from velatura.programs.parameters import Input
from velatura.programs.surface import INDICES
from velatura.programs.to_stack import NOTHING
from velatura.programs.values import Value, changed, colour, listed, rounded
from velatura.programs.xml import Element
from velatura.stack import RGB, Described, Diffuse, Film, Interface, Layer, Medium, Mix, Stack, Texture

SURFACES = ("surface", "LamaSurface")
DEEPEST = 64  # closures within each other
DARKEST = 1e-4  # transmittance in place of a smaller one
BRIGHTEST = 0.95  # reflectance of a dielectric at the normal
BLACK = Stack([Diffuse(albedo=0.0)])
DEFAULT_METAL = {"ior": (0.183, 0.421, 1.373), "extinction": (3.424, 2.346, 1.770)}
LAMA_METAL = {"IOR": (0.18, 0.42, 1.37), "extinction": (3.42, 2.35, 1.77)}


@dataclass(frozen=True)
class Closures:
    """The closures of one material.

    value: of an input, in the terms of a parameter; node: that an input is connected to; where: the file.
    thin: whether there is no inside below a closure that light passes.
    """

    value: Callable[[Element, str], Value]
    node: Callable[[Element], Element]
    where: str
    notes: Notes
    thin: bool = False

    def over(self, closure: Element, below: Described | None, depth: float = 0.0, deep: int = 0) -> Described:
        """A closure over a material, or over nothing; `depth` is that of a medium between them.

        Raises:
            InvalidInput: an unknown node, or one that no stack has the light of.
        """
        if deep > DEEPEST:
            raise InvalidInput(f"more than {DEEPEST} closures within each other, or a cycle of nodes")
        with files.budget() as left:
            left.spend(self.where, "nodes")
        given = {each.name: each for each in closure.of("input")}

        def at(*names: str) -> Element:
            """The closure of the first input that is there."""
            name = next((each for each in names if each in given), None)
            if name is None:
                raise InvalidInput(f"the node {closure.name} lacks {names[0]}")
            return self.node(given[name])

        def within(inner: Element, base: Described | None, thickness: float = depth) -> Described:
            return self.over(inner, base, thickness, deep + 1)

        match closure.tag:
            case "layer":
                inner = at("base")
                if inner.tag in ("absorption_vdf", "anisotropic_vdf"):
                    self.notes.add(f"{closure.name}: base", inner.name, "a medium fills a shape: left out")
                    return within(at("top"), below)
                return within(at("top"), within(inner, below, 0.0))
            case "LamaLayer":
                base, top = within(at("materialBase"), below, 0.0), at("materialTop")
                thickness = self.number(given, "topThickness", 0.0)
                return beside(self.share(given, "topMix"), within(top, base, thickness), base, self.notes)
            case "mix" | "LamaMix":
                share = self.share(given, "mix", 0.0)  # of the foreground, and of the second material
                first, second = (within(at(*names), below) for names in (("fg", "material2"), ("bg", "material1")))
                return beside(share, first, second, self.notes)
            case "multiply":
                found, factor = within(at("in1"), below), self.read(given, "in2", 1.0)
                if isinstance(factor, tuple):
                    return _filtered(found, factor)
                return beside(self.share(given, "in2"), found, below or BLACK, self.notes)
            case "sheen_bsdf" | "LamaSheen":
                self.notes.add(closure.name, closure.tag, parts.FIBRES)
                return below or BLACK
            case tag if tag in CLOSURES:
                return CLOSURES[tag](self, closure, given, below, depth)
        raise InvalidInput(f"the node {closure.name} ({closure.tag}) is none of {', '.join(KNOWN)}")

    # Values of inputs ------------------------------------------------------------------------------------------------

    def read(self, given: Mapping[str, Element], name: str, default: Any) -> Any:
        """The value of an input; the default without it."""
        return self.value(given[name], name) if name in given else default

    def number(self, given: Mapping[str, Element], name: str, default: float) -> float:
        """One number; the mean of an image, which is listed."""
        found = self.read(given, name, default)
        return Given({name: found}, (Input(name, default, -np.inf, np.inf),), {}, self.notes).number(name)

    def colour(self, given: Mapping[str, Element], name: str, default: Any) -> Any:
        """A colour; the mean of an image, which is listed."""
        found = self.read(given, name, default)
        return Given({name: found}, (Input(name, default, 0.0, np.inf),), {}, self.notes).colour(name)

    def share(self, given: Mapping[str, Element], name: str, default: float = 1.0) -> Share:
        """A share of the surface."""
        return Given({name: self.read(given, name, default)}, (Input(name, default),), {}, self.notes).share(name)

    def alpha(self, given: Mapping[str, Element]) -> dict[str, Any]:
        """Roughness of facets along two axes, and their rotation, as an interface has them."""
        turn = self.number(given, "tangent", 0.0)
        u: Value = 0.05
        v: Value = 0.05
        if "roughness" in given:
            entry = given["roughness"]
            if len(pair := listed(entry.get("value") or "")) == 2:
                u, v = pair
            else:
                node = self.node(entry)
                if node.tag != "roughness_anisotropy":
                    raise InvalidInput(f"the node {node.name} ({node.tag}) is no roughness that is read")
                inside = {each.name: each for each in node.of("input")}
                aspect = float(np.sqrt(1 - np.clip(self.number(inside, "anisotropy", 0.0), 0, 0.98)))
                rough = self.read(inside, "roughness", 0.0)
                u, v = parts.alphas(rough, lambda r: (r * r / aspect, r * r * aspect))
        return _facets(u, v, turn)

    def lama_alpha(self, given: Mapping[str, Element], turn: str) -> dict[str, Any]:
        """The same of a node of Lama, whose second axis is rougher by its anisotropy, or smoother."""
        more = self.number(given, "anisotropy", 0.0)
        rough = self.read(given, "roughness", 0.1)
        second = (lambda r: r + more * (1 - r)) if more >= 0 else (lambda r: r + more * r)
        u, v = parts.alphas(rough, lambda r: (r**2, second(r) ** 2))
        return _facets(u, v, -360.0 * self.number(given, turn, 0.0))

    def indices(self, given: Mapping[str, Element], name: str, default: RGB) -> RGB:
        """Index or extinction of a metal, also by a node of its reflectance and the tint of its edge."""
        if name in given and given[name].get("nodename"):
            node = self.node(given[name])
            if node.tag == "artistic_ior":
                inside = {each.name: each for each in node.of("input")}
                both = (("reflectivity", (0.944, 0.776, 0.373)), ("edge_color", (0.998, 0.981, 0.751)))
                index = of_edge_tint(*(np.clip(self.colour(inside, *each), 0, 1) for each in both))
                return _rgb(index[name == "extinction"])
        return _rgb(self.colour(given, name, default))

    def films(self, given: Mapping[str, Element]) -> dict[str, Any]:
        """A thin film of an interface."""
        thickness = self.read(given, "thinfilm_thickness", 0.0)
        if thickness == 0:
            return {}
        return {"films": (Film(eta=self.number(given, "thinfilm_ior", 1.5), thickness_nm=thickness),)}

    def passing(self, top: Interface, below: list[Layer]) -> Stack:
        """A stack that light passes, with its other side, if that is there."""
        if not self.thin:
            return Stack([top, *below, Interface(eta=top.eta, alpha=0.0)] if below else [top])
        return Stack([top, *below, top.model_copy(update={"eta": 1.0, "films": ()})], thin=True)

    def unfiltered(self, closure: Element, given: Mapping[str, Element], *names: str) -> None:
        """Note tints of facets, which no interface has."""
        for name in names:
            if min(self.colour(given, name, (1.0, 1.0, 1.0))) < 1 - ROUNDING:
                self.notes.add(f"{closure.name}: {name}", given[name].get("value"), "facets have no tint: left out")


# Closures ------------------------------------------------------------------------------------------------------------

Inputs = Mapping[str, Element]


def _dielectric(self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float) -> Described:
    self.unfiltered(closure, given, "tint")
    top = Interface(eta=_index(self.number(given, "ior", 1.5)), **self.alpha(given), **self.films(given))
    made = self.passing(top, []) if below is None and _passes(given) else _covered(below or BLACK, [top], self.notes)
    return beside(self.share(given, "weight"), made, below or BLACK, self.notes)


def _conductor(self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float) -> Described:
    index = {name: self.indices(given, name, default) for name, default in DEFAULT_METAL.items()}
    metal = Interface(eta=index["ior"], k=index["extinction"], **self.alpha(given), **self.films(given))
    return beside(self.share(given, "weight"), Stack([metal]), below or BLACK, self.notes)


def _schlick(self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float) -> Described:
    """A metal of these colours at the normal and the edge; over a base, or where light passes, a dielectric."""
    self.unfiltered(closure, given, "color90")
    colour = np.array(self.colour(given, "color0", (1.0, 1.0, 1.0)))
    facets = {**self.alpha(given), **self.films(given)}
    if below is None and not _passes(given):
        n, k = of_f82_tint(colour, np.array(self.colour(given, "color82", (1.0, 1.0, 1.0))))
        made: Described = Stack([Interface(eta=_rgb(n), k=_rgb(k), **facets)])
    else:
        top = Interface(eta=_of_reflectance(colour), **facets)
        made = self.passing(top, []) if below is None else _covered(below, [top], self.notes)
    return beside(self.share(given, "weight"), made, below or BLACK, self.notes)


def _diffuse(self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float) -> Described:
    if closure.tag in ("subsurface_bsdf", "LamaSSS"):
        self.notes.add(closure.name, closure.tag, parts.BELOW)
    elif self.number(given, "roughness", 0.0):
        self.notes.add(f"{closure.name}: roughness", given["roughness"].get("value"), parts.LAMBERTIAN)
    albedo = changed(self.read(given, "color", (0.18, 0.18, 0.18)), lambda c: np.clip(c, 0, 1))
    return beside(self.share(given, "weight"), Stack([Diffuse(albedo=albedo)]), below or BLACK, self.notes)


def _lama_dielectric(
    self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float
) -> Described:
    """An interface, and the medium below it, by the colour of light after the radius of absorption."""
    self.unfiltered(closure, given, "reflectionTint", "transmissionTint")
    if max(self.colour(given, "scatterColor", (0.0, 0.0, 0.0))) > 0:
        self.notes.add(f"{closure.name}: scatterColor", given["scatterColor"].get("value"), "has no radius: left out")
    scientific = self.number(given, "fresnelMode", 0.0) == 1
    eta = self.number(given, "IOR", 1.5) if scientific else _of_reflectance(self.number(given, "reflectivity", 0.04))
    top = Interface(eta=_index(eta), **self.lama_alpha(given, "rotation"))
    left = np.clip(self.colour(given, "absorptionColor", (1.0, 1.0, 1.0)), DARKEST, 1)
    absorbed = -np.log(left) / max(self.number(given, "absorptionRadius", 1.0), 1e-6)
    medium: list[Layer] = [Medium(depth=depth, sigma_a=_rgb(absorbed))] if depth > 0 and absorbed.max() > 0 else []
    return _covered(below, [top, *medium], self.notes) if below is not None else self.passing(top, medium)


def _lama_conductor(
    self: Closures, closure: Element, given: Inputs, below: Described | None, depth: float
) -> Described:
    self.unfiltered(closure, given, "tint")
    if self.number(given, "fresnelMode", 0.0) == 1:
        n, k = (np.array(self.colour(given, name, default)) for name, default in LAMA_METAL.items())
    else:
        colours = {"reflectivity": (0.945, 0.7772, 0.3737), "edgeColor": (0.7137, 0.7373, 0.455)}
        n, k = of_edge_tint(*(np.clip(self.colour(given, *each), 0, 1) for each in colours.items()))
    return Stack([Interface(eta=_rgb(n), k=_rgb(k), **self.lama_alpha(given, "anisotropyRotation"))])


Made = Callable[[Closures, Element, Inputs, "Described | None", float], Described]
CLOSURES: dict[str, Made] = {
    "dielectric_bsdf": _dielectric,
    "conductor_bsdf": _conductor,
    "generalized_schlick_bsdf": _schlick,
    **dict.fromkeys(
        ("oren_nayar_diffuse_bsdf", "burley_diffuse_bsdf", "subsurface_bsdf", "LamaDiffuse", "LamaSSS"), _diffuse
    ),
    "LamaDielectric": _lama_dielectric,
    "LamaConductor": _lama_conductor,
}
KNOWN = ("layer", "mix", "multiply", "sheen_bsdf", "LamaLayer", "LamaMix", "LamaSheen", *CLOSURES)


def material(closures: Closures, surface: Element) -> Described:
    """The stack or mixture of a surface.

    Raises:
        InvalidInput: as `Closures.over`.
    """
    given = {each.name: each for each in surface.of("input")}
    lama = surface.tag == "LamaSurface"
    name, cover = ("materialFront", "presence") if lama else ("bsdf", "opacity")
    for other, why in (("edf", parts.LIGHT), ("materialBack", "both sides are alike: left out")):
        if other in given and given[other].get("nodename"):
            closures.notes.add(other, given[other].get("nodename"), why)
    if name not in given:
        raise InvalidInput(f"its surface {surface.name} lacks {name}")
    thin = not lama and closures.number(given, "thin_walled", 0.0) > 0
    found = replace(closures, thin=thin).over(closures.node(given[name]), None)
    return beside(closures.share(given, cover), found, NOTHING, closures.notes)


# Stacks --------------------------------------------------------------------------------------------------------------


def _mapped(material: Described, change: Callable[[Stack], Stack]) -> Described:
    """A material with all its stacks changed."""
    if isinstance(material, Stack):
        return change(material)
    return Mix([(part.weight, _mapped(part.material, change)) for part in material.mix], name=material.name)


def _covered(below: Described, layers: Sequence[Layer], notes: Notes) -> Described:
    """A material below other layers. Where these have the index of its first interface, there is none."""
    outside = next(each.eta for each in layers if isinstance(each, Interface))

    def cover(stack: Stack) -> Stack:
        first, *rest = stack.layers
        if isinstance(first, Interface) and first.k is None and first.eta == outside and not first.films and rest:
            notes.add("layers", f"index {outside}", "two interfaces of one index: the inner one has no step")
            return stack.with_layers([*layers, *rest])
        return stack.with_layers([*layers, *stack.layers])

    return _mapped(below, cover)


def _filtered(below: Described, colour: RGB) -> Described:
    """A material by a factor on its light: that of a diffuse base, or of two crossings of a medium above others."""

    def filtered(stack: Stack) -> Stack:
        if isinstance(stack.layers[0], Diffuse):
            return stack.with_layers([Diffuse(albedo=_product(stack.layers[0].albedo, colour))])
        sigma_a = 0.5 * np.log(1 / np.clip(colour, DARKEST, 1))
        return stack.with_layers([Medium(depth=1.0, sigma_a=_rgb(sigma_a)), *stack.layers])

    return _mapped(below, filtered)


def _product(albedo: Any, colour: RGB) -> Any:
    """An albedo by a colour; an image by its mean."""
    if isinstance(albedo, Texture):
        return changed(albedo, lambda a: a * float(np.mean(colour)))
    return _rgb(np.clip(np.multiply(albedo, colour), 0, 1))


def _facets(u: Value, v: Value, turn: float) -> dict[str, Any]:
    return {"alpha": u} if u == v else {"alpha": (u, v), "rotation": turn}


def _passes(given: Inputs) -> bool:
    """Whether a closure transmits light by its mode."""
    return "T" in ((given["scatter_mode"].get("value") if "scatter_mode" in given else None) or "R")


def _index(eta: Any) -> Any:
    """An index that stacks take."""
    return rounded(float(np.clip(eta, *INDICES)))


def _of_reflectance(f_0: Any) -> Any:
    """The index of a dielectric of a reflectance at the normal, one for all colours where these are alike."""
    root = np.sqrt(np.clip(f_0, 0, BRIGHTEST))
    eta = (1 + root) / (1 - root)
    return rounded(float(np.mean(eta))) if np.ptp(eta) < 1e-6 else _rgb(eta)


def _rgb(values: Any) -> RGB:
    return colour(tuple(np.broadcast_to(np.asarray(values, float), 3).tolist()))
