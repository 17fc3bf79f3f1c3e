"""`velatura coat`: a material under a coat, with or without a change of its lobes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from velatura.cli import invert, options

if TYPE_CHECKING:
    from velatura.inverse import Coated
    from velatura.stack import Stack


def coat(
    material: options.Material,
    eta: Annotated[float, typer.Option(min=0.1, max=10.0, metavar="N", help="Index of the coat.")] = 1.5,
    alpha: Annotated[float, typer.Option(min=0.0, max=1.0, metavar="A", help="Roughness of the coat.")] = 0.0,
    keep_appearance: Annotated[
        bool, typer.Option("--keep-appearance", help="Change the material below so that its lobes stay the same.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The coated material (YAML or JSON).")
    ] = None,
    model: options.Model = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Put a coat on a material, and report the change of its lobes."""
    # Refuse what cannot work before anything slow begins
    described, switches = options.read(material, settings)
    from velatura import files, inverse
    from velatura.stack import dumps, save, single

    stack = single(described, "the inverse")

    if output:
        files.check_writable(output, "a material file", invert.ENDINGS)

    name = options.model_name(model)
    coated = inverse.coat(stack, eta, alpha, keep_appearance, model=name, **switches)
    if output:
        save(coated.stack, output)
    if as_json:
        diffuse = {"diffuse": coated.change_of_base()} if coated.diffuse else {}
        answer = {"stack": coated.stack.to_dict(), "coat": coated.own(), "lobes": coated.change(), **diffuse}
        answer |= {"losses": list(coated.losses)} if keep_appearance else {}
        print(json.dumps({"model": coated.model.name, **answer}, allow_nan=False))
        return
    for table in coated.as_tables():
        options.console().print(table)
    for loss in coated.losses:
        print(f"{loss}; this is the nearest")
    if keep_appearance and not coated.losses:
        _say_how_kept(stack, coated)
    else:
        invert.say_for_which(coated.model)
    print(output if output else dumps(coated.stack, "yaml"), end="\n" if output else "")


def _say_how_kept(stack: Stack, coated: Coated) -> None:
    """Print by which model the lobes are kept, and how far they change by the one that renders where it is another."""
    import velatura
    from velatura.model import DEFAULT

    if coated.model.name == DEFAULT or not stack.interfaces:
        invert.say_for_which(coated.model)
        return
    rendered = replace(coated, before=velatura.lobes(stack, 1.0), after=velatura.lobes(coated.stack, 1.0))
    by = {
        quantity: max(
            abs(after - before)
            for row in rendered.change()
            for before, after in zip(row[f"{quantity}_before"], row[f"{quantity}_after"])
        )
        for quantity in ("energy", "alpha")
    }
    print(
        f"Kept by {coated.model.name}; by {DEFAULT}, which renders, energy changes by up to {by['energy']:.4f} "
        f"and alpha by up to {by['alpha']:.4f}: --model {DEFAULT} keeps them by it."
    )
