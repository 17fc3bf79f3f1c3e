"""Look up averages of Fresnel: the directional albedo FGD and the correction for total internal reflection.

What depends on the index alone is a `Row`, made once per material; what depends on direction is one look-up.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import prod

import numpy as np

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.tables import coordinates
from velatura.tables.material_average import Average, sample
from velatura.tables.store import Table, Tables

FEW = 256  # numbers of which NumPy takes longer to begin with than to work out


@dataclass(frozen=True)
class Row:
    """Fresnel of one relative index at the nodes of a low-rank table, raised to the powers that the table names.

    `denser` and `rarer`: whether the relative index can be above and below 1 (for metals: outside and inside the corner
    kappa < eta < 1); impossible parts are not looked up. `multiple` is whether light may
    bounce between the facets before it leaves. `films` is what thin films add to the reflectance, at the nodes of the
    table of metals; `inside` what films of a dielectric do not reflect of light from its denser side, at the nodes of
    the table of metals inside, None where they absorb nothing.
    """

    table: Table
    reflectance: Sequence[Value]
    eta: Value
    kappa: Value | None
    denser: bool = True
    rarer: bool = True
    multiple: bool = False
    films: Sequence[Value] | None = None
    inside: Sequence[Value] | None = None


def dielectric_row(tables: Tables, eta: Value, constant: bool = False, multiple: bool = False) -> Row:
    """Row of a dielectric of relative index eta > 0; `constant`: whether eta may be looked at now."""
    table = tables.dielectric_multi if multiple else tables.dielectric
    reflectance = _raised(table, _at_nodes(fresnel.dielectric, table.nodes, eta))
    denser, rarer = _sides(eta < 1) if constant else (True, True)
    return Row(table, reflectance, eta, None, denser, rarer, multiple)


def conductor_row(tables: Tables, eta: Value, kappa: Value, constant: bool = False, multiple: bool = False) -> Row:
    """Row of a conductor of relative index eta + i kappa."""
    table = tables.conductor_multi if multiple else tables.conductor
    reflectance = _raised(table, _at_nodes(fresnel.conductor, table.nodes, eta, kappa))
    denser, rarer = _sides(_in_corner(eta, kappa)) if constant else (True, True)
    return Row(table, reflectance, eta, kappa, denser, rarer, multiple)


def with_films(tables: Tables, row: Row, reflect: Callable[[Value], Value], absorb: bool) -> Row:
    """Row of an interface with thin films, from that without them, and its reflectance at a cosine; they may `absorb`.

    For films that are not known now, of which `model.film_average` has more exact ones. The nodes of metals resolve
    any reflectance over the cosine: of films of up to 5,000 nm to .004, and to .018 about 1,200 nm. Light that meets
    several facets of a dielectric is reflected as without films. Light from inside that films absorb has a reflectance
    that falls at the critical angle: there the nodes inside serve, to .06, and to .13 where the interface is smooth.
    """
    if row.kappa is not None:
        return replace(row, reflectance=_raised(row.table, [reflect(c) for c in row.table.nodes]), rarer=False)
    films = [reflect(c) - fresnel.dielectric(c, row.eta) for c in tables.conductor.nodes]
    if not (absorb and row.rarer):
        return replace(row, films=films)
    theta_c = _critical_angle(ops.mean(row.eta))
    lost = [1 - reflect(coordinates.to_angle(x, theta_c)) for x in tables.absorbing_inside.nodes]
    return replace(row, films=films, inside=lost)


def over_facets(tables: Tables, share: Callable[[float], Value]) -> Average:
    """The average of what facets make of light that they meet at a cosine, by the nodes of metals (`with_films`)."""
    values = [share(c) for c in tables.conductor.nodes]

    def average(cos_theta: Value, alpha: Value) -> Value:
        at = coordinates.from_cosine(cos_theta), coordinates.from_roughness(alpha)
        return _dot(ops.interpolate(tables.conductor, *at), values)

    return average


def mirror_row(tables: Tables) -> Row:
    """Row of an interface that reflects all light."""
    return Row(tables.dielectric, [1.0] * len(tables.dielectric.nodes), 1.0, None, rarer=False)


def fgd(tables: Tables, row: Row, cos_theta: Value, alpha: Value) -> Value:
    """Directional albedo of a GGX interface (Belcour 2018, Eq. 2; section 4.1), shape of colour against direction."""
    bare = _of_facets(tables, row, cos_theta, alpha)
    if row.films is None:
        return bare
    at = coordinates.from_cosine(cos_theta), coordinates.from_roughness(alpha)
    found = bare + _dot(ops.interpolate(tables.conductor, *at), row.films)
    if row.inside is None:
        return found
    index, of_mirror = ops.mean(row.eta), _dot(ops.interpolate(row.table, *at), [1.0] * len(row.table.nodes))
    lost = _dot(_fetch_inside(tables.absorbing_inside, index, cos_theta, alpha), row.inside)
    return ops.select(index < 1, (1.0 if row.multiple else of_mirror) * (1 - lost), found)


def _of_facets(tables: Tables, row: Row, cos_theta: Value, alpha: Value) -> Value:
    """Directional albedo of the interface without films."""
    from_cosine, from_roughness = coordinates.from_cosine(cos_theta), coordinates.from_roughness(alpha)
    channels = ops.interpolate(row.table, from_cosine, from_roughness)
    above = _dot(channels, row.reflectance)
    ops.names(from_cosine=from_cosine, from_roughness=from_roughness, above=above)
    if not row.rarer:
        return above
    of_mirror = 1.0 if row.multiple else _dot(channels, [1.0] * len(channels))
    below = of_mirror * _mean_fresnel_inside(tables, row, cos_theta, alpha)
    if not row.denser:
        return below
    return ops.select(row.eta < 1 if row.kappa is None else _in_corner(row.eta, row.kappa), below, above)


def tir(tables: Tables, form: str, eta: Value, cos_theta: Value, alpha: Value) -> Value:
    """Share of the light reflected at (cos_theta, alpha) that leaves upwards into a medium of relative index eta.

    `published` is the mean of 1 - F(cos_theta_o), which counts Fresnel as well; `clean` the energy within the critical
    cone.
    """
    if form == "clean":
        return ops.select(eta < 1, _fetch_inside(tables.tir_clean, eta, cos_theta, alpha)[0], 1.0)
    outside = tables.tir_published_outside
    channels = ops.interpolate(outside, coordinates.from_cosine(cos_theta), coordinates.from_roughness(alpha))
    above = 1 - _dot(channels, ops.each(fresnel.dielectric, outside.nodes, eta))
    return ops.select(eta < 1, _fetch_inside(tables.tir_published, eta, cos_theta, alpha)[0], above)


def fgd_sheet(tables: Tables, row: Row, number: type) -> Average:
    """`fgd` of one material as one fetch where its index allows; `number` is Dr.Jit's type of numbers."""
    look_up = partial(fgd, tables, row)
    if row.rarer and row.denser:
        return look_up
    if not row.rarer:
        return sample(look_up, number, row.table.shape)
    return sample(look_up, number, tables.inside.shape[:2], _critical_angle(ops.mean(row.eta)))


def tir_sheet(tables: Tables, form: str, eta: Value, number: type) -> Average:
    """`tir` for one relative index as one fetch; `number` is Dr.Jit's type of numbers."""
    look_up = partial(tir, tables, form, eta)
    if _sides(eta < 1)[1]:
        return sample(look_up, number, tables.tir_clean.shape[:2], _critical_angle(eta))
    return sample(look_up, number, tables.tir_published_outside.shape)


def _mean_fresnel_inside(tables: Tables, row: Row, cos_theta: Value, alpha: Value) -> Value:
    if row.kappa is None:
        inside = tables.inside_multi if row.multiple else tables.inside
        return _fetch_inside(inside, row.eta, cos_theta, alpha)[0]
    absorbing = tables.absorbing_inside_multi if row.multiple else tables.absorbing_inside
    channels = _fetch_inside(absorbing, row.eta, cos_theta, alpha)
    theta_c = _critical_angle(row.eta)
    reflectance = _raised(absorbing, ops.each(_conductor_inside, absorbing.nodes, theta_c, row.eta, row.kappa))
    return 1 - _dot(channels, [1 - f for f in reflectance])


def _conductor_inside(x: Value, theta_c: Value, eta: Value, kappa: Value) -> Value:
    """Reflectance of a conductor at a coordinate on the angular axis."""
    return fresnel.conductor(coordinates.to_angle(x, theta_c), eta, kappa)


def _at_nodes(reflectance: Callable[..., Value], nodes: Sequence[float], *index: Value) -> Sequence[Value]:
    """Fresnel at all cosines: of few numbers in NumPy by one call, since there calls are what costs."""
    if not all(isinstance(x, np.ndarray) and x.size <= FEW for x in index):
        return ops.each(reflectance, nodes, *index)
    found: Sequence[Value] = reflectance(np.reshape(nodes, (-1, *(1,) * max(x.ndim for x in index))), *index)
    return found


def _raised(table: Table, reflectance: Sequence[Value]) -> list[Value]:
    """Fresnel at the nodes of a table to the table's powers."""
    raised = [prod([f] * n) for f, n in zip(reflectance, table.powers or (1,) * len(reflectance))]
    ops.names(reflectance=raised)
    return raised


def _fetch_inside(table: Table, eta: Value, cos_theta: Value, alpha: Value) -> list[Value]:
    theta_c = _critical_angle(eta)
    return ops.interpolate(
        table,
        coordinates.from_angle(cos_theta, theta_c),
        coordinates.from_roughness(alpha),
        coordinates.from_critical_angle(theta_c),
    )


def _critical_angle(eta: Value) -> Value:
    below_1 = ops.minimum(eta, 1.0)
    theta_c = ops.arctan2(below_1, ops.sqrt(1 - below_1 * below_1))
    ops.names(below_1=below_1, theta_c=theta_c)
    return theta_c


def _in_corner(eta: Value, kappa: Value) -> Value:
    return (eta < 1) & (kappa < eta)


def _sides(rarer: Value) -> tuple[bool, bool]:
    sides = np.asarray(rarer)
    return not bool(sides.all()), bool(sides.any())


def _dot(a: Sequence[Value], b: Sequence[Value]) -> Value:
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:]):
        total = total + x * y
        ops.names(total=total)
    return total
