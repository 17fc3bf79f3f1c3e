"""The stacks of the benchmark, by edition and kind, drawn from one seed, and the directions that light comes from."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from velatura.benchmark import random_stacks
from velatura.benchmark.random_stacks import base, clear, cloudy, coat, coated, milky, painted, tinted
from velatura.errors import InvalidInput
from velatura.stack import Film, Interface, LayerValues, Material, Stack, as_described
from velatura.stack.schema import show, unknown

if TYPE_CHECKING:
    from importlib.abc import Traversable

Array = NDArray[np.floating]

SCHEMA = resources.files("velatura.benchmark") / "schema.json"

COSINES = (0.98, 0.8, 0.5, 0.25)  # of light on opaque stacks
THROUGH = (0.9, 0.45)  # on stacks that transmit, from either side
GRAZING = (0.9, 0.5, 0.2, 0.08)  # on stacks of the second edition, from above
OUTSIDE, MOMENTA, DEEP = 0.7, (0.3, 0.9, 1.05), 0.6  # on solids: from above; n sin from inside, and as in `_inside`
LEAST_INDEX = 1.3  # of solids that are lit from inside
DIGITS = 4

COLOURS = ("eta", "k", "sigma_a", "sigma_s", "albedo")
HELD = ("kind", "coating", "measured")  # no values

# Kinds ---------------------------------------------------------------------------------------------------------------


def _one(rng: np.random.Generator, number: int) -> Stack:
    """A metal, or glass."""
    return Stack([coat(rng)]) if number % 2 else _until(lambda: Stack([base(rng)]), _metal)


def _filmed(rng: np.random.Generator, number: int) -> Stack:
    """Up to two dielectrics over a metal that has a film, every third time on the first dielectric as well."""
    layers = list(_until(lambda: coated(rng, number % 3), _metal).layers)
    filmed = [-1, *([0] if number % 3 == 2 else [])]
    for n in filmed:
        film = Film(eta=float(rng.uniform(1.3, 2.4)), thickness_nm=float(rng.uniform(80, 800)))
        layers[n] = Interface.from_dict({**layers[n].to_dict(), "films": [film.to_dict()]})
    return Stack(layers)


def _until(drawn: Callable[[], Stack], fits: Callable[[Stack], bool]) -> Stack:
    while not fits(stack := drawn()):
        pass
    return stack


def _opaque(stack: Stack) -> bool:
    return not stack.transmits


def _anisotropic(stack: Stack) -> bool:
    return _opaque(stack) and any(isinstance(each.alpha, tuple) for each in stack.interfaces)


def _metal(stack: Stack) -> bool:
    return stack.kinds[-1] == "conductor"


def _dense(stack: Stack) -> bool:
    return _index_below(stack) >= LEAST_INDEX


@dataclass(frozen=True)
class Kind:
    """Stacks that `draw` makes of random numbers and a running number, drawn again until one `fits`.

    incident: "above", "both" sides, "inside" with one direction from above, or "grazing", from above to there.
    """

    name: str
    draw: Callable[[np.random.Generator, int], Stack]
    fits: Callable[[Stack], bool] = _opaque
    incident: str = "above"


FIRST = (
    Kind("one interface", _one, lambda stack: True, "both"),
    Kind("two interfaces", lambda rng, n: coated(rng, 1)),
    Kind("three interfaces", lambda rng, n: coated(rng, 2)),
    Kind("five interfaces", lambda rng, n: coated(rng, 4)),
    Kind("brushed", lambda rng, n: coated(rng, n % 3, "brushed"), _anisotropic),
    Kind("turned", lambda rng, n: coated(rng, n % 3, "turned"), _anisotropic),
    Kind("absorbing", tinted),
    Kind("scattering", cloudy),
    Kind("diffuse base", painted),
    Kind("films", _filmed),
    Kind("pane", lambda rng, n: (milky if n % 3 == 2 else clear)(rng, 2 * n + 1), lambda stack: True, "both"),
    Kind("from inside", lambda rng, n: clear(rng, 2 * n), _dense, "inside"),
)

#: Stacks as people make them. Very rough ones are panes: what very rough solids pass has an edge that no nodes resolve.
SECOND = tuple(
    Kind(name, draw, _opaque if draw is random_stacks.many_coats else lambda stack: True, "grazing")
    for name, draw in (
        ("anodised aluminium", random_stacks.anodised),
        ("car paint", random_stacks.car_paint),
        ("varnished wood", random_stacks.varnished),
        ("glaze", random_stacks.glazed),
        ("brushed under lacquer", random_stacks.lacquered),
        ("frosted pane", random_stacks.frosted),
        ("wet asphalt", random_stacks.wet_asphalt),
        ("four to six coats", random_stacks.many_coats),
        ("very smooth", random_stacks.very_smooth),
        ("very rough", lambda rng, n: random_stacks.very_rough(rng, 2 * n + 1)),
        ("large steps", random_stacks.large_steps),
        ("dark", random_stacks.dark),
        ("crossed brushing", random_stacks.crossed),
    )
)

# Cases ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A stack of the benchmark, and the directions (N, 3) that light comes from, those from inside with z < 0.

    often: whether light is scattered any number of times between the facets of an interface, or once; edition: its
    number.
    """

    id: str
    kind: str
    often: bool
    stack: Stack
    incident: Array
    edition: int = 1

    @property
    def symmetric(self) -> bool:
        """Whether the plane of incidence is a plane of symmetry."""
        return all(i.alpha_u == i.alpha_v for i in Material.of(self.stack, as_described).interfaces)

    @property
    def eta(self) -> float:
        """Index below over that above; 1 for an opaque stack."""
        return _index_below(self.stack) if self.stack.transmits else 1.0

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as `schema.json` describes them."""
        return {
            "id": self.id,
            "kind": self.kind,
            "bounces": "any" if self.often else "one",
            "material": self.stack.to_dict(),
            "thin": self.stack.thin,
            "index_below": self.eta if self.stack.transmits else None,
            "layers": [_explicit(layer) for layer in Material.of(self.stack, as_described).solid().layers],
            "incident": self.incident.tolist(),
        }

    @classmethod
    def from_dict(cls, fields: dict[str, Any], edition: int) -> Case:
        """The inverse of `to_dict`, for a case of an edition."""
        stack = Stack.from_dict(fields["material"])
        incident = np.array(fields["incident"])
        incident.flags.writeable = False  # candidates are handed it
        return cls(fields["id"], fields["kind"], fields["bounces"] == "any", stack, incident, edition)


def _explicit(layer: LayerValues) -> dict[str, Any]:
    """Every value of a layer, colours always as three."""
    values = {name: value for name, value in vars(layer).items() if value is not None and name not in HELD}
    colours = {name: list(np.broadcast_to(values[name], 3).tolist()) for name in COLOURS if name in values}
    films = [{name: value for name, value in vars(film).items()} for film in values.pop("films", ())]
    return {"kind": layer.kind, **values, **colours, **({"films": films} if films else {})}


# Editions ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Edition:
    """Stacks of some kinds, `of_each` drawn from random numbers of a `seed`.

    least, least_brushed: alpha of interfaces of one and of two roughnesses, so that a model can be evaluated; often:
    whether facets are met often in all stacks, or in four of ten; central: nodes of candidates in the first row of
    bins, None for as many as in others.
    """

    number: int
    kinds: tuple[Kind, ...]
    seed: int
    of_each: int
    least: float
    least_brushed: float
    often: bool
    central: int | None

    @property
    def format(self) -> str:
        return f"layered-benchmark {self.number}"

    @property
    def data(self) -> Traversable:
        """The folder of its files."""
        return resources.files("velatura.benchmark") / self.format.replace(" ", "-")

    def drawn(self, kind: Kind, number: int, seed: int | None = None) -> Case:
        """A case, independent of the others that are drawn; of another seed than the edition's, if one is given."""
        rng = np.random.default_rng([self.seed if seed is None else seed, number, *kind.name.encode()])
        stack = _written(_until(lambda: kind.draw(rng, number), kind.fits), self.least, self.least_brushed)
        id = f"{kind.name.replace(' ', '-')}-{number:02d}"
        stack = stack.replace(name=id)
        turns = rng.integers(0, 180, 8)  # degrees, where there is no symmetry
        case = Case(id, kind.name, self.often or number // 2 % 2 == 1, stack, np.empty((0, 3)), self.number)
        cosines = np.array(_cosines(kind, stack))
        phi = np.radians(turns[: len(cosines)]) * (not case.symmetric)
        sine = np.sqrt(1 - cosines**2)
        incident = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosines], axis=1)
        return replace(case, incident=incident)

    def all_drawn(self, of_each: int | None = None, seed: int | None = None) -> Iterator[Case]:
        """Every case, or others of its kinds."""
        numbers = range(of_each or self.of_each)
        return (self.drawn(kind, number, seed) for kind in self.kinds for number in numbers)


EDITIONS: Mapping[int, Edition] = {
    1: Edition(1, FIRST, seed=2026, of_each=10, least=0.02, least_brushed=0.05, often=False, central=None),
    2: Edition(2, SECOND, seed=2027, of_each=6, least=0.005, least_brushed=0.02, often=True, central=16),
}


def known(number: int) -> Edition:
    """The edition of that number.

    Raises:
        InvalidInput: there is none.
    """
    if number not in EDITIONS:
        raise InvalidInput(f"edition: must be one of {', '.join(map(str, EDITIONS))}, got {show(number)}")
    return EDITIONS[number]


@cache
def edition(number: int = 1) -> tuple[Case, ...]:
    """The cases of an edition that come with the package.

    Raises:
        InvalidInput: an unknown edition.
    """
    found = json.loads((known(number).data / "stacks.json").read_text(encoding="utf-8"))
    return tuple(Case.from_dict(fields, number) for fields in found["stacks"])


def chosen(kinds: Sequence[str] | None = None, number: int = 1) -> tuple[Case, ...]:
    """The cases of some kinds of an edition that come with the package; of all if there are none.

    Raises:
        InvalidInput: an unknown edition or kind.
    """
    names = [kind.name for kind in known(number).kinds]
    for name in kinds or ():
        if name not in names:
            raise InvalidInput(unknown("kind", name, names))
    return tuple(case for case in edition(number) if not kinds or case.kind in kinds)


def _written(stack: Stack, least_alpha: float, least_brushed: float) -> Stack:
    """The stack with its numbers rounded as they are written, and no interface too smooth."""
    flat = stack.flat()
    least = {}
    for name in flat:
        if name.endswith("_alpha_u"):
            both = name, f"{name[:-1]}v"
            brushed = flat[both[0]] != flat[both[1]]
            least.update(dict.fromkeys(both, least_brushed if brushed else least_alpha))

    def rounded(name: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(round(x, DIGITS) for x in value)
        return round(max(value, least.get(name, value)), DIGITS) if isinstance(value, float) else value

    return stack.replace(**{name: rounded(name, value) for name, value in flat.items() if name != "exterior"})


def _cosines(kind: Kind, stack: Stack) -> list[float]:
    """Those of the directions of incidence; negative from inside."""
    if kind.incident == "grazing":
        return list(GRAZING)
    if kind.incident == "inside":
        return [OUTSIDE, *_inside(stack)]
    return [*THROUGH, *(-c for c in THROUGH)] if stack.transmits else list(COSINES)


def _inside(stack: Stack) -> list[float]:
    """Cosines of some momenta n sin, the last of them some way from the critical angle to grazing."""
    index = _index_below(stack)
    return [-float(np.sqrt(1 - (p / index) ** 2)) for p in (*MOMENTA, 1 + DEEP * (index - 1))]


def _index_below(stack: Stack) -> float:
    return float(Material.of(stack, as_described).below)
