"""The energies of the lobes of a material, for beams from above.

Three systems of layers share their interfaces. In the first, light meets all that there is. In the others a lobe has
the light that meets one facet of each interface and is not scattered by media (sharp), or is scattered by little (its
veil). Of light that meets facets of its interface again it has a share: all where nothing above it refracts, and little
inside a denser medium. What the first system reflects besides is the remainder.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.model import fitted
from velatura.model.rough_interface import Facets
from velatura.model.solved import sample_allocation
from velatura.model.solved.energies.adding import (
    Lambert,
    Leaving,
    Part,
    indices,
    interfaces,
    layer,
    layers,
    parts,
    settings,
)
from velatura.model.solved.energies.brushing import thrown_back
from velatura.model.solved.energies.interfaces import Setting
from velatura.model.solved.energies.media import Slab, Straight
from velatura.model.solved.energies.modes import Basis, Even, Relative
from velatura.model.solved.energies.nodes import Nodes
from velatura.model.solved.energies.wavelengths import Colours
from velatura.model.solved.guards import TINY
from velatura.stack import InterfaceValues, LayerValues, Material
from velatura.tables import Tables

Array = NDArray[np.floating]

NODES = 24
SAMPLES = 377  # normals
FEW_ORDERS = 2  # of the azimuth, where more than `sample_allocation.MANY` interfaces are brushed
MODES = 3  # of the azimuth, of the remainder
CANCELS = 0.3  # of columns of light: a sum that is less
INCIDENCES = np.sqrt((np.arange(8) + 0.5) / 8)  # cosines at which the remainder is known
AZIMUTHS = np.pi * np.arange(4) / 4  # over which it is averaged, where interfaces are brushed


@dataclass(frozen=True)
class Energies:
    """Energies by colour (C,), or 1 for all, for M beams.

    Attributes:
        lobes: (K, C, M) of the interfaces from the top, of light that no medium has scattered.
        veils: (K, C, M), of light that media have scattered by little.
        rest: (C, M), reflected in no lobe.
        straight, bounced, passed: (C, M), of what passes: straight through, and after reflections, where facets are met
            once and media do not scatter; and all of it.
        remainder: what is reflected in no lobe for beams of the cosines at which it is asked for, by mode of azimuth at
            the `nodes`, (C, MODES, N, I).
        around: likewise what passes not straight through, and `again` of that what facets that are met once reflect
            inside, without scattering media.
        beyond, passing: likewise, by as many modes as are asked for, what is reflected outside the lobe of the first
            interface, and all that passes.
    """

    lobes: Array
    veils: Array
    rest: Array
    straight: Array
    bounced: Array
    passed: Array
    remainder: Array
    around: Array
    again: Array
    beyond: Array
    passing: Array
    nodes: Nodes

    def first(self, count: int) -> Energies:
        """The energies of the first beams alone."""
        of_beams = "lobes", "veils", "rest", "straight", "bounced", "passed"
        return replace(self, **{name: getattr(self, name)[..., :count] for name in of_beams})


def energies(
    material: Material,
    cos_theta: Array,
    phi: Array,
    often: Tables | None,
    forward: Straight,
    incidences: Array = INCIDENCES,
    samples: int = SAMPLES,
    like: Sequence[float] | None = None,
    events: bool = False,
    modes: int = MODES,
) -> Energies:
    """Energies for beams at cosines and azimuths (M,).

    `material` has NumPy's values. With the tables of multiple scattering facets are met often; `forward` is what goes
    into veils. The remainder is known at the cosines `incidences`, (I,); without
    any, lobes are all that is worked out, which is quicker. `samples` are normals for light from each node, and of each
    beam; as many nodes are taken as for media of indices `like` those of the material; `events` as of `Setting`; light
    at the nodes has so many `modes`.
    """
    colours = Colours.of(material)
    everything = colours.at_wavelengths(_ended(parts(material)))
    brushed = [(facets.ratio, facets.rotation) for facets in interfaces(everything) if facets.alpha_u != facets.alpha_v]
    azimuths = AZIMUTHS if brushed else AZIMUTHS[:1]
    cosines = np.concatenate([cos_theta, np.tile(incidences, len(azimuths))])
    around = np.concatenate([np.broadcast_to(phi, np.shape(cos_theta)), np.repeat(azimuths, len(incidences))])
    nodes = Nodes.of(indices(everything), NODES, like)
    orders = tuple(range(modes if len(incidences) else 1))
    most = FEW_ORDERS if len(brushed) > sample_allocation.MANY else None
    basis: Basis = Even.of(nodes, brushed, most) if brushed else Relative(nodes, orders)
    setting = Setting(basis, np.sqrt(np.maximum(1 - cosines * cosines, 0)), around, samples, often, events)

    # Sum up the systems
    scatters = any(isinstance(part, Slab) and part.tau_s.any() for part in everything)
    each = layers(everything, setting)
    full = Leaving.of(colours.layers([last for _, last in each]), setting)

    def system(found: Sequence[Part], as_set: bool = False) -> Leaving:
        of = settings(found, setting)
        met = zip(found, of, each)
        made = [layer(x, y)[0] if isinstance(x, Slab) else of_it[as_set] for x, y, of_it in met]
        return Leaving.of(colours.layers(made), setting)

    clear = _ended(parts(material, lambda _: 0.0))
    sharp = system(clear) if scatters or often else full
    kept = system(_ended(parts(material, forward))) if scatters else sharp
    # A lobe has all that media do not scatter where nothing above it refracts, and else a share of it
    whole = system(clear, True) if scatters and often else full

    # Sort what leaves
    shares = _undisturbed(everything)
    places = [*shares]
    once, of_kept, of_whole = (np.array(x.energies.reflected)[places] for x in (sharp, kept, whole))
    again = of_whole - once
    taken = _taken(np.array([*shares.values()])[:, None, None], again, once)
    reflected = np.maximum(sum(full.energies.reflected), 0)
    shape = len(shares), *reflected.shape
    unscattered, veiled = (np.maximum(np.broadcast_to(x + taken * again, shape), 0) for x in (once, of_kept))
    # No lobe has more than there is: what quadrature says beyond is its error
    share = np.minimum(reflected / np.maximum(veiled.sum(axis=0), TINY), 1)
    lobes, veils = unscattered * share, np.maximum(veiled - unscattered, 0) * share
    rest = np.maximum(reflected - (lobes + veils).sum(axis=0), 0)
    if brushed and (along := _along(everything)) > 0:
        handed = along * np.clip(of_whole.sum(axis=0) - unscattered.sum(axis=0), 0, rest)
        lobes[-1], rest = lobes[-1] + handed, rest - handed
    lobes, veils, rest = colours.parts_seen(lobes, veils, rest)
    count = np.size(cos_theta)
    if brushed and len(incidences):
        by_node = _of_isotropic(material, rest[:, count:], often, forward, incidences, samples, like, events, modes)
    elif len(incidences):
        in_lobes = zip(places, taken[:, :, None, None])
        lights = _by_node(full, sharp, kept, whole, in_lobes)
        by_node = tuple(colours.seen(light[..., count:]) for light in lights)
    else:
        by_node = (np.zeros((1, 1, nodes.count, 0)),) * 5
    straight, through, passed = map(
        colours.seen, (sharp.energies.straight, sharp.energies.passed, full.energies.passed)
    )
    return Energies(
        lobes=lobes[..., :count],
        veils=veils[..., :count],
        rest=rest[:, :count],
        straight=straight[:, :count],
        bounced=np.maximum(through - straight, 0)[:, :count],
        passed=np.maximum(passed, 0)[:, :count],
        remainder=by_node[0],
        around=by_node[1],
        again=by_node[2],
        beyond=by_node[3],
        passing=by_node[4],
        nodes=nodes,
    )


def media_of(material: Material) -> list[float]:
    """Indices of the media of a material, as `Nodes` are for."""
    return indices(_ended(parts(material)))


def _ended(found: list[Part]) -> list[Part]:
    """The layers, without a black base directly below an interface, which is then the last one that light meets."""
    *others, last = found
    if others and isinstance(others[-1], Facets) and isinstance(last, Lambert) and not last.albedo.any():
        return [*others[:-1], replace(others[-1], final=True)]
    return found


def _undisturbed(found: Sequence[Part]) -> dict[int, float]:
    """Share of the light that meets facets of an interface again, and that no step of the index above takes from its
    lobe, by the number of the interface among the layers.

    Facets inside a denser medium make such light diffuse, but for its axes, which the remainder has not.
    """
    shares, steps = {}, 0.0
    for i, part in enumerate(found):
        if isinstance(part, Facets):
            shares[i] = float(np.exp(-steps / fitted.UNDISTURBED)) * (part.brushed if part.is_exit else 1.0)
            steps += part.step
    return shares


def _along(found: Sequence[Part]) -> float:
    """Share of the light of repeated facets in no lobe that the lobe of a metal has, since the remainder has no axes:
    that which brushed facets of little step block, inside other media, leaves much as the rest of the lobe does, and so
    does most of what the metal's own long facets block."""
    facets = [part for part in found if isinstance(part, Facets)]
    *coats, last = facets
    if not last.opaque or not coats:
        return 0.0
    rough = np.array([each.alpha_u**2 + each.alpha_v**2 for each in facets])
    blocked = rough[:-1] * [coat.brushed for coat in coats]
    steps = np.array([coat.step for coat in coats])
    onward = np.exp(-steps / fitted.UNDISTURBED) * steps / (steps + fitted.ALONG_FADE)
    share = float((blocked * onward)[1:].sum() / max(blocked.sum(), TINY))
    of_metal = rough[-1] / max(rough[-1] + fitted.BLOCKED_BY_COATS * rough[:-1].sum(), TINY)
    return min(fitted.ALONG * last.brushed * share + thrown_back(facets) * of_metal, 1.0)


def _taken(share: Array, again: Array, once: Array) -> Array:
    """Share of the light of interfaces that meets their facets again which lobes take: no more than they have, `once`,
    without a kink."""
    most = fitted.AGAIN * np.maximum(once, TINY) / np.maximum(again, TINY)
    ratio = np.minimum(most, share) / np.maximum(most, share)
    return np.asarray(np.minimum(most, share) * (1 + ratio**fitted.AGAIN_POWER) ** (-1 / fitted.AGAIN_POWER))


def _by_node(
    full: Leaving, sharp: Leaving, kept: Leaving, whole: Leaving, in_lobes: Iterable[tuple[int, Array]]
) -> tuple[Array, ...]:
    """Light at the nodes that no lobe has, that passes not straight, that passes so without scattering media, that is
    not in the first lobe, and that passes;
    `in_lobes` says of each layer with a lobe what share of light that meets facets again the lobe takes."""
    of_full, of_sharp, of_kept, of_whole = (x.lights for x in (full, sharp, kept, whole))
    left: Array = sum(of_full.reflected, np.zeros(()))
    beyond = None
    for i, taken in in_lobes:
        left = left - of_kept.reflected[i] - taken * (of_whole.reflected[i] - of_sharp.reflected[i])
        beyond = left if beyond is None else beyond
    around, again = of_full.passed - of_sharp.straight, of_sharp.passed - of_sharp.straight
    return left, around, again, left if beyond is None else beyond, of_full.passed


def _of_isotropic(
    material: Material,
    energy: Array,
    often: Tables | None,
    forward: Straight,
    incidences: Array,
    *numbers: Any,
) -> tuple[Array, ...]:
    """Light of brushed interfaces, by mode and node: that of isotropic ones of the mean roughness, the remainder with
    the energy that it has on average over azimuths.
    """
    stand_in = replace(material, layers=tuple(_isotropic(each) for each in material.layers))
    found = energies(stand_in, incidences, 0 * incidences, often, forward, incidences, *numbers)
    mean = energy.reshape(len(energy), len(AZIMUTHS), -1).mean(axis=1)
    # Columns that cancel out are rounding
    size = np.abs(found.remainder).sum(axis=2).max(axis=1)
    scale = (mean / np.maximum(np.maximum(found.rest, CANCELS * size), TINY))[:, None, None]
    return found.remainder * scale, found.around, found.again, found.beyond, found.passing


def _isotropic(each: LayerValues) -> LayerValues:
    if not isinstance(each, InterfaceValues):
        return each
    mean = 0.5 * (each.alpha_u + each.alpha_v)
    return replace(each, alpha_u=mean, alpha_v=mean)
