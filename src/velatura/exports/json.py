"""The material and its model in JSON, with names and defaults worked out to numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator

from velatura.exports.formats import Export, Request
from velatura.model import SWITCHES
from velatura.shader import constant
from velatura.stack import Interface, Stack, Varying, dumps


def write(request: Request) -> Export:
    """`material` as its file would have it, `model` with all switches, and `values` by flat name."""
    free = [(address, value) for address, value in request.stack.values() if not isinstance(value, Varying)]
    numbers = {address.name: constant(address, value) for address, value in free}
    report = {
        "material": json.loads(dumps(request.stack, "json")),
        "model": {"name": request.model.name, **{switch: getattr(request.model, switch) for switch in SWITCHES}},
        "values": {
            **{name: value if isinstance(value, float) else value.tolist() for name, value in numbers.items()},
            **dict(_of_films(request.stack)),
        },
    }
    return Export(json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _of_films(stack: Stack) -> Iterator[tuple[str, float | list[float]]]:
    for n, layer in enumerate(stack.layers):
        for k, film in enumerate(layer.films if isinstance(layer, Interface) else ()):
            for key in ("eta", "k"):
                channels = list(film.colour(key))
                yield f"layer{n}_film{k}_{key}", channels[0] if len({*channels}) == 1 else channels
            if not isinstance(film.thickness_nm, Varying):
                yield f"layer{n}_film{k}_thickness_nm", film.thickness_nm
