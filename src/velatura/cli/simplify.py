"""`velatura simplify`: the stack with fewer interfaces that comes closest to a given one."""

from __future__ import annotations

from typing import Annotated

import typer

from velatura.cli import fit, options


def simplify(
    material: options.Material,
    interfaces: Annotated[int, typer.Option(min=1, metavar="N", help="Interfaces to keep.")],
    output: fit.Output = None,
    model: options.Model = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Find the stack of fewer interfaces closest to a material."""
    # Refuse what cannot work before anything slow begins
    stack, switches = options.read(material, settings)
    from velatura import inverse

    fit.check(output)
    found = inverse.simplify(stack, interfaces, options.model_name(model), **switches)
    fit.show(found, output, as_json)
