"""Bati et al. 2021, figure 24: a pair of dielectrics on a diffuse base: black, grey, orange."""

from __future__ import annotations

from velatura.figures.looks import Looks, Panel, inverted
from velatura.stack import RGB, Diffuse, Stack

ALBEDOS: dict[str, float | RGB] = {"black": 0.0, "grey": 0.5, "orange": (0.5, 0.3, 0.1)}


def stacks() -> dict[str, Stack]:
    """By the colour of the base."""
    (pair,) = inverted(("24",)).values()
    return {name: Stack([*pair.layers, Diffuse(albedo=albedo)]) for name, albedo in ALBEDOS.items()}


FIGURE = Looks(stacks, [Panel(f"({part}) {name} base", (name,)) for part, name in zip("abc", ALBEDOS)])
compute, draw = FIGURE.compute, FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "bati2021-24.png")
