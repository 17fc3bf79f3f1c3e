"""The formats; each is a module with `write(Request) -> Export`."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from velatura import files
from velatura.errors import InvalidInput
from velatura.exports.request import LICENCE, Export, Request, facts_beside
from velatura.programs import BAKED
from velatura.version import __version__

if TYPE_CHECKING:
    from velatura.model import Model
    from velatura.stack import MaterialLike


class Format(NamedTuple):
    """A format: how names of its files end, and the endings of what may lie beside them; the module that writes it.

    `options` are those of `export` that it takes besides the model; `is_text` is whether a file of it is text, and
    `has_facts` whether facts are written beside it.
    """

    endings: tuple[str, ...]
    module: str
    beside: tuple[str, ...] = ()
    options: frozenset[str] = frozenset()
    is_text: bool = True
    has_facts: bool = True


_SHADERS = {
    "glsl": (".glsl", ".frag"),
    "glsl450": (".glsl", ".frag", ".comp"),
    "vulkan": (".glsl", ".frag", ".comp"),
    "hlsl": (".hlsl", ".hlsli"),
    "slang": (".slang",),
    "wgsl": (".wgsl",),
}
_OF_SHADERS = frozenset({"constant", "prefix", "half", "tables", "baked"})
_MAPS = frozenset({"maps"})  # of parameters
_BOUND = _OF_SHADERS | {"group", "binding"}  # of languages that say where textures are bound


def _shader(name: str) -> Format:
    options = _OF_SHADERS if name == "glsl" else _BOUND
    return Format(_SHADERS[name], "velatura.exports.shader", (".tables.bin", ".films.bin"), options)


FORMATS: dict[str, Format] = {
    **{name: _shader(name) for name in _SHADERS},
    "osl": Format((".osl",), "velatura.exports.osl", options=frozenset({"constant"})),
    "blender": Format((".py",), "velatura.exports.blender"),
    "three": Format((".js", ".mjs"), "velatura.exports.three"),
    "three-webgpu": Format((".js", ".mjs"), "velatura.exports.three_webgpu"),
    "babylon": Format((".js", ".mjs"), "velatura.exports.babylon"),
    "godot": Format((".tres",), "velatura.exports.godot"),
    "unity": Format((".hlsl",), "velatura.exports.unity", (".cs",), frozenset({"prefix"})),
    "unreal": Format((".py",), "velatura.exports.unreal", (".ush", ".exr"), frozenset({"prefix"})),
    "mtlx": Format((".mtlx",), "velatura.exports.mtlx"),
    "json": Format((".json",), "velatura.exports.json", has_facts=False),
    "mitsuba-xml": Format((".xml",), "velatura.exports.mitsuba_xml"),
    "python": Format((".py",), "velatura.exports.python"),
    "bsdf": Format((".bsdf",), "velatura.exports.bsdf", is_text=False),
    "bsdf-xml": Format((".xml",), "velatura.exports.klems"),
    **{name: Format(baked.endings, "velatura.exports.baked", options=_MAPS) for name, baked in BAKED.items()},
    "usd": Format(BAKED["usd"].endings, "velatura.exports.usd", options=_MAPS),
    **{
        name: Format(BAKED[name].endings, "velatura.exports.gltf", options=_MAPS | {"mesh"})
        for name in ("gltf", "gltf-coat")
    },
}


def export(
    material: MaterialLike,
    to: str,
    model: str | Model | None = None,
    *,
    constant: Collection[str] = (),
    prefix: str | None = None,
    group: int | None = None,
    binding: int | None = None,
    baked: bool = False,
    half: bool = False,
    tables: str | Path | None = None,
    mesh: str | Path | None = None,
    maps: int | None = None,
    folder: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **switches: Any,
) -> Export:
    """A material for other programs.

    Args:
        material: a stack, a mixture, a file, or a preset's name.
        to: one of `FORMATS`: a shader in "glsl" (ES 3.00), "glsl450", "vulkan" (GLSL), "hlsl", "slang" or "wgsl"; a
            shader of closures, "osl", or "blender", a script that makes a material of it; "mtlx", a graph of MaterialX;
            "three", "three-webgpu" and "babylon", modules with a material for three.js, its WebGPURenderer, and
            Babylon.js; "godot", a material of Godot 4;
            "unity", a function for Shader Graph; "unreal", a script that makes a material of Substrate's slabs;
            "json", the material with its numbers; "mitsuba-xml", a scene to be included; "python", a script that
            renders it; "bsdf", a measurement that Mitsuba's plugin `measured` loads; "bsdf-xml", matrices for WINDOW
            and Radiance; fitted parameters in "openpbr", "gltf", "gltf-coat", "usd" (OpenPBR and UsdPreviewSurface, and
            the lobes' graph), "blender-principled" or "mitsuba-principled".
        model: a named model or its name (None for the default), its choices changed by `switches`.
        constant: for shaders, flat names of values that never change (`layer0_eta`), or ["all"].
        prefix: for shaders, begins all names in the code, so that one program may hold several materials; "vt" by
            default.
        group, binding: for shaders, but glsl: where the first texture is bound (or the default of the macro that says
            so), the set in Vulkan and the space in HLSL being the group; the next ones follow. 0 by default.
        baked: for shaders of materials without textures, reads lobes over direction from a texture, of any model.
        half: for shaders, writes textures as halves of floats.
        tables: for shaders, a file of all tables, which shaders of any materials share, in place of one for each.
        mesh: for glTF, what shows the material: an object of scenes ("sphere", "ball"), or a file of glTF, all of whose
            meshes take the material. None by default: the file holds the material alone.
        maps: for parameters, the greatest size in texels of images that they are baked into, where textures change
            them; the images are written into the folder. None by default: means of textures are baked.
        folder: where the text will lie, so that a scene may name its textures relative to it.
        progress: called with stacks fitted and their total, at most, while images are baked.

    Raises:
        InvalidInput: not a valid material, an unknown format, model, switch or value, or a material that the format
            does not hold.
    """
    from velatura.model import DEFAULT, SWITCHES, named
    from velatura.stack import load
    from velatura.stack.schema import unknown

    if to not in FORMATS:
        raise InvalidInput(unknown("format", to, FORMATS))
    asked: dict[str, Any] = {"constant": constant or None, "prefix": prefix, "group": group, "binding": binding}
    asked |= {"baked": baked or None, "half": half or None, "tables": tables, "mesh": mesh, "maps": maps}
    options = {name: value for name, value in asked.items() if value is not None}
    for name in options:
        if name not in FORMATS[to].options:
            raise InvalidInput(f"{name}: only for {', '.join(taking(name))}, not for {to}")
    chosen = named(DEFAULT if model is None else model, **switches)
    request = Request(to, load(material), chosen, switches, None if folder is None else Path(folder), options, progress)
    written: Export = import_module(FORMATS[to].module).write(request)
    if not FORMATS[to].has_facts:
        return written
    facts = {
        "format": to,
        "material": request.material.name,
        "model": {"name": chosen.name, **{switch: getattr(chosen, switch) for switch in SWITCHES}},
        "velatura": __version__,
        "licence": LICENCE,
    }
    return replace(written, facts={**facts, **written.facts})


def check_writable(path: Path, to: str) -> None:
    """Refuse a file that an export to this format could not be written to, before there is anything to write.

    Raises:
        InvalidInput: another ending, a folder that is missing, or a file that cannot be replaced.
    """
    files.check_writable(path, f"{to} output", FORMATS[to].endings)
    if FORMATS[to].has_facts:
        files.check_writable(facts_beside(path), "what belongs beside it", (".json",))
    for ending in FORMATS[to].beside:
        files.check_writable(path.with_suffix(ending), "what belongs beside it", (Path(f"_{ending}").suffix,))


def taking(option: str) -> list[str]:
    """The formats that take an option."""
    return [name for name, each in FORMATS.items() if option in each.options]
