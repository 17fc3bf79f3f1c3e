"""A material of USD: OpenPBR as a network of MaterialX, and UsdPreviewSurface for what does not read that; as a .usdz
with its images inside."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from velatura.errors import InvalidInput, needs
from velatura.exports import baked
from velatura.exports.request import Export, Request
from velatura.programs.fit import TARGETS
from velatura.programs.program import Bake
from velatura.programs.usd import write as usd
from velatura.programs.usd.write import ROOT, Shader, quoted

#: Types of MaterialX in USD.
TYPES = {
    "float": "float",
    "integer": "int",
    "boolean": "bool",
    "string": "string",
    "filename": "asset",
    "vector3": "float3",
    "color3": "color3f",
    "color4": "color4f",
    "surfaceshader": "token",
}


def write(request: Request) -> Export:
    """The layer, with the loss of both surfaces."""
    shown, plain = (baked.fitted(request, target) for target in ("openpbr", request.to))
    text = _layer(request, shown, plain, request.folder)
    apart = partial(_packed, _layer(request, shown, plain, None))  # names its images wherever it lies
    facts = {**baked.facts(shown), "preview": baked.facts(plain)}
    return Export(text, notes=(*shown.summary, *plain.summary), binary={".usdz": apart}, facts=facts)


def _layer(request: Request, shown: Bake, plain: Bake, folder: Path | None) -> str:
    """The text of the layer, which names images relative to a folder, if there is one."""
    material = baked.held(request)
    graph = TARGETS["openpbr"].text(shown, material, baked.files(shown, folder))
    shaders = [*_shaders(graph), *usd.preview(plain, baked.files(plain, folder))]
    outputs = [
        f"mtlx:surface.connect = <{ROOT}/surface.outputs:out>",
        f"surface.connect = <{ROOT}/preview.outputs:surface>",
    ]
    return usd.document(shown.name, [*shown.comment, "", *plain.summary], material, shaders, outputs)


def _packed(text: str) -> bytes:
    """A package of OpenUSD of the layer and its images.

    Raises:
        InvalidInput: an image cannot be read. MissingTool: usd-core is not installed.
    """
    with needs("usd"):
        from pxr import Sdf, UsdUtils
    with tempfile.TemporaryDirectory(prefix="velatura-") as folder:
        layer, package = Path(folder, "material.usda"), Path(folder, "material.usdz")
        layer.write_text(text, encoding="utf-8")
        if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(layer)), str(package)):
            raise InvalidInput("usd: OpenUSD cannot pack the layer with its images into a .usdz")
        return package.read_bytes()


def _shaders(graph: str) -> Iterator[Shader]:
    """The nodes of a document of MaterialX, but its material."""
    for node in ElementTree.fromstring(graph):
        if node.tag == "surfacematerial":
            continue
        kind = node.attrib["type"]
        inputs = {each.attrib["name"]: (TYPES[each.attrib["type"]], _given(each)) for each in node}
        # Most definitions are named by what they give, and that of a channel by what it takes
        of = node[0].attrib["type"] if node.tag == "extract" else kind
        yield Shader(node.attrib["name"], f"ND_{node.tag}_{of}", inputs, {"out": TYPES[kind]})


def _given(entry: ElementTree.Element) -> str | tuple[str, str]:
    if "nodename" in entry.attrib:
        return entry.attrib["nodename"], "out"
    value, kind = entry.attrib["value"], entry.attrib["type"]
    if kind == "filename":
        space = entry.attrib.get("colorspace")
        return usd.asset(value) + (f" (colorSpace = {quoted(space)})" if space else "")
    if kind == "string":
        return quoted(value)
    return f"({value})" if "," in value else value
