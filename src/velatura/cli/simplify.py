"""`velatura simplify`: the stack with fewer interfaces that comes closest to a given one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from velatura.cli import fit, invert, options, progress

if TYPE_CHECKING:
    from velatura.inverse import MixtureFit


def simplify(
    material: options.Material,
    interfaces: Annotated[int, typer.Option(min=1, metavar="N", help="Interfaces to keep.")],
    output: fit.Output = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw both to M, ending in .png, here.")] = False,
    model: options.Model = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Find the stack of fewer interfaces closest to a material.

    Of a mixture each stack is simplified for itself; with --plot each has a picture of its own, such as M-part0.png.
    """
    # Refuse what cannot work before anything slow begins
    described, switches = options.read(material, settings)
    from velatura import inverse
    from velatura.inverse.fitting.simplify import compared
    from velatura.stack.flat_names import prefix

    fit.check(output)
    name, chosen = Path(material).stem, options.model_name(model)
    stacks = {prefix(path).rstrip("_"): stack for path, stack in described.leaves()}
    pictures = {
        part: invert.picture(f"{name}-{part}" if part else material)
        for part, stack in stacks.items()
        if plot and (not part or len(stack.interfaces) > interfaces)
    }
    with progress.clock(f"Simplifying {name}"):
        found = inverse.simplify(described, interfaces, chosen, **switches)
    parts = found.parts if isinstance(found, inverse.MixtureFit) else {"": found}
    for part, picture in pictures.items():
        title = " ".join(filter(None, (stacks[part].name or name, part)))
        fit.draw(compared(stacks[part], parts[part].model), parts[part], title, picture)
    if isinstance(found, inverse.MixtureFit):
        _show(found, output, list(pictures.values()), as_json)
    else:
        fit.show(found, output, pictures.get(""), as_json)


def _show(found: MixtureFit, output: Path | None, pictures: list[Path], as_json: bool) -> None:
    """Write the mixture, and print it with the errors of its parts."""
    from velatura.stack import save

    if output:
        save(found.material, output)
    if as_json:
        print(json.dumps({"model": found.model.name, **found.to_dict()}, allow_nan=False))
        return
    for part, each in found.parts.items():
        print(f"{part}:")
        fit.report(each)
    fit.conclude(found.model, found.material, output, pictures)
