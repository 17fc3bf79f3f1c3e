"""A stack that transmits, as its other side sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from velatura.ops import Value


def with_index_below(kinds: Sequence[str], values: Mapping[str, Value], thin: bool) -> dict[str, Value]:
    """The values of a stack whose last index is that of the medium that light leaves into: outside, for a thin pane."""
    if not thin:
        return {**values}
    return {**values, f"layer{len(kinds) - 1}_eta": values["exterior"]}


def turned_over(kinds: Sequence[str], values: Mapping[str, Value]) -> tuple[list[str], dict[str, Value]]:
    """Kinds and values (numbers and colours by flat name) of a stack of dielectrics and media, seen from below.

    Directions are mirrored with it, so that tangents and rotations stay as they are.
    """
    last = len(kinds) - 1
    turned: dict[str, Value] = {"exterior": values[f"layer{last}_eta"]}
    above = values["exterior"]
    for i, kind in enumerate(kinds):
        prefix = f"layer{i}_"
        layer = {name.removeprefix(prefix): value for name, value in values.items() if name.startswith(prefix)}
        if kind == "dielectric":
            layer["eta"], above = above, layer["eta"]
        turned.update({f"layer{last - i}_{key}": value for key, value in layer.items()})
    return list(reversed(kinds)), turned
