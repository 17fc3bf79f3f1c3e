"""The formats, and their common part; each is a module with `write(Request) -> Export`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from velatura import files
from velatura.errors import InvalidInput

if TYPE_CHECKING:
    from velatura.model import Model
    from velatura.stack import MaterialLike, Stack


class Format(NamedTuple):
    """A format: how names of its files end, and the endings of what may lie beside them; the module that writes it.

    `constants` says whether values may be worked in, and are parameters otherwise.
    """

    endings: tuple[str, ...]
    module: str
    beside: tuple[str, ...] = ()
    constants: bool = False


_SHADERS = {
    "glsl": (".glsl", ".frag"),
    "glsl450": (".glsl", ".frag", ".comp"),
    "vulkan": (".glsl", ".frag", ".comp"),
    "hlsl": (".hlsl", ".hlsli"),
    "slang": (".slang",),
    "wgsl": (".wgsl",),
}
FORMATS: dict[str, Format] = {
    **{
        name: Format(endings, "velatura.exports.shader", beside=(".tables.bin", ".films.bin"), constants=True)
        for name, endings in _SHADERS.items()
    },
    "osl": Format((".osl",), "velatura.exports.osl", constants=True),
    "blender": Format((".py",), "velatura.exports.blender"),
    "json": Format((".json",), "velatura.exports.json"),
    "mitsuba-xml": Format((".xml",), "velatura.exports.mitsuba_xml"),
    "python": Format((".py",), "velatura.exports.python"),
}


@dataclass(frozen=True)
class Request:
    """A request for an export: a format, a stack, the model with its changed switches, and values that are worked in.

    Paths of textures are relative to `folder`, where the format allows that; absolute without one.
    """

    to: str
    stack: Stack
    model: Model
    switches: Mapping[str, str]
    constant: Collection[str]
    folder: Path | None

    @property
    def constants(self) -> Collection[str]:
        """Names of the values that are worked in; of all that do not vary for ["all"]."""
        from velatura.stack import Varying

        if list(self.constant) != ["all"]:
            return self.constant
        return [name for name, value in self.stack.flat().items() if not isinstance(value, Varying)]


@dataclass(frozen=True)
class Export:
    """A text, and the files that belong beside it, by ending: `.tables.bin` is `gold.tables.bin` beside `gold.glsl`.

    costs: of code, what a call of each function costs, in words.
    """

    text: str
    beside: Mapping[str, bytes] = field(default_factory=dict)
    costs: Mapping[str, str] = field(default_factory=dict)

    def save(self, path: str | Path) -> list[Path]:
        """Write the text to a file, and what belongs beside it; the files that were written, that of the text first.

        Raises:
            InvalidInput: a file cannot be written; an existing file stays.
        """
        path = Path(path)
        for ending, data in self.beside.items():
            with files.whole(path.with_suffix(ending)) as unfinished:
                unfinished.write_bytes(data)
        with files.whole(path) as unfinished:
            unfinished.write_text(self.text, encoding="utf-8")
        return [path, *(path.with_suffix(ending) for ending in self.beside)]


def export(
    material: MaterialLike,
    to: str,
    model: str | Model | None = None,
    *,
    constant: Collection[str] = (),
    folder: str | Path | None = None,
    **switches: Any,
) -> Export:
    """A material for other programs.

    Args:
        material: a stack, a file, or a preset's name.
        to: one of `FORMATS`: a shader in "glsl" (ES 3.00), "glsl450", "vulkan" (GLSL), "hlsl", "slang" or "wgsl"; a
            shader of closures, "osl", or "blender", a script that makes a material of it; "json", the material with its
            numbers; "mitsuba-xml", a scene to be included; "python", a script that renders it.
        model: a named model or its name (None for the default), its choices changed by `switches`.
        constant: for shaders, flat names of values that never change (`layer0_eta`), or ["all"].
        folder: where the text will lie, so that a scene may name its textures relative to it.

    Raises:
        InvalidInput: not a valid material, an unknown format, model, switch or value, or a stack that the format does
            not hold.
    """
    from velatura.model import DEFAULT, named
    from velatura.stack import load
    from velatura.stack.schema import unknown

    if to not in FORMATS:
        raise InvalidInput(unknown("format", to, FORMATS))
    if constant and not FORMATS[to].constants:
        raise InvalidInput(f"constant: only for {', '.join(with_constants())}, not for {to}")
    chosen = named(DEFAULT if model is None else model, **switches)
    request = Request(to, load(material), chosen, switches, constant, None if folder is None else Path(folder))
    written: Export = import_module(FORMATS[to].module).write(request)
    return written


def check_writable(path: Path, to: str) -> None:
    """Refuse a file that an export to this format could not be written to, before there is anything to write.

    Raises:
        InvalidInput: another ending, a folder that is missing, or a file that cannot be replaced.
    """
    files.check_writable(path, f"{to} output", FORMATS[to].endings)
    for ending in FORMATS[to].beside:
        files.check_writable(path.with_suffix(ending), "what belongs beside it", (Path(ending).suffix,))


def with_constants() -> list[str]:
    """The formats of which values may be constants."""
    return [name for name, each in FORMATS.items() if each.constants]
