"""A wish for the colour of a diffuse base, or of a medium that scatters, as it is seen from outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from velatura.inverse.wishes.wish import Lacking, Wish, colour
from velatura.model.lobe_statistics import StackLobes
from velatura.stack import Diffuse, Material, Medium, MediumValues, Stack

if TYPE_CHECKING:
    from velatura.inverse.fitting.free_values import Free


class Body(Wish):
    """All that is reflected in no lobe: the body reflection of the dichromatic model (Shafer 1985)."""

    key: ClassVar[str] = "body"

    def shown(self, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
        return {"energy": colour(seen.remainder[:, n])}

    def moved(self, free: Free, stack: Stack) -> Free | None:
        if stack.base:
            return free if free.keys == ("albedo",) else None
        return free if free.keys == ("sigma_a",) and free.layer in _scattering(stack) else None

    def lacking(self, stack: Stack) -> Lacking | None:
        if stack.base or ((layers := _scattering(stack)) and not any(_painted(stack.layers[n]) for n in layers)):
            return None
        if _scattering(stack):
            return Lacking("body: pigments give its colour; choose their concentrations by velatura paint")
        if not stack.transmits:
            last = len(stack.layers) - 1
            return Lacking(f"body: no medium scatters, and layer {last} ({stack.kinds[last]}) is no diffuse base")
        below = stack.with_layers([*stack.layers, Diffuse(albedo=0.5)]).model_copy(update={"thin": False})
        return Lacking("body: no medium scatters, and there is no diffuse base", "a diffuse base below", below)


def _scattering(stack: Stack) -> list[int]:
    """Layers that scatter."""
    layers = Material.of(stack).layers
    return [n for n, each in enumerate(layers) if isinstance(each, MediumValues) and (each.sigma_s * each.depth).any()]


def _painted(layer: Any) -> bool:
    return isinstance(layer, Medium) and bool(layer.pigments)
