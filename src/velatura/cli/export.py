"""`velatura export`: a material for other programs, as code, as JSON, as a scene, or as fitted parameters."""

from __future__ import annotations

import contextlib
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from velatura import files
from velatura.cli import options
from velatura.errors import InvalidInput
from velatura.exports import FORMATS, check_writable, taking
from velatura.exports import export as exported
from velatura.progress import bar

To = Enum("To", {name: name for name in FORMATS}, type=str)  # type: ignore[misc]
_SHADERS = ", ".join(taking("constant"))
_BOUND = ", ".join(taking("binding"))
_MAPS = ", ".join(taking("maps"))


def export(
    material: options.Material,
    to: Annotated[To, typer.Option("--to", help="The format of the file.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The file; default: standard output.")
    ] = None,
    model: options.Model = None,
    constant: Annotated[
        list[str] | None,
        typer.Option(
            "--constant",
            metavar="KEY",
            help=f"For {_SHADERS}: a parameter that never changes (layer0_eta), or all; may be repeated.",
        ),
    ] = None,
    prefix: Annotated[
        str | None,
        typer.Option(
            help="For shaders: begins all names, so that one program may hold several materials; default: vt."
        ),
    ] = None,
    group: Annotated[
        int | None, typer.Option(min=0, help=f"For {_BOUND}: the group, set or space of textures; default: 0.")
    ] = None,
    binding: Annotated[
        int | None, typer.Option(min=0, help=f"For {_BOUND}: the binding of the first texture; default: 0.")
    ] = None,
    baked: Annotated[
        bool,
        typer.Option("--baked", help="For shaders, without textures: read the lobes over direction from a texture."),
    ] = False,
    half: Annotated[bool, typer.Option("--half", help="For shaders: write textures as halves of floats.")] = False,
    tables: Annotated[
        Path | None,
        typer.Option(
            metavar="F",
            help="For shaders: a file of all tables, which several materials share, in place of one for each.",
        ),
    ] = None,
    mesh: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|F",
            help="For gltf: what shows the material, an object of scenes such as sphere, or a file of glTF.",
        ),
    ] = None,
    maps: Annotated[
        int | None,
        typer.Option(
            metavar="SIZE",
            help=f"For {_MAPS}: bake textures into images of at most SIZE x SIZE texels, beside the file.",
        ),
    ] = None,
    settings: options.Settings = None,
) -> None:
    """Write a material as a file of another program."""
    if output is None and not FORMATS[to.value].is_text:
        raise InvalidInput(f"--to {to.value}: is no text; name its file with -o")
    if output is not None:
        check_writable(output, to.value)
    if tables is not None:
        files.check_writable(tables, "a file of tables", (".bin",))
    chosen: dict[str, Any] = {"constant": constant or None, "prefix": prefix, "group": group, "binding": binding}
    chosen |= {"baked": baked or None, "half": half or None, "tables": tables, "mesh": mesh, "maps": maps}
    chosen = {name: value for name, value in chosen.items() if value is not None}
    for name in chosen:
        if name not in FORMATS[to.value].options:
            raise InvalidInput(f"--{name}: only for --to {', '.join(taking(name))}, not for {to.value}")
    stack, switches = options.read(material, settings)
    folder = output.parent if output else None
    from velatura.stack.paths import beside

    with contextlib.ExitStack() as within:
        placed = within.enter_context(beside(stack, folder)) if folder else stack
        if maps is not None:
            chosen["progress"] = within.enter_context(bar("Baking images"))
        made = exported(placed, to.value, options.model_name(model), folder=folder, **chosen, **switches)
        written = made.save(output) if output else []
    for note in made.notes:
        print(note, file=sys.stderr)
    if output is None:
        print(made.text, end="")
        if unwritten := [*made.beside, *map(str, made.apart)]:
            print(f"not written without -o: what lies beside it ({', '.join(unwritten)})", file=sys.stderr)
        return
    path, *others = written
    print(path if not others else f"{path}, and beside it {', '.join(map(str, others))}")
