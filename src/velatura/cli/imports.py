"""`velatura import`: a material of another program as a stack, and a list of what that cannot carry."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from velatura.cli import fit, options


def import_(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="MaterialX (.mtlx: open_pbr_surface, standard_surface, gltf_pbr, disney_principled), glTF (.gltf, "
            ".glb), or a scene of Mitsuba (.xml) with a principled BSDF.",
        ),
    ],
    output: fit.Output = None,
    material: Annotated[
        str | None, typer.Option("--material", metavar="NAME", help="One of several materials in the file.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Turn a material of another program into a stack.

    Prints it, or writes it to F, and lists on standard error what a stack cannot carry.
    """
    from velatura import imports, stack
    from velatura.stack.paths import held

    fit.check(output)
    found = imports.read(file, material)
    if images := [] if output else held(found.stack):
        print(f"not written without -o: images inside the file ({', '.join(images)})", file=sys.stderr)
    if output:
        stack.save(found.stack, output)
    if as_json:
        left = [vars(each) for each in found.left]
        print(json.dumps({"material": json.loads(stack.dumps(found.stack, "json")), "left": left}, ensure_ascii=False))
        return
    for each in found.left:
        print(f"left: {each}", file=sys.stderr)
    print(output if output else stack.dumps(found.stack), end="\n" if output else "")
