"""Films whose thickness or indices come from textures, and tables that are differentiable."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.films.of_material import SENSITIVITIES, optical_thickness_nm, tabulated_films
from velatura.films.spectral import SpectralQuadrature
from velatura.films.tables import STEP_NM, Coated, ThicknessAxis
from velatura.renderer.differentiated import Variables, plain
from velatura.renderer.finite_differences import differentiable
from velatura.stack import Address, InterfaceValues, Material

Array = NDArray[np.floating]

THIN_NM = 150.0  # of which steps of an index are .1: the least thickness that they are chosen for

#: What textures of films and of indices span that cannot be looked at, by role.
UNKNOWN = {
    **{"film_thickness_nm": (0.0, 1000.0), "film_eta": (1.0, 2.5), "film_k": (0.0, 6.25)},
    **{"eta": (1.0, 2.5), "k": (0.0, 6.25)},
}


@dataclass(frozen=True)
class Span:
    """The least and the greatest value that a texture gives."""

    address: Address
    low: float
    high: float

    def axis(self, layer: InterfaceValues) -> ThicknessAxis:
        """The axis over a thickness."""
        assert self.address.film is not None
        return ThicknessAxis.around(self.address.film, self.low, self.high, step(self.address, layer))


def constant_films(
    material: Material, spans: Sequence[Span], number: Any, polarised: bool = False
) -> list[Coated | SpectralQuadrature | None]:
    """The films on each layer of a renderer's constants; differentiable.

    Args:
        spans: values from textures, of films and of indices, which then have any value in `material`.
        number: Dr.Jit's type of numbers, None in scalar variants.
        polarised: whether light is, which tables over a thickness do not have.
    """
    given, start = Variables.of(material), plain(material)
    # Where an extinction varies it may be 0
    varying = [given.addresses[place] for variable in given.given for place, _ in variable.places]
    varying += [span.address for span in spans]
    may_absorb = {address.layer for address in varying if address.role == "film_k" and address.layer is not None}
    axes, points = dict[int, ThicknessAxis](), dict[int, SpectralQuadrature]()
    for k, layer, own in _films_with_textures(highest(start, spans), spans):
        if [span.address.role for span in own] == ["film_thickness_nm"] and not polarised:
            axes[k] = own[0].axis(layer)
        else:
            absorbs = k in may_absorb or any(np.any(film.k > 0) for film in layer.films)
            thickness_nm, sensitivity = optical_thickness_nm(layer), SENSITIVITIES[material.light]
            points[k] = SpectralQuadrature.over(thickness_nm, sensitivity, type(material.exterior), absorbs, number)
            start = start.with_layer(k, films=())

    def tables(numbers: list[float]) -> list[Coated | None]:
        changed = given.replaced(start, numbers)
        found = tabulated_films(changed, may_absorb)
        return [over_thickness(changed, k, axes[k], may_absorb) if k in axes else x for k, x in enumerate(found)]

    found = tables([])
    if given.given and any(found):
        flat = differentiable(
            lambda numbers: [films.data.ravel() for films in tables(numbers) if films],
            given.given,
            given.around,
            number,
        )
        read = iter(flat)
        found = [films and films.reading(next(read)) for films in found]
    return [points.get(k, films) for k, films in enumerate(found)]


def _films_with_textures(
    material: Material, spans: Sequence[Span]
) -> Iterator[tuple[int, InterfaceValues, list[Span]]]:
    """Layers whose films, or indices beside them, come from textures, with the spans of these."""
    above = None
    for k, layer in enumerate(material.layers):
        if isinstance(layer, InterfaceValues):
            own = [x for x in spans if x.address.layer == k or (x.address.layer == above and x.address.key == "eta")]
            if layer.films and own:
                yield k, layer, own
            above = k


def over_thickness(material: Material, k: int, axis: ThicknessAxis, may_absorb: Collection[int]) -> Coated:
    """The films on the k-th layer, over thicknesses of one of them."""
    name = f"layer{k}_film{axis.film}_thickness_nm"

    def at(x: float) -> Coated:
        found = tabulated_films(material.each(lambda address, old: x if address.name == name else old), may_absorb)[k]
        assert found
        return found

    each = [at(x) for x in axis.nodes.tolist()]
    found = axis.refined(np.array([films.found for films in each]))
    return type(each[0])(found, each[0].rarer, each[0].n12, None, axis)


def highest(material: Material, spans: Sequence[Span]) -> Material:
    """A material with the greatest values of textures."""
    most = {span.address.name: span.high for span in spans}
    return material.each(lambda address, x: most.get(address.name, x))


def step(address: Address, layer: InterfaceValues) -> float:
    """Step between thicknesses of a film, or between its indices, at which its reflectance is worked out, by the
    greatest values of the layer."""
    assert address.film is not None
    film = layer.films[address.film]
    if address.role == "film_thickness_nm":
        return STEP_NM / float(np.max(film.eta))
    return STEP_NM / max(film.thickness_nm, THIN_NM)
