"""A wish for what a pane passes: its tint, and its blur or haze."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, sqrt, tan
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import model_validator

from velatura.inverse.wishes.wish import Lacking, Wish, colour, compared
from velatura.model.lobe_statistics import StackLobes
from velatura.stack import Interface, Medium, Stack
from velatura.stack.values import Scalar

if TYPE_CHECKING:
    from velatura.inverse.fitting.free_values import Free
    from velatura.inverse.lobes.partial_stack import Array

HAZE = tan(radians(2.5) / 2)  # slope of facets that turn light by 2.5 degrees, beyond which it is haze (ASTM D1003)


class Passed(Wish):
    """All light that leaves below, and its lobe: `alpha`, or in its place `haze`."""

    key: ClassVar[str] = "passed"

    alpha: Annotated[float | None, Scalar("GGX roughness of its lobe", low=0.0, high=1.0, texturable=False)] = None
    haze: Annotated[
        float | None,
        Scalar("share of its lobe that leaves by more than 2.5 degrees", low=0.0, high=0.9995, texturable=False),
    ] = None

    @model_validator(mode="after")
    def _one_blur(self) -> Passed:
        if self.alpha is not None and self.haze is not None:
            raise ValueError("haze: not together with alpha; write one of them")
        if self.haze is not None and self.angle:
            raise ValueError("haze: is that at normal incidence; leave angle out")
        return self

    @property
    def asked_for(self) -> Sequence[str]:
        return ("energy", "alpha", "haze")

    @property
    def goal(self) -> Array:
        return compared(self.energy, roughness(self.haze) if self.alpha is None else self.alpha)

    def shown(self, seen: StackLobes, n: int, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
        assert seen.transmitted
        alpha = float(np.mean(seen.transmitted.alpha[:, n]))
        return {"energy": colour(seen.passed[:, n]), "alpha": alpha, "haze": haze(alpha)}

    def moved(self, free: Free, stack: Stack) -> Free | None:
        tints = self.energy is not None and free.keys == ("sigma_a",)
        blurs = (self.alpha, self.haze) != (None, None) and free.keys[0].startswith("alpha")
        return free if tints or blurs else None

    def lacking(self, stack: Stack) -> Lacking | None:
        if not stack.transmits:
            last = len(stack.layers) - 1
            return Lacking(f"passed: layer {last} ({stack.kinds[last]}) is opaque; end the stack in a dielectric")
        if self.energy is None or any(isinstance(layer, Medium) and layer.depth != 0 for layer in stack.layers):
            return None
        first = next(n for n, layer in enumerate(stack.layers) if isinstance(layer, Interface))
        if len(stack.interfaces) < 2:
            return Lacking("passed: no medium absorbs, and one interface has none above or below it")
        tinted = stack.with_layers([*stack.layers[: first + 1], Medium(depth=1.0), *stack.layers[first + 1 :]])
        return Lacking("passed: no medium absorbs", f"a tinted medium below layer {first}", tinted)


def haze(alpha: float) -> float:
    """Share of a GGX lobe at normal incidence that is turned by more than 2.5 degrees.

    Of facets with slopes of at most t the share is t^2 / (alpha^2 + t^2), from the distribution of visible normals.
    """
    return alpha**2 / (alpha**2 + HAZE**2)


def roughness(share: float | None) -> float | None:
    """The roughness of a lobe of that haze."""
    return None if share is None else HAZE * sqrt(share / (1 - share))
