"""Thin films in a shader: reflectances and averages of each interface that has any, tables in a texture of their own.

Code knows them by name: `film2` is the reflectance of the facets of layer 2 over the cosine, `film2_above` and
`film2_below` its directional albedo for light from either side. Of a dielectric with films that absorb, `film2_rarer`,
`film2_denser` and `film2_passing` are the reflectances from either side and what passes, over the coordinate of
`films.tables.Absorbing`, and `film2_above_lost` and `film2_below_lost` the averages of what is absorbed. Where a
user changes values, code knows which interfaces have films, and whether these absorb, and no more; the texture changes
with the values.

Where a thickness comes from a texture, the tables of facets are over as many thicknesses, too, `film2_by101` over 101:
those that texels from 0 to 1 give, beyond which the nearest serves. There are no averages of such films.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.errors import InvalidInput
from velatura.films.of_material import films_of
from velatura.films.tables import NODES, Absorbing, Average, Coated, ThicknessAxis
from velatura.films.textured import over_thickness
from velatura.model import Model
from velatura.model.film_average import NODES as AVERAGED
from velatura.model.film_average import film_average
from velatura.ops import Value
from velatura.shader.lookups.atlas import TableLayout
from velatura.shader.recorder.symbol import Symbol, operand
from velatura.stack import Address, Interface, InterfaceValues, Material, Stack, Texture, Varying, number
from velatura.tables import coordinates

Array = NDArray[np.floating]

FILM = "film"  # an operation: a table of films, looked up at a cosine, or at coordinates of direction and roughness
WIDTH = NODES  # texels of a line of the texture; each table begins a line
SIDES = ("rarer", "denser", "passing")  # what tables of films that absorb are of, as `Absorbing` has them
_NAME = re.compile(r"(?:part\d+_)*film(\d+)(?:_by(\d+))?(?:_(rarer|denser|passing))?(?:_(above|below)(_lost)?)?")
STEP_NM = 6.0  # between thicknesses that are worked out: 15 nm of optical thickness for an index of 2.5


class RecordedFilms(Coated):
    """Films that code reads by `name`, `turned` as seen from below.

    `data` are those of its facets, which are None where values change; `n12` is then recorded, too. Films may absorb.
    """

    known = False  # code reads the texture
    n12: Value

    def __init__(
        self,
        name: str,
        data: Array | None,
        n12: Value | None,
        absorbing: bool,
        axis: ThicknessAxis | None = None,
        turned: bool = False,
    ) -> None:
        super().__init__(np.empty((0, 3)) if data is None else data, 1, axis=axis)
        self.name, self.n12, self.absorbing, self.turned = name, n12, absorbing, turned

    @property
    def absorbs(self) -> bool:
        return self.absorbing

    def reversed(self) -> RecordedFilms:
        """The films seen from below."""
        data, axis = self.data if len(self.data) else None, self.axis and self.axis.reversed()
        found = RecordedFilms(self.name, data, 1 / self.n12, self.absorbing, axis, not self.turned)
        found.place = self.place
        return found

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        if not self.absorbing:
            return super().between(cos_1, cos_2, like)
        at = self._coordinate(cos_1, cos_2)
        return ops.select(self.n12 > 1, self._side(0, at), self._side(1, at))

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        if not self.absorbing:
            return super().passing(cos_1, cos_2, like)
        return self._side(2, self._coordinate(cos_1, cos_2))

    def cosine(self, cos_1: Value, cos_2: Value) -> Value:
        return ops.select(self.n12 > 1, cos_1, cos_2)

    def _coordinate(self, cos_1: Value, cos_2: Value) -> Value:
        return Absorbing.coordinate(self.cosine(cos_1, cos_2), self.cosine(cos_2, cos_1), self.n12)

    def _side(self, k: int, at: Value) -> Value:
        """Share that is reflected on either side, or that passes."""
        if len(self.data) and not isinstance(at, Symbol) and not self.place:
            return np.stack(ops.interpolate(self, float(at))[3 * k : 3 * k + 3])
        return self._symbol(at, f"{self.name}_{SIDES[k]}")

    def at(self, cosine: Value, like: Value) -> Value:
        if len(self.data) and not isinstance(cosine, Symbol) and not self.place:
            return np.stack(ops.interpolate(self, float(cosine)))
        return self._symbol(cosine, self.name)

    def _symbol(self, at: Value, name: str) -> Symbol:
        return Symbol(FILM, tuple(map(operand, (*self.place, at))), "colour", name)

    def averaged(self, often: bool) -> tuple[Average, Average] | None:
        if self.axis:
            return None
        name = f"{self.name}_{'below' if self.turned else 'above'}"

        def average(name: str, cos_theta: Value, alpha: Value) -> Value:
            at = operand(self._place(cos_theta)), operand(coordinates.from_roughness(alpha))
            return Symbol(FILM, at, "colour", name)

        return partial(average, name), partial(average, f"{name}_lost")

    def _place(self, cos_theta: Value) -> Value:
        """The coordinate of a direction, as a `FilmAverage` has it."""
        even = coordinates.from_cosine(cos_theta)
        if self.n12 is None:
            return even
        sine = ops.minimum(self.n12, 1.0)
        around = coordinates.from_angle(cos_theta, ops.arctan2(sine, ops.sqrt(1 - sine * sine)))
        return ops.select(self.n12 < 1, around, even)


def recorded(material: Material, stack: Stack, general: bool) -> Material:
    """A material of a stack whose films are read, of any values in `general`."""
    above, layers = material.exterior, material.layers
    for n, (layer, known) in enumerate(zip(layers, coated_layers(stack))):
        if not isinstance(layer, InterfaceValues):
            continue
        if known:
            data, n12 = (None, known.n12) if general else (known.data, known.n12)
            if general and n12 is not None:
                below = material.exterior if material.thin and layer is layers[-1] else layer.eta
                n12 = ops.mean(below) / ops.mean(above)
            name = f"film{n}_by{len(known.data)}" if known.axis else f"film{n}"
            read: Any = RecordedFilms(name, data, n12, known.absorbs, known.axis)
            material = material.with_layer(n, coating=read)
        elif layer.films:
            material = material.with_layer(n, films=())
        above = layer.eta
    return material


def coated_layers(stack: Stack) -> list[Coated | None]:
    """The films on each layer; None of those without. Other values may come from textures.

    Raises:
        InvalidInput: an index of a film, or beside one, that comes from one; or several thicknesses of one interface.
    """
    beside, axes = _beside(stack), dict[int, ThicknessAxis]()

    def value(address: Address, described: Any) -> Value:
        thickness = address.role == "film_thickness_nm"
        if isinstance(described, Texture) and thickness and address.layer is not None:
            if address.layer in axes:
                raise InvalidInput(f"{address.name}: in a shader only one film of an interface may have a texture")
            axes[address.layer] = axis = _axis(address, described)
            return axis.high_nm
        if isinstance(described, Varying) and address.film is None and address.name not in beside:
            return 0.0
        address.plain(described, "in a shader films have textures of a thickness alone")
        return number(address, described)

    material = Material.of(stack, value)
    return [
        over_thickness(material, n, axes[n], ()) if n in axes else films for n, films in enumerate(films_of(material))
    ]


def _axis(address: Address, texture: Texture) -> ThicknessAxis:
    """The thicknesses that texels from 0 to 1 give."""
    assert address.film is not None
    ends = np.array(texture.curve or (0.0, 1.0)) * texture.scale + texture.offset
    low, high = np.clip((ends.min(), ends.max()), *address.declared.within).tolist()
    return ThicknessAxis.around(address.film, low, high, STEP_NM)


def _beside(stack: Stack) -> set[str]:
    """Flat names of the indices on either side of films, and of the extinction below them."""
    found, above = set[str](), "exterior"
    for n, layer in enumerate(stack.layers):
        if isinstance(layer, Interface):
            found |= {above, f"layer{n}_eta", f"layer{n}_k"} if layer.films else set()
            above = f"layer{n}_eta"
    return found


def beside(stack: Stack) -> set[str]:
    """Flat names of the indices that the films of a stack are worked out from."""
    found, above = set[str](), "exterior"
    for n, films in enumerate(coated_layers(stack)):
        if films:
            found |= {above, f"layer{n}_eta", *([f"layer{n}_k"] if films.n12 is None else [])}
        above = f"layer{n}_eta" if n in stack.surfaces else above
    return found | ({"exterior"} if found and stack.thin else set())


def read_by(symbols: Iterable[Symbol]) -> set[str]:
    """The names of the tables that are looked up."""
    return {symbol.detail for symbol in symbols if symbol.op == FILM}


def tables(stack: Stack, names: Collection[str], model: Model, coarse: bool = False) -> dict[str, Array]:
    """The tables of a stack by name, each of the shape of its nodes and 3 colours; `coarse` ones are quicker."""
    if not names:
        return {}
    films, found = coated_layers(stack), dict[str, Array]()
    for name in sorted(names):
        parts = _NAME.fullmatch(name)
        assert parts
        (number, _, of_facets, side, lost) = parts.groups()
        own = films[int(number)]
        assert own
        if side:
            average = film_average(own.reversed() if side == "below" else own, model.microsurface, coarse)
            found[name] = np.split(average.data, average.data.shape[-1] // 3, axis=-1)[1 if lost else 0]
        else:
            found[name] = np.split(own.data, 3, axis=-1)[SIDES.index(of_facets)] if of_facets else own.data
    return found


def layouts(names: Iterable[str]) -> list[TableLayout]:
    """Where each of the tables named lies in their texture."""
    found: list[TableLayout] = []
    start = 0
    for name in sorted(names):
        parts = _NAME.fullmatch(name)
        assert parts
        over = (int(parts[2]),) if parts[2] else ()
        nodes = AVERAGED if parts[4] else (*over, 2 * NODES - 1 if parts[3] else NODES)
        found.append(TableLayout(name, start, nodes, 3))
        start = -(-found[-1].end // WIDTH) * WIDTH
    return found


def texture(found: dict[str, Array]) -> Array | None:
    """Tables as their texture, float32 of shape (height, WIDTH, 4); None without any."""
    lines = []
    for _, table in sorted(found.items()):  # as `layouts`
        texels = np.pad(table.reshape(-1, 3).astype(np.float32), ((0, 0), (0, 1)))
        lines.append(np.pad(texels, ((0, -len(texels) % WIDTH), (0, 0))).reshape(-1, WIDTH, 4))
    return np.concatenate(lines) if lines else None
