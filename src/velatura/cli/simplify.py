"""`velatura simplify`: the stack with fewer interfaces that comes closest to a given one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from velatura.cli import fit, invert, options, progress


def simplify(
    material: options.Material,
    interfaces: Annotated[int, typer.Option(min=1, metavar="N", help="Interfaces to keep.")],
    output: fit.Output = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw both to M, ending in .png, here.")] = False,
    model: options.Model = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Find the stack of fewer interfaces closest to a material."""
    # Refuse what cannot work before anything slow begins
    described, switches = options.read(material, settings)
    from velatura import inverse
    from velatura.inverse.fitting.simplify import compared
    from velatura.stack import single

    stack = single(described, "simplify")

    fit.check(output)
    picture, name = invert.picture(material) if plot else None, Path(material).stem
    with progress.clock(f"Simplifying {name}"):
        found = inverse.simplify(stack, interfaces, options.model_name(model), **switches)
    if picture:
        fit.draw(compared(stack, found.model), found, stack.name or name, picture)
    fit.show(found, output, picture, as_json)
