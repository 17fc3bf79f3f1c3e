"""Thin films on the interfaces of a random stack, as users write them or anywhere in their range."""

from __future__ import annotations

import numpy as np

from velatura.errors import InvalidInput
from velatura.stack import Film, Interface, Layer, Stack

COUNTS = (1, 2, 3, 8)  # of films on an interface,
SHARES = (0.4, 0.3, 0.2, 0.1)  # and how often


def filmed(stack: Stack, rng: np.random.Generator, absurd: bool = False) -> Stack:
    """The stack with films on two interfaces in three, where they fit their neighbours; else as it is."""
    for _ in range(20):
        layers: list[Layer] = [
            layer.model_copy(update={"films": _films(rng, absurd)})
            if isinstance(layer, Interface) and rng.random() < 2 / 3
            else layer
            for layer in stack.layers
        ]
        try:
            return Stack(layers, exterior=stack.exterior, thin=stack.thin)
        except InvalidInput:
            continue
    return stack


def _films(rng: np.random.Generator, absurd: bool) -> tuple[Film, ...]:
    def index() -> float:
        return float(10 ** rng.uniform(-3, 4) if absurd and rng.random() < 0.5 else rng.uniform(1, 4))

    def extinction() -> float:
        return float(10 ** rng.uniform(-5, 4) if absurd else rng.uniform(0, 1))

    return tuple(
        Film(
            eta=(index(), index(), index()) if rng.random() < 0.3 else index(),
            k=extinction() if rng.random() < 0.4 else 0.0,
            thickness_nm=float(rng.uniform(0, rng.choice([500, 5000]))),
        )
        for _ in range(rng.choice(COUNTS, p=SHARES))
    )
