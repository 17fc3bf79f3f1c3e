"""Statistics of the lobes of a material that is solved as a whole, in NumPy."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from velatura import tables
from velatura.model.base import Model
from velatura.model.lobe_statistics import LobeStatistics, StackLobes, nearer_axis, with_axes_named
from velatura.model.rotation_frame import Frame
from velatura.model.rough_interface import Facets
from velatura.model.roughness_maps import MAPS
from velatura.model.solved import equivalent_roughness
from velatura.model.solved.bsdf import Shape
from velatura.model.solved.energies.adding import Part, parts
from velatura.model.solved.energies.energies import Energies, energies
from velatura.model.solved.energies.media import Slab
from velatura.model.solved.guards import ENERGY_EPS
from velatura.model.solved.lobes import refracted_lobe, widths
from velatura.model.solved.sample_allocation import Demand
from velatura.model.solved.solve import Layout, layout_of, shapes_of
from velatura.model.solved.transmission import combined, direct
from velatura.model.variance import Covariance, Isotropic, Roughness, Variance, variance_kind
from velatura.optics import ggx
from velatura.optics.ggx import Direction
from velatura.stack import InterfaceValues, Material, SlabValues

Array = NDArray[np.float64]

NONE = np.zeros(0)  # directions at which the remainder, which has no lobe, is known


def solved_lobes(material: Material, model: Model, wi: Direction) -> StackLobes:
    """The lobes of a material with values in NumPy, for directions wi, (N,) each.

    A lobe has the light that an interface reflects, unscattered and in its veil, and the roughness of both together
    outside; its own roughness is that of the unscattered light, in the medium above the interface. The transmitted lobe
    has all that passes, and one roughness, that in the medium beyond.
    """
    nothing = _without_steps(material)
    if nothing:
        others = replace(material, layers=tuple(x for place, x in enumerate(material.layers) if place not in nothing))
        return _with_dark(solved_lobes(others, model, wi), material, model, nothing, np.arctan2(wi[1], wi[0]))

    # Brushed materials are solved in their own axes, as for rendering
    frame = Frame.of(material)
    turn = np.radians(frame.degrees(material))
    axis = nearer_axis(material, np.arctan2(wi[1], wi[0]))
    incident = wi
    material, wi = frame.back(material), ggx.rotate(wi, turn)
    cos_theta, phi = wi[2], np.arctan2(wi[1], wi[0])
    often = tables.load() if model.microsurface else None
    solved, found = energies(material, cos_theta, phi, often, widths.nearly_straight, incidences=NONE), parts(material)
    kind = variance_kind(material)
    # Symmetry has the axes of isotropic stacks in the plane of incidence
    in_plane = phi if kind is Isotropic else None

    def collect(energy: NDArray[np.floating], own: Roughness, seen: Roughness) -> LobeStatistics:
        own, seen = (with_axes_named(_turned(each, turn), axis) for each in (own, seen))
        return _lobe(energy, own, seen, model)

    layout = layout_of([material])
    facets = [place for place, part in enumerate(found) if isinstance(part, Facets)]
    drawn = shapes_of(material, layout.lobes)
    tensors = widths.tensors(found, cos_theta, phi, solved.lobes.mean(axis=1)) if facets else []
    reflected = []
    for k, (place, shape, tensor) in enumerate(zip(facets, drawn, tensors)):
        own = tensor.roughness(phi) if place else _of(found[place], phi)
        if all(map(_is_smooth, found[: place + 1])):
            own = Roughness(0 * phi, 0 * phi, own.rotation)
        veil = widths.veil(found, k, cos_theta, tensor).roughness(phi) if solved.veils[k].any() else None
        seen = _seen(shape, own, veil, solved, k, wi, in_plane)
        reflected.append(collect(solved.lobes[k] + solved.veils[k], own, seen))
    transmitted = None
    if material.transmits:
        through = _passed(material, layout, found, kind, solved, wi)
        transmitted = collect(solved.passed, through, through)
    return StackLobes.of(incident, reflected, transmitted, _colours(solved.rest, phi))


def _lobe(energy: NDArray[np.floating], own: Roughness, seen: Roughness, model: Model) -> LobeStatistics:
    covariance = np.array(Covariance.of(seen, MAPS[model.map]).matrix())
    colours = _colours(energy, seen.rotation)
    return LobeStatistics(colours, covariance, np.array(seen[:2]), seen.rotation, np.array(own[:2]), own.rotation)


def _turned(roughness: Roughness, angle: float) -> Roughness:
    """Anticlockwise; rotations stay within a quarter turn to either side."""
    rotation = roughness.rotation + angle
    return roughness._replace(rotation=rotation - np.pi * np.round(rotation / np.pi))


def _without_steps(material: Material) -> list[int]:
    """Places of interfaces without films between media of one index: nothing reflects there, nor changes below.

    Not of one that ends a medium; and one interface stays where light passes, as only interfaces say that it does.
    """
    found, above = [], material.exterior
    ends_medium = any(isinstance(layer, SlabValues) for layer in material.layers[-2:-1])
    for place, layer in enumerate(material.layers[: -1 if ends_medium else None]):
        if isinstance(layer, InterfaceValues) and layer.kind == "dielectric":
            if np.all(layer.eta == above) and not layer.films:
                found.append(place)
            above = layer.eta
    return found[:-1] if material.transmits and len(found) == len(material.interfaces) else found


def _with_dark(found: StackLobes, material: Material, model: Model, places: list[int], phi: Array) -> StackLobes:
    """The lobes, with those of interfaces that reflect nothing."""
    for place in places:
        layer = material.layers[place]
        assert isinstance(layer, InterfaceValues)
        k = sum(isinstance(above, InterfaceValues) for above in material.layers[:place])
        roughness = (value + 0 * phi for value in (layer.alpha_u, layer.alpha_v, np.radians(layer.rotation)))
        own = with_axes_named(Roughness(*roughness), nearer_axis(material, phi))
        dark = _lobe(np.zeros((1, 1)), own, own, model)
        for field in fields(LobeStatistics):
            getattr(found, field.name).insert(k, getattr(dark, field.name))
    return found


def _of(part: Part, phi: Array) -> Roughness:
    """The roughness of an interface."""
    assert isinstance(part, Facets)
    return Roughness(*(value + 0 * phi for value in (part.alpha_u, part.alpha_v, part.rotation)))


def _is_smooth(part: Part) -> bool:
    return not isinstance(part, Facets) or part.alpha_u == part.alpha_v == 0.0


def _seen(
    shape: Shape, own: Roughness, veil: Roughness | None, solved: Energies, k: int, wi: Direction, axis: Array | None
) -> Roughness:
    """The roughness outside of lobe k and its veil."""
    if veil is None and (shape.first is None or not np.any(own[:2])):
        return own

    def samples(roughness: Roughness, energy: Array) -> equivalent_roughness.LobeSamples:
        lobe = shape.lobe(1.0, roughness)
        weight = np.maximum(energy, ENERGY_EPS) / np.maximum(refracted_lobe.integral(lobe, wi), ENERGY_EPS)
        return equivalent_roughness.of_lobe(replace(lobe, weight=weight), wi)

    light = [samples(own, solved.lobes[k])]
    if veil:
        light.append(samples(veil, solved.veils[k]))
    return equivalent_roughness.roughness(equivalent_roughness.together(light), axis)


def _passed(
    material: Material, layout: Layout, found: list[Part], kind: type[Variance], solved: Energies, wi: Direction
) -> Roughness:
    """The roughness of light that passes, in the medium beyond."""
    phi = np.arctan2(wi[1], wi[0])
    scatters = any(isinstance(part, Slab) and part.tau_s.any() for part in found)
    if not scatters and all(map(_is_smooth, found)):
        return Roughness(0 * phi, 0 * phi, phi)
    if kind is Isotropic:
        wi = np.hypot(wi[0], wi[1]), 0 * wi[1], wi[2]  # alike in all planes
    transmission = direct.transmission(material, kind, layout.stepped, layout.rough, layout.cloudy)
    straight, bounced, all_ = (
        np.maximum(energy, ENERGY_EPS) for energy in (solved.straight, solved.bounced, solved.passed)
    )
    nothing = np.zeros((0, len(phi)))
    shares, _ = combined.parts(transmission, wi, straight, bounced, all_, Demand(nothing, nothing, nothing))
    samples = equivalent_roughness.of_passed(transmission, shares, wi)
    if kind is Isotropic:
        u, v, _ = equivalent_roughness.roughness(samples, 0 * phi)
        return Roughness(u, v, phi)
    return equivalent_roughness.roughness(samples)


def _colours(energy: NDArray[np.floating], phi: Array) -> Array:
    return np.broadcast_to(energy, (3, len(phi))).copy()
