"""Flat names of a stack's values: `layer0_eta`, `layer0_alpha_u`, `layer1_sigma_a`, ...

Renderers and command lines address single values by them. They follow from the declared parameters of the layers. Here
they are turned into the mapping that a file would hold, so that they are validated as a file is.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from velatura.errors import InvalidInput, within
from velatura.stack.layers import COEFFICIENTS, EXTERIOR, KINDS, LAYERS, PERFECT, Medium, film_key, has
from velatura.stack.schema import parameters, unknown
from velatura.stack.spectra import MIRROR, Measured, Named
from velatura.stack.values import RGB, Colour, Film, Scalar, Substance, Varying

_OPTIONS = ("name", "source", "exterior", "thin")
_LAYER = re.compile(r"layer(\d{1,9})_(\w+)")
_FILM = re.compile(r"film(\d)_(\w+)")
_PIGMENT = re.compile(r"pigment(\d{1,2})_concentration")
_OF_FILMS = {key: declared for key, declared in parameters(Film).items() if isinstance(declared, Scalar)}


@dataclass(frozen=True)
class Address:
    """Where a value of a material is: its layer (None for the exterior, or a weight), its key there, its declaration,
    and the numbers of the parts that it is in, the outermost mixture's first."""

    layer: int | None
    key: str
    declared: Scalar
    parts: tuple[int, ...] = ()

    @functools.cached_property
    def name(self) -> str:
        """The flat name."""
        return prefix(self.parts) + (self.key if self.layer is None else f"layer{self.layer}_{self.key}")

    @property
    def film(self) -> int | None:
        """The number of its film; None of a value of none."""
        parts = _FILM.fullmatch(self.key)
        return int(parts[1]) if parts else None

    @property
    def role(self) -> str:
        """Its key; those of all films are the same, `film_eta`, `film_k` and `film_thickness_nm`."""
        return self.key if self.film is None else self.key.replace(str(self.film), "", 1)

    @property
    def colour(self) -> bool:
        """Whether the value may differ between colours."""
        return isinstance(self.declared, Colour)

    def plain(self, value: Any, refusal: str) -> float | RGB:
        """A value of the stack as numbers.

        Raises:
            InvalidInput: it varies over the surface; `refusal` ends the message.
        """
        if isinstance(value, Varying):
            raise InvalidInput(f"{self.name}: is a {value.what}, and {refusal}")
        return self.declared.reduced(value) if isinstance(value, Measured) else value


def prefix(parts: Sequence[int]) -> str:
    """How the flat names of what a part holds begin, by the numbers of the parts that it is in."""
    return "".join(f"part{number}_" for number in parts)


@functools.lru_cache(256)
def addresses(kinds: tuple[str, ...], films: tuple[int, ...] = ()) -> tuple[Address, ...]:
    """All values of a stack of these kinds of layers, each with as many films; none unless given."""
    found = [Address(None, "exterior", EXTERIOR)]
    for index, kind in enumerate(kinds):
        for key, declared in has(kind).items():
            if isinstance(declared, Scalar):
                found += [Address(index, part, declared) for part in declared.parts(key)]
        for k in range(films[index] if films else 0):
            found += [Address(index, film_key(k, key), declared) for key, declared in _OF_FILMS.items()]
    return tuple(found)


def addressed(name: str) -> tuple[Address, ...]:
    """The values that a flat name stands for, two for `layer0_alpha`; none for a name of anything else."""
    parts = _LAYER.fullmatch(name)
    if not parts:
        return (Address(None, name, EXTERIOR),) if name == "exterior" else ()
    of_film = _FILM.fullmatch(parts[2])
    if of_film and of_film[2] in _OF_FILMS:
        return (Address(int(parts[1]), parts[2], _OF_FILMS[of_film[2]]),)
    for layer in LAYERS.values():
        for key, declared in parameters(layer).items():
            if isinstance(declared, Scalar) and parts[2] in (key, *declared.parts(key)):
                wanted = declared.parts(key) if parts[2] == key else (parts[2],)
                return tuple(Address(int(parts[1]), part, declared) for part in wanted)
    return ()


def _keys(kind: str) -> list[str]:
    """The keys that a layer of a kind may be given, those of single values included."""
    found: list[str] = []
    for key, declared in has(kind).items():
        parts = declared.parts(key) if isinstance(declared, Scalar) else ()
        found += [key, *(part for part in parts if part != key)]
    return found


def document(kinds: Sequence[str] | None, values: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping of a new stack with the given flat values; `kinds` None: read off the names."""
    layers = _split(values)[1]
    kinds = _inferred_kinds(layers) if kinds is None else kinds
    for kind in kinds:
        if kind not in KINDS:
            raise InvalidInput(unknown("kind of layer", kind, KINDS))
    for index, fields in layers.items():
        if len({"alpha_u", "alpha_v"} & set(fields)) == 1 and "alpha" not in fields:
            raise InvalidInput(f"layer {index}: alpha_u and alpha_v only together; alpha is for both")
    blank = [
        {kind if kind in LAYERS else "interface": {"conductor": MIRROR} if kind == "mirror" else {}} for kind in kinds
    ]
    return changed({"layers": blank}, kinds, values)


def changed(mapping: Mapping[str, Any], kinds: Sequence[str], values: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping of a stack of these kinds with some flat values changed."""
    options, layers = _split(values)
    entries = list(mapping["layers"])
    for index, fields in layers.items():
        # Accept only what this layer has
        if index >= len(entries):
            raise InvalidInput(f"layer{index}_{next(iter(fields))}: the last layer is layer {len(entries) - 1}")
        keys = _keys(kinds[index])
        for key in fields:
            part = ("films" in keys and _FILM.fullmatch(key)) or ("pigments" in keys and _PIGMENT.fullmatch(key))
            if key not in keys and not part:
                where = f"layer{index}_{key}: layer {index} ({kinds[index]})"
                raise InvalidInput(f"{where} has no {key}, only {', '.join(keys)}")
        # Write it in
        ((entry, old),) = entries[index].items()
        with within(f"layer {index} ({entry})"):
            entries[index] = {entry: _merged(old, fields)}
    return {**mapping, **options, "layers": entries}


def _split(values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[int, dict[str, Any]]]:
    """The stack's own keys, and those of each layer by its number."""
    options: dict[str, Any] = {}
    layers: dict[int, dict[str, Any]] = {}
    for name, value in values.items():
        parts = _LAYER.fullmatch(name)
        if parts:
            layers.setdefault(int(parts[1]), {})[parts[2]] = value
        elif name in _OPTIONS:
            options[name] = value
        else:
            examples = (*_OPTIONS, *(f"layer0_{key}" for kind in KINDS for key in _keys(kind)))
            raise InvalidInput(unknown("parameter", name, examples))
    return options, layers


def _inferred_kinds(layers: Mapping[int, Mapping[str, Any]]) -> list[str]:
    kinds = []
    for index in range(len(layers)):
        if index not in layers:
            raise InvalidInput(f"layer {index}: no value is given, but there are values of layer {max(layers)}")
        kinds.append(_inferred_kind(layers[index]))
    return kinds


def _inferred_kind(fields: Mapping[str, Any]) -> str:
    if fields.get("conductor") == MIRROR:
        return "mirror"
    if "conductor" in fields or "k" in fields:
        return "conductor"
    kinds = [next(iter(layer.lacks)) for layer in LAYERS.values()]
    return max(kinds, key=lambda kind: len(set(fields) & set(_keys(kind))))


def _merged(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of one layer with some of them changed."""
    fields = {
        **old,
        **{key: value for key, value in new.items() if not (_FILM.fullmatch(key) or _PIGMENT.fullmatch(key))},
    }

    # Let a value of a film replace that one, or begin the next film
    films = [dict(film) if isinstance(film, Mapping) else film.to_dict() for film in fields.get("films", ())]
    for key, value in sorted(new.items()):
        parts = _FILM.fullmatch(key)
        if not parts:
            continue
        number = int(parts[1])
        if number > len(films):
            raise InvalidInput(f"{key}: the next film is film {len(films)}")
        films += [{}] if number == len(films) else []
        films[number][parts[2]] = value
    fields = {**fields, "films": films} if films else fields

    # Let a new metal replace indices, and a new index a part of a named metal
    if "conductor" in new:
        fields = {key: value for key, value in fields.items() if key in new or key not in ("eta", "k")}
    elif "conductor" in old and ("eta" in new or "k" in new):
        metal = fields.pop("conductor")
        fields = {**(PERFECT if metal == MIRROR else {"eta": metal, "k": metal}), **fields}
    metal = _name(fields.get("eta"), "eta")
    if metal and metal == _name(fields.get("k"), "k"):
        fields = {"conductor": metal, **{key: value for key, value in fields.items() if key not in ("eta", "k")}}

    # Let the page of a substance replace the whole index
    if "k" not in new and _is_page(new.get("eta")):
        fields.pop("k", None)

    # Let a phase function replace the asymmetry of another, and the other way round
    for one, other in (("phase", "g"), ("g", "phase")):
        if one in new and other not in new:
            fields.pop(other, None)

    # Let a concentration replace that of its pigment
    pigments = list(fields.get("pigments", ()))
    for key, value in new.items():
        if parts := _PIGMENT.fullmatch(key):
            number = int(parts[1])
            if number >= len(pigments):
                has = f"the last pigment is pigment {len(pigments) - 1}" if pigments else "there are no pigments"
                raise InvalidInput(f"{key}: {has}")
            old_one = pigments[number]
            as_written = old_one if isinstance(old_one, Mapping) else old_one.to_dict()
            pigments[number] = {**as_written, "concentration": value}
    fields = {**fields, "pigments": pigments} if pigments else fields

    # Let pigments replace what follows from them, and a part of that the pigments
    if "pigments" in new:
        fields = {key: value for key, value in fields.items() if key in new or key not in COEFFICIENTS}
    elif old.get("pigments") and any(key in new for key in COEFFICIENTS):
        mixed = Medium.from_dict(old)
        fields = {**{key: mixed.written(key) for key in COEFFICIENTS}, **fields}
        fields.pop("pigments")

    # Let an axis replace its part of alpha
    if "alpha_u" in new or "alpha_v" in new:
        alpha = fields.get("alpha", 0.0)
        u, v = alpha if isinstance(alpha, list | tuple) and len(alpha) == 2 else (alpha, alpha)
        fields["alpha"] = [fields.pop("alpha_u", u), fields.pop("alpha_v", v)]
    return fields


def _is_page(value: Any) -> bool:
    return isinstance(value, Substance) or (isinstance(value, Mapping) and "refractiveindex" in value)


def _name(value: Any, part: str) -> str | None:
    """The name, where the value is the spectrum of that part of an index."""
    if isinstance(value, Named):
        return value.name if value.part == part else None
    return value if isinstance(value, str) else None
