"""Layers of USD: their materials, of which networks of MaterialX and UsdPreviewSurface are read as documents are."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from velatura import files
from velatura.errors import InvalidInput, needs
from velatura.programs import embedded
from velatura.programs.imported import Imported, Left, Notes
from velatura.programs.materialx import closures
from velatura.programs.materialx import read as materialx
from velatura.programs.usd.write import CHOSEN, SURFACES, Given, Shader, asset, digest, number, quoted
from velatura.programs.xml import Element
from velatura.stack import loads

#: Types of USD in MaterialX; others are what they are called.
TYPES = {
    "color3f": "color3",
    "color4f": "color4",
    "float2": "vector2",
    "float3": "vector3",
    "vector3f": "vector3",
    "normal3f": "vector3",
    "float4": "color4",
    "asset": "filename",
    "int": "integer",
    "bool": "boolean",
    "token": "string",
}
#: A node of MaterialX in the name of its definition: what it is, and the types that it is defined for.
NODE = re.compile(r"ND_(\w+?)_(?:float|integer|boolean|color[34]|vector[234]|string|surfaceshader|[BEV]DF|bsdf)\w*")
ELSEWHERE = "other layers are not read"
MOST = 200  # characters of a reason
LARGEST = 2**26  # bytes of a file


def materials(path: Path) -> tuple[dict[str, Callable[[Notes], Imported]], None]:
    """The materials of a layer by name, each as a function that reads it; what it takes from other layers is left out.

    Raises:
        InvalidInput: it cannot be read, or is no layer. MissingTool: usd-core is not installed.
    """
    files.content(path, LARGEST)  # which checks it, and spends its bytes
    with needs("usd"):
        from pxr import Sdf, Usd, UsdShade
    found: dict[str, Callable[[Notes], Imported]] = {}
    with _blamed(path), files.budget() as left:
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
        elsewhere = list(_without_others(layer))
        stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
        for prim in stage.Traverse():
            left.spend(path, "elements")
            if prim.IsA(UsdShade.Material):
                name = prim.GetName() if prim.GetName() not in found else str(prim.GetPath())
                found[name] = _reader(stage, UsdShade, str(prim.GetPath()), path, elsewhere)
    return found, None


@contextlib.contextmanager
def _blamed(path: Path) -> Iterator[None]:
    """Raises InvalidInput about a file for what OpenUSD refuses in the block, and for texts that are not UTF-8."""
    try:
        yield
    except (RuntimeError, UnicodeError) as error:
        reason = " ".join(str(error).partition(" : ")[2].split() or str(error).split())  # without its own places
        raise InvalidInput(f"{path}: cannot be read as USD: {reason[:MOST]}") from None


def _without_others(layer: Any) -> Iterator[str]:
    """Paths of what a layer takes from others, which it no longer does."""
    if layer.subLayerPaths:
        yield from layer.subLayerPaths
        layer.subLayerPaths.clear()
    specs = [layer.pseudoRoot]
    while specs:
        spec = specs.pop()
        for key in ("references", "payload"):
            if spec.HasInfo(key):
                yield str(spec.path)
                spec.ClearInfo(key)
        for inside in (spec.nameChildren, *(each.variants for each in spec.variantSets)):
            specs.extend(getattr(each, "primSpec", each) for each in inside)


def _reader(stage: Any, shade: Any, place: str, path: Path, elsewhere: list[str]) -> Callable[[Notes], Imported]:
    def read(notes: Notes) -> Imported:
        prim = stage.GetPrimAtPath(place)
        if elsewhere:
            notes.add("references", f"{len(elsewhere)}", ELSEWHERE)
        with _blamed(path):
            surfaces = prim.GetVariantSet(SURFACES)
            if prim.GetCustomDataByKey(embedded.KEY) and CHOSEN in surfaces.GetVariantNames():
                surfaces.SetVariantSelection(CHOSEN)  # of others the stack is not read
            name, stack = prim.GetDisplayName() or prim.GetName(), prim.GetCustomDataByKey(embedded.KEY)
            surface, network = _network(shade, prim, path)
        held = _held(stack, path, network)
        if held is not None:
            return Imported(held, (Left("customData", embedded.KEY, embedded.READ),))
        root = Element("", {})
        document = Element("materialx", {"file": str(path)}, root)
        root.children.append(document)
        document.children.extend(_node(each, document) for each in network)
        material = Element("surfacematerial", {"name": name}, document)
        entry = {"name": "surfaceshader", "type": "surfaceshader", "nodename": surface}
        material.children.append(Element("input", entry, material))
        return materialx.of_material(material, path, notes)

    return read


def _network(shade: Any, prim: Any, path: Path) -> tuple[str, list[Shader]]:
    """The name of a material's surface, that of MaterialX before the other, and the shaders that it takes from."""
    waiting = [shade.Material(prim).ComputeSurfaceSource(context)[0] for context in ("mtlx", "")]
    surface = next((each for each in waiting if each and each.GetIdAttr().Get()), None)
    if surface is None:
        raise InvalidInput(f"{path}: material {prim.GetName()}: has no surface that is read here")
    found: dict[str, Shader] = {}
    with files.budget() as left:
        while waiting:
            shader = waiting.pop()
            if not shader or _name(shader) in found:
                continue
            left.spend(path, "nodes")
            inputs: dict[str, tuple[str, Given]] = {}
            for each in shader.GetInputs():
                inputs[each.GetBaseName()], source = _input(shade, each)
                waiting += [source] if source else []
            outputs = {each.GetBaseName(): str(each.GetTypeName()) for each in shader.GetOutputs()}
            found[_name(shader)] = Shader(_name(shader), str(shader.GetIdAttr().Get() or ""), inputs, outputs)
    return _name(surface), list(found.values())


def _name(shader: Any) -> str:
    """A shader's name: its path, but for those right in the material."""
    prim = shader.GetPrim()
    return str(prim.GetName() if prim.GetParent().GetTypeName() == "Material" else prim.GetPath())


def _input(shade: Any, entry: Any) -> tuple[tuple[str, Given], Any]:
    """The type of an input, and its value or what it is connected to, through graphs; and that shader, if any."""
    kind = str(entry.GetTypeName())
    producers = shade.Utils.GetValueProducingAttributes(entry)
    if producers and producers[0].GetName().startswith("outputs:"):
        source = shade.Shader(producers[0].GetPrim())
        return (kind, (_name(source), producers[0].GetBaseName())), source
    attribute = producers[0] if producers else entry.GetAttr()
    return (kind, _text(attribute)), None


def _text(attribute: Any) -> str:
    """A value as `write` has it."""
    value = attribute.Get()
    if hasattr(value, "path"):
        space = attribute.GetColorSpace()
        return asset(value.path) + (f" (colorSpace = {quoted(space)})" if space else "")
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return number(value)
    return number(tuple(value)) if hasattr(value, "__len__") else ""


def _held(text: object, path: Path, network: list[Shader]) -> Any | None:
    """The stack that a material was baked from, by its custom data, for as long as its shaders are the same."""
    try:
        held = json.loads(text) if isinstance(text, str) and text.startswith("{") else {}
    except (ValueError, RecursionError):
        return None
    if held.get("digest") != digest(network):
        return None
    return loads(json.dumps(held.get("material")), f"{path}: the stack in it.json", path.parent)


# As elements of MaterialX ---------------------------------------------------------------------------------------------


_LAMA = {f"lama_{name.removeprefix('Lama').lower()}": name for name in closures.KNOWN if name.startswith("Lama")}


def _tag(identifier: str) -> str:
    """The node of MaterialX that a shader is, or what it calls itself."""
    plain = identifier.removeprefix("ND_")
    if plain in closures.KNOWN:  # which have their type in their name
        return plain
    known = NODE.fullmatch(identifier)
    plain = known[1] if known else plain
    return _LAMA.get(plain, plain)


def _node(shader: Shader, document: Element) -> Element:
    outputs = [TYPES.get(kind, kind) for kind in shader.outputs.values()]
    node = Element(
        _tag(shader.identifier),
        {"name": shader.name, "type": outputs[0] if len(outputs) == 1 else "multioutput"},
        document,
    )
    for name, (kind, value) in shader.inputs.items():
        entry = {"name": name, "type": TYPES.get(kind, kind)}
        if isinstance(value, tuple):
            entry |= {"nodename": value[0], "output": value[1]}
        else:
            entry |= _value(kind, value)
        node.children.append(Element("input", entry, node))
    return node


def _value(kind: str, text: str) -> dict[str, str]:
    """Attributes of an input, of a text as `write` has it."""
    if kind == "asset":
        path, _, about = text.removeprefix("@@@").rpartition("@@@")
        space = re.search(r'colorSpace = "([^"]*)"', about)
        return {"value": path.replace("\\@@@", "@@@"), **({"colorspace": space[1]} if space else {})}
    if kind in ("string", "token"):
        return {"value": re.sub(r"\\(.)", r"\1", text[1:-1])}
    return {"value": text.strip("()")}
