"""Belcour 2018, figure 14: gold under a scattering medium that grows deeper.

g = 0.7, no absorption and a scattering coefficient of 1, as printed; the depths, the gold's alpha of 0.01 and the
object, a carved urn for the paper's dragon, are chosen here. Beside the medium as published stands the one that
scatters many times, and beside the symmetric form, which the paper renders, the forward one.
"""

from __future__ import annotations

from velatura.figures import cells
from velatura.stack import Interface, Medium, Stack

DEPTHS = (0.1, 0.5, 1.0)
COLUMNS: cells.Columns = {
    title: ("belcour2018", {"reflectance": "fgd", "tir": "published", "medium": medium, "form": form})
    for medium in ("shipped", "doubled")
    for title, form in ((medium, "symmetric"), (f"{medium}, forward", "forward"))
}


def stack(depth: float) -> Stack:
    """The medium over gold."""
    medium = Medium(depth=depth, sigma_s=1.0, g=0.7)
    return Stack([medium, Interface(conductor="Au", alpha=0.01)])


STACKS = {f"depth {depth:g}": stack(depth) for depth in DEPTHS}

_FIGURE = cells.Cells(STACKS, COLUMNS, "urn")
compute, draw = _FIGURE.compute, _FIGURE.draw


if __name__ == "__main__":
    draw(compute(), "belcour2018-14.png")
