"""The light that a program sees from one direction: fields of its lobes, from which values and samples follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from velatura.model.base import Body
from velatura.model.papers import bsdf, precomputed_lobes
from velatura.model.papers.adding import Lobe
from velatura.model.papers.diffuse_base import Base
from velatura.model.papers.lobe_merging import merging
from velatura.model.papers.prepare import PreparedInterface
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.shader.recorder.symbol import SHOWN, Kind, is_colour, number, operand


@dataclass(frozen=True)
class Seen:
    """A recorded body, and all that is known of it once wi is, by its place in the struct.

    `shown` names the weights of its lobes, where they have any; `shares` the energies or chances by which `vt_sample`
    divides its first number, in order. `energies` are those of all parts of a solved material, whose lobes do not hold
    them.
    """

    body: Body
    fields: Mapping[str, Value]
    shown: Sequence[str]
    shares: Sequence[str]
    energies: Sequence[Value] = ()

    def kinds(self) -> dict[str, Kind]:
        """The kind of each field: a part is a colour in all lobes, where it is in one, or may be."""
        wide = {part(name) for name, x in self.fields.items() if is_colour(operand(x)) or _is_energy(name)}
        return {name: "colour" if part(name) in wide else "number" for name in self.fields}


def of_lobes(body: bsdf.Lobed, wi: Direction, weighed: bool, added: bool) -> Seen:
    """The lobes of a body in closed form, with weights where they are `weighed`; `added` where lobes are added up."""
    base = body.above.base if added else None  # the values read of a base hold all of it
    body, shown = _weighed(body) if weighed else (body, [])
    fields = _fields(bsdf.scattered(body, wi), base.importance if base else ())
    energies = [name for name in fields if part(name) in ("energy", "base_energy")]
    return Seen(body, fields, shown, sorted(energies, key=lambda name: name[0] != "t"))


def part(name: str) -> str:
    """Last part of the name of a field: `energy` for `reflected[0].energy`."""
    return name.rpartition(".")[2]


def _is_energy(name: str) -> bool:
    return part(name) == "energy" or name.startswith("base_")


def _weighed(body: bsdf.Lobed) -> tuple[bsdf.Lobed, list[str]]:
    """A body with a weight for each reflected lobe, its base and its transmitted lobe; and their names."""
    count = len(merging(body.above.model, sum(isinstance(layer, PreparedInterface) for layer in body.above.layers)))
    names = [f"reflected[{k}]" for k in range(count)]
    last = number(f"{SHOWN}[{count}]")

    def lobe(seen: Lobe, weight: Value) -> Lobe:
        return replace(seen, energy=seen.energy * weight)

    def weighed(lobes: precomputed_lobes.Lobes) -> precomputed_lobes.Lobes:
        def shown(w: Direction) -> tuple[list[Lobe], Lobe | None]:
            reflected, passed = lobes(w)
            weights = [number(f"{SHOWN}[{k}]") for k in range(count)]
            return [lobe(*pair) for pair in zip(reflected, weights)], lobe(passed, last) if passed else None

        return shown

    def base(w: Direction) -> Base:
        found = body.base(w)
        assert found is not None
        return replace(found, scale=found.scale * last, energy=found.energy * last)

    shown = replace(body, lobes_above=weighed(body.lobes_above), lobes_below=weighed(body.lobes_below))
    if body.below is not None:
        return shown, [*names, "transmitted"]
    return (replace(shown, base_above=base), [*names, "base"]) if body.above.base else (shown, names)


def _fields(seen: bsdf.Scattered, importance: Sequence[Value]) -> dict[str, Value]:
    """All that is known once wi is, by its place in the struct; `importance` is that of nodes over a diffuse base."""
    lobes = {f"reflected[{k}]": lobe for k, lobe in enumerate(seen.reflected)}
    if seen.transmitted is not None:
        lobes["transmitted"] = seen.transmitted
    parts = {place: {"energy": lobe.energy, **lobe.roughness._asdict()} for place, lobe in lobes.items()}
    fields = {f"{place}.{part}": value for place, all_parts in parts.items() for part, value in all_parts.items()}
    if seen.base:
        fields |= {"base_scale": seen.base.scale, "base_energy": seen.base.energy}
    return fields | {f"base_importance{k}": value for k, value in enumerate(importance)}
