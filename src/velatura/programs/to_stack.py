"""The stacks that come nearest to the parts of a surface, as one material."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from velatura.model.registry import stack_lobes
from velatura.optics import fresnel
from velatura.programs.imported import Imported, Notes
from velatura.programs.metals import MOST, of_edge
from velatura.programs.mixture import beside
from velatura.programs.surface import WHITE, Alpha, Coat, Shares, Surface, weighed
from velatura.programs.values import Array, Value, changed, middle
from velatura.stack import RGB, Described, Diffuse, Film, Interface, Layer, Medium, Stack, Texture
from velatura.stack.coatings import STEP_MIN
from velatura.stack.values import THICKEST_NM, cleaned

SMOOTH = 1e-3  # roughness of a base that stands for one from a texture of roughness below it
DARKEST = 1e-4  # transmittance in place of a smaller one
NOTHING = Stack([Interface(eta=1.0, alpha=0.0)], name="nothing")  # lets all light through, unchanged


def imported(
    surface: Callable[[Shares], Surface], shares: Shares, notes: Notes, name: str = "", source: str = ""
) -> Imported:
    """The material nearest to a surface: a stack, or a mixture of those of its parts.

    surface: a part of it, by shares that are 0 or 1. What had to be changed is added to the notes.
    """
    if (plain := cleaned(name)) != name:
        notes.add("name", plain, "control characters are left out")

    def made(part: Shares) -> Described:
        """The stack of a part, or a mixture by the first share between 0 and 1."""
        if part.cover == 0:
            return NOTHING
        part = replace(part, clear=0.0) if part.metal == 1 else part
        for which, share in vars(part).items():
            if share not in (0, 1):
                there, other = (made(replace(part, **{which: whole})) for whole in (1.0, 0.0))
                return beside(share, there, other, notes)
        return _stack(surface(part), notes).model_copy(update={"name": _called(part, shares)})

    return Imported(made(shares).model_copy(update={"name": plain, "source": source}), notes.left)


def _called(part: Shares, whole: Shares) -> str:
    """The name of a part: its kind of base, and what sets it apart from other parts."""
    words = {"coat": ("uncoated", "coated"), "film": ("plain", "iridescent"), "clear": ("opaque", "clear")}
    if part.metal:
        del words["clear"]
    apart = [words[key][int(getattr(part, key))] for key in words if getattr(whole, key) not in (0, 1)]
    return " ".join([*apart, "metal" if part.metal else "dielectric"])


def _stack(surface: Surface, notes: Notes) -> Stack:
    coat = _coat(surface.coat)
    above = [layer for layer in coat if isinstance(layer, Interface)]
    outside = float(above[0].eta) if above else 1.0  # type: ignore[arg-type]
    if surface.metalness:
        base: list[Layer] = [_metal(surface, outside if above else None, notes)]
    else:
        base = [*_dielectric(surface, outside, notes)]
        if surface.clear:
            base = _clear(surface, base, outside)
        else:
            base.append(Diffuse(albedo=_diffuse(surface, above, base)))
    thin = bool(surface.pane and surface.clear and not surface.metalness)
    return Stack([*coat, *base], thin=thin)


def _facets(alpha: Alpha, rotation: float) -> dict[str, Any]:
    u, v = alpha
    return {"alpha": u} if u == v else {"alpha": (u, v), "rotation": rotation}


# Layers --------------------------------------------------------------------------------------------------------------


def _coat(coat: Coat) -> list[Layer]:
    """A coat's interface and, where it absorbs, its medium; none where it does nothing."""
    if abs(coat.eta - 1) < STEP_MIN and coat.colour == WHITE:
        return []
    layers: list[Layer] = [Interface(eta=coat.eta, **_facets(coat.alpha, coat.rotation))]
    return layers + _medium(coat.colour, 0.5)


def _medium(transmittance: Value, share: float = 1.0) -> list[Layer]:
    """A medium of that transmittance along the normal, or of a power of it; none where it is clear."""
    if transmittance == WHITE or transmittance == 1:
        return []
    return [Medium(depth=1.0, sigma_a=changed(transmittance, lambda t: share * np.log(1 / np.maximum(t, DARKEST))))]


def _metal(surface: Surface, outside: float | None, notes: Notes) -> Interface:
    """The metal; below a coat of index `outside`, with the reflectance that makes up for what the coat does.

    Light of a smooth metal that reflects r meets it again below a coat that reflects F: of what enters the coat,
    r (1 - F) / (1 - r F) comes out. For no darkening that is to be the reflectance in air.
    """
    tint, delta = np.array(surface.edge), surface.coat.darkening
    film = _film(surface, notes)
    if isinstance(surface.colour, Texture):
        tint = np.array(np.mean(tint))
        if np.ptp(surface.edge) > 1e-6:
            notes.add("colour towards the edge", surface.edge, "its mean stands for it beside an image")
        if film:
            notes.add("thin film", surface.film[1] if surface.film else "", "none over the index of an image")
            film = {}
    elif np.min(surface.colour) >= MOST and not film:
        return Interface(conductor="mirror", **_facets(surface.alpha, surface.rotation))

    def index(reflectance: Array) -> tuple[Array, Array]:
        n, k = surface.index(reflectance, tint)
        if outside is None or delta == 1:
            return n, k
        below = [np.asarray(fresnel.conductor(c, n / outside, k / outside)) for c in (1.0, fresnel.EDGE)]
        inside = float(fresnel.normal_incidence(outside))
        kept = [reflectance, np.asarray(fresnel.conductor(fresnel.EDGE, n, k))]
        kept = [r / (1 - inside + r * inside) for r in kept]
        r, edge = (there + delta * (here - there) for here, there in zip(below, kept))
        n, k = of_edge(r, edge)
        return n * outside, k * outside

    eta, k = (changed(surface.colour, lambda r, part=part: index(r)[part]) for part in (0, 1))  # type: ignore[misc]
    return Interface(eta=eta, k=k, **_facets(surface.alpha, surface.rotation), **film)


def _dielectric(surface: Surface, outside: float, notes: Notes) -> list[Interface]:
    """The interface of a dielectric base; none where it has no step of the index, unless a film lies on it."""
    film = _film(surface, notes)
    index = surface.eta * outside if surface.by_sight else surface.eta
    red, green, blue = (weighed(index, outside, weight) for weight in surface.specular)
    eta: float | RGB = red if red == green == blue else (red, green, blue)
    even = abs(float(np.mean(eta)) / outside - 1) < STEP_MIN
    if even and not film:
        return []
    if even and surface.alpha != (0.0, 0.0):
        notes.add("roughness", surface.alpha, "0 below a film between equal indices")
    facets = {} if even else _facets(surface.alpha, surface.rotation)
    return [Interface(eta=eta, **facets, **film)]


def _clear(surface: Surface, base: list[Layer], outside: float) -> list[Layer]:
    """A clear base: what lies below its interface. An interface without a step ends a tint, as no medium may be last.

    A pane has the outside below it.
    """
    base = base or [Interface(eta=outside, alpha=0.0)]
    eta, below = base[-1].eta, _medium(surface.tint)  # type: ignore[union-attr]
    if surface.pane and abs(float(np.mean(eta)) - 1) >= STEP_MIN:  # type: ignore[arg-type]
        return [*base, *below, Interface(eta=1.0, **_facets(surface.alpha, surface.rotation))]
    return [*base, *below, Interface(eta=float(np.mean(eta)), alpha=0.0)] if below else base  # type: ignore[arg-type]


def _film(surface: Surface, notes: Notes) -> dict[str, Any]:
    if surface.film is None:
        return {}
    eta, thickness_nm = surface.film
    if not isinstance(thickness_nm, Texture):
        thickness_nm = float(np.mean(thickness_nm))
    if not isinstance(thickness_nm, Texture) and thickness_nm > THICKEST_NM:
        notes.add("thin film", thickness_nm, f"beyond {THICKEST_NM:g} nm, where it has no colour: left out")
        return {}
    return {"films": (Film(eta=eta, thickness_nm=thickness_nm),)}


# Colours of what lies below an interface -----------------------------------------------------------------------------


def _diffuse(surface: Surface, above: list[Interface], base: list[Layer]) -> Value:
    """The albedo of the diffuse base that gives the colour seen.

    Of the light that enters, (1 - K) rho / (1 - K rho) leaves, with K the share that interfaces send back down. The
    colour is that share for the base below air, or below the medium of a coat, at the normal (OpenPBR 1.1,
    "Glossy-diffuse"): light that bounces in a coat then darkens it, as over a Lambertian base of this colour ("Coat,
    Darkening"). Under a coat that does not darken, what the base adds in air shall be added to what the coat reflects;
    between the two, rho is mixed.
    """
    covers = [_plain(each) for each in base if isinstance(each, Interface)]
    outside = float(above[0].eta) if above else 1.0  # type: ignore[arg-type]
    _, kept = _above_diffuse(covers, outside)
    delta = surface.coat.darkening if above else 1.0
    if delta == 1:
        return changed(surface.colour, lambda seen: _inside(seen, kept))
    reflected, _ = _above_diffuse([_plain(each) for each in _dielectric(surface, 1.0, Notes())])
    whole, sent_back = _above_diffuse([*(_plain(each) for each in above), *covers])
    coat = float(fresnel.normal_incidence(outside))

    def mixed(seen: Array) -> Array:
        shown = coat + (1 - coat) * (reflected + (1 - reflected) * seen)
        plain = _inside((shown - whole) / (1 - whole), sent_back)
        return np.asarray(plain + delta * (_inside(seen, kept) - plain))

    return changed(surface.colour, mixed)


def _inside(left: Array, kept: float) -> Array:
    """The albedo of a diffuse base, by the share of the light that enters it which leaves again."""
    left = np.clip(left, 0, 1)
    return np.asarray(left / (1 - kept + left * kept))


def _above_diffuse(layers: list[Interface], outside: float = 1.0) -> tuple[float, float]:
    """Reflectance at the normal of interfaces below a medium, over a black base, and the share K of light from a
    diffuse one that they send back down."""
    if not layers:
        return 0.0, 0.0

    def total(albedo: float) -> float:
        found = stack_lobes(Stack([*layers, Diffuse(albedo=albedo)], exterior=outside), 1.0)
        return float(np.mean(np.sum([energy[:, 0] for energy in found.energy], axis=0) + found.remainder[:, 0]))

    black = total(0.0)
    share = (total(0.5) - black) / (1 - black)
    return black, float(np.clip((1 - 2 * share) / (1 - share), 0, 1))


def _plain(layer: Interface) -> Interface:
    """The interface with numbers in place of images, without films."""
    u, v = layer.alpha if isinstance(layer.alpha, tuple) else (layer.alpha, layer.alpha)
    alpha = tuple(max(middle(each), SMOOTH) if isinstance(each, Texture) else each for each in (u, v))
    return layer.model_copy(update={"alpha": alpha[0] if alpha[0] == alpha[1] else alpha, "films": ()})
