"""Flat names of a stack's values: `layer0_eta`, `layer0_alpha_u`, `layer1_sigma_a`, ...

Renderers and command lines address single values by them. Here they are turned into the mapping that a file would hold,
so that they are validated as a file is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from velatura.errors import InvalidInput
from velatura.stack.layers import LAYERS, Diffuse, Medium
from velatura.stack.schema import unknown
from velatura.stack.spectra import MIRROR, Named

_OPTIONS = ("name", "source", "exterior", "thin")
_SURFACE = ("alpha", "alpha_u", "alpha_v", "rotation")
_KEYS = {
    "dielectric": ("eta", *_SURFACE),
    "conductor": ("eta", "k", "conductor", *_SURFACE),
    "mirror": ("conductor", *_SURFACE),
    "medium": tuple(Medium.model_fields),
    "diffuse": tuple(Diffuse.model_fields),
}


def document(kinds: Sequence[str] | None, values: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping of a new stack with the given flat values; `kinds` None: read off the names."""
    layers = _split(values)[1]
    kinds = _inferred_kinds(layers) if kinds is None else kinds
    for kind in kinds:
        if kind not in _KEYS:
            raise InvalidInput(unknown("kind of layer", kind, _KEYS))
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
        keys = _KEYS[kinds[index]]
        for key in fields:
            if key not in keys:
                where = f"layer{index}_{key}: layer {index} ({kinds[index]})"
                raise InvalidInput(f"{where} has no {key}, only {', '.join(keys)}")
        # Write it in
        ((entry, old),) = entries[index].items()
        entries[index] = {entry: _merged(old, fields)}
    return {**mapping, **options, "layers": entries}


def _split(values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[int, dict[str, Any]]]:
    """The stack's own keys, and those of each layer by its number."""
    options: dict[str, Any] = {}
    layers: dict[int, dict[str, Any]] = {}
    for name, value in values.items():
        parts = re.fullmatch(r"layer(\d{1,9})_(\w+)", name)
        if parts:
            layers.setdefault(int(parts[1]), {})[parts[2]] = value
        elif name in _OPTIONS:
            options[name] = value
        else:
            examples = (*_OPTIONS, *(f"layer0_{key}" for keys in _KEYS.values() for key in keys))
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
    return max(("dielectric", "medium", "diffuse"), key=lambda kind: len(set(fields) & set(_KEYS[kind])))


def _merged(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of one layer with some of them changed."""
    fields = {**old, **new}

    # Let a new metal replace indices, and a new index a part of a named metal
    if "conductor" in new:
        fields = {key: value for key, value in fields.items() if key in new or key not in ("eta", "k")}
    elif "conductor" in old and ("eta" in new or "k" in new):
        metal = fields.pop("conductor")
        fields = {"eta": metal, "k": metal, **fields}
    metal = _name(fields.get("eta"), "eta")
    if metal and metal == _name(fields.get("k"), "k"):
        fields = {"conductor": metal, **{key: value for key, value in fields.items() if key not in ("eta", "k")}}

    # Let an axis replace its part of alpha
    if "alpha_u" in new or "alpha_v" in new:
        alpha = fields.get("alpha", 0.0)
        u, v = alpha if isinstance(alpha, list | tuple) and len(alpha) == 2 else (alpha, alpha)
        fields["alpha"] = [fields.pop("alpha_u", u), fields.pop("alpha_v", v)]
    return fields


def _name(value: Any, part: str) -> str | None:
    """The name, where the value is the spectrum of that part of an index."""
    if isinstance(value, Named):
        return value.name if value.part == part else None
    return value if isinstance(value, str) else None
