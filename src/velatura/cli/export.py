"""`velatura export`: a material for other programs, as a shader, JSON, a scene of Mitsuba, or a Python script."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from xml.sax.saxutils import escape

import typer

from velatura import files
from velatura.cli import options
from velatura.errors import InvalidInput

if TYPE_CHECKING:
    from velatura.model import Model
    from velatura.stack import Stack


class To(str, Enum):
    """What a material can be exported to."""

    glsl = "glsl"
    json = "json"
    mitsuba_xml = "mitsuba-xml"
    python = "python"


ENDINGS = {To.glsl: (".glsl", ".frag"), To.json: (".json",), To.mitsuba_xml: (".xml",), To.python: (".py",)}
TABLES = ".bin"


def export(
    material: options.Material,
    to: Annotated[To, typer.Option("--to", help="The kind of file.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="F", help="The file; else standard output.")
    ] = None,
    model: options.Model = None,
    constant: Annotated[
        list[str] | None,
        typer.Option(
            "--constant",
            metavar="KEY",
            help="For glsl: a parameter that never changes (layer0_eta), or all; may be repeated.",
        ),
    ] = None,
    settings: options.Settings = None,
) -> None:
    """Write a material for other programs: a shader, JSON, a scene of Mitsuba, or a Python script."""
    if output is not None:
        files.check_writable(output, f"{to.value} output", ENDINGS[to])
        if to is To.glsl:
            files.check_writable(_tables(output), "a file of tables", (TABLES,))
    if constant and to is not To.glsl:
        raise InvalidInput(f"--constant: only for --to glsl, not for {to.value}")
    stack, switches = options.read(material, settings)
    from velatura.model import named

    chosen = named(options.model_name(model), **switches)
    if to is To.glsl:
        text, beside = _glsl(stack, chosen, constant or [])
    elif to is To.mitsuba_xml:
        text, beside = _mitsuba_xml(stack, chosen, switches, output.parent if output else None), None
    else:
        text, beside = _WRITERS[to](stack, chosen, switches), None
    if output is None:
        print(text, end="")
        return
    tables = _tables(output)
    if beside is not None:
        with files.whole(tables) as unfinished:
            unfinished.write_bytes(beside)
    with files.whole(output) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
    print(output if beside is None else f"{output}, and its tables {tables}")


def _tables(output: Path) -> Path:
    """The file of a shader's tables, beside it."""
    return output.with_suffix(f".tables{TABLES}")


def _glsl(stack: Stack, model: Model, constant: list[str]) -> tuple[str, bytes | None]:
    """The shader, and the texture of its tables, if it reads any."""
    from velatura.shader import shader
    from velatura.stack import Varying

    free = [name for name, value in stack.flat().items() if not isinstance(value, Varying)]
    made = shader(stack, model, free if constant == ["all"] else constant)
    return made.text, made.tables.tobytes() if "vt_tables" in made.text else None


def _json(stack: Stack, model: Model, switches: Mapping[str, str]) -> str:
    from velatura.model import SWITCHES
    from velatura.shader import constant
    from velatura.stack import Varying, dumps

    numbers = {name: constant(name, value) for name, value in stack.flat().items() if not isinstance(value, Varying)}
    report = {
        "material": json.loads(dumps(stack, "json")),
        "model": {"name": model.name, **{switch: getattr(model, switch) for switch in SWITCHES}},
        "values": {name: value if isinstance(value, float) else value.tolist() for name, value in numbers.items()},
    }
    return json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _mitsuba_xml(stack: Stack, model: Model, switches: Mapping[str, str], folder: Path | None) -> str:
    """A scene to be included; paths are relative to its folder, where Mitsuba looks for them, or absolute without."""
    from velatura.stack import dumps

    strings = {
        "material": json.dumps(json.loads(dumps(stack, "json", folder)), ensure_ascii=False),
        "model": model.name,
    }
    lines = [f'        <string name="{key}" value={_quoted(text)}/>' for key, text in {**strings, **switches}.items()]
    head = "<!-- Needs the plugins of Velatura: import velatura; velatura.register() -->"
    bsdf = ['    <bsdf type="layered" id="material">', *lines, "    </bsdf>"]
    return "\n".join(['<scene version="3.0.0">', f"    {head}", *bsdf, "</scene>", ""])


def _quoted(text: str) -> str:
    """An attribute in single quotes, so that the double ones of JSON stay as they are."""
    return f"'{escape(text, {chr(39): '&apos;'})}'"


def _python(stack: Stack, model: Model, switches: Mapping[str, str]) -> str:
    from velatura.stack import dumps

    fields = json.loads(dumps(stack, "json"))
    layers = [
        f"        vt.{entry.capitalize()}({', '.join(f'{key}={value!r}' for key, value in keys.items())}),"
        for layer in fields.pop("layers")
        for entry, keys in layer.items()
    ]
    given = [f"    {key}={value!r}," for key, value in fields.items()]
    chosen = ", ".join(f"{key}={value!r}" for key, value in {"model": model.name, **switches}.items())
    lines = [
        '"""Written by `velatura export`. As a script it renders material.png, or the file that is named."""',
        "",
        "import sys",
        "",
        "import velatura as vt",
        "",
        "stack = vt.Stack(",
        *given,
        "    layers=[",
        *layers,
        "    ],",
        ")",
        "",
        'if __name__ == "__main__":',
        f"    picture = vt.render(stack, {chosen})",
        '    vt.scenes.write_image(picture, sys.argv[1] if len(sys.argv) > 1 else "material.png")',
        "",
    ]
    return "\n".join(lines)


_WRITERS: dict[To, Callable[[Stack, Model, Mapping[str, str]], str]] = {
    To.json: _json,
    To.python: _python,
}
