"""A material of USD: OpenPBR, or in other variants the lobes, as networks of MaterialX, and UsdPreviewSurface for
programs that do not read these; as a .usdz with its images inside."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from velatura.errors import InvalidInput, needs
from velatura.exports import baked, mtlx
from velatura.exports.request import Export, Request, relative, stated
from velatura.programs.fit import TARGETS
from velatura.programs.program import Bake
from velatura.programs.usd import write as usd
from velatura.programs.usd.write import CHOSEN, ROOT, Given, Graph, Shader, quoted
from velatura.shader.material import identifier

#: Types of MaterialX in USD.
TYPES = {
    "float": "float",
    "integer": "int",
    "boolean": "bool",
    "string": "string",
    "filename": "asset",
    "vector2": "float2",
    "vector3": "float3",
    "color3": "color3f",
    "color4": "color4f",
    "BSDF": "token",
    "surfaceshader": "token",
}
LOBES = {"lobes": "", "lobes_osl": "genosl"}  # variants of the lobes, and the targets of MaterialX
ABOUT = (
    "The lobes as a graph of closures: variant lobes, and lobes_osl for renderers whose facets lose the light that they"
    " block, as those of MaterialX's target genosl."
)
OUTPUTS = (
    f"mtlx:surface.connect = <{ROOT}/surface.outputs:out>",
    f"surface.connect = <{ROOT}/preview.outputs:surface>",
)
FRAME = ("normal", "tangent")  # inputs of graphs of lobes, which have defaults in MaterialX
BY_INPUT = ("extract", "dotproduct")  # nodes whose definitions are named by the type that they take
#: Definitions that are named otherwise, by node and type.
NAMED = {
    ("add", "BSDF"): "ND_add_bsdf",
    ("mix", "BSDF"): "ND_mix_bsdf",
    ("multiply", "BSDF"): "ND_multiply_bsdfC",
    ("surface", "surfaceshader"): "ND_surface",
}


def write(request: Request) -> Export:
    """The layer, with the loss of all surfaces."""
    shown, plain = (baked.fitted(request, target) for target in ("openpbr", request.to))
    facts = {**baked.facts(shown), "preview": baked.facts(plain)}
    lobes: mtlx.Document | None = None
    try:
        lobes = mtlx.document(replace(request, folder=None))
        remarks = [ABOUT, *lobes.remarks]
        facts["lobes"] = {"loss": stated(lobes.losses)}
    except InvalidInput as reason:
        remarks = [f"Without a graph of the lobes: {reason}"]
        facts["lobes"] = {"left_out": str(reason)}
    notes = (*shown.summary, *plain.summary, *remarks)

    def layer(folder: Path | None, shown: Bake, plain: Bake) -> str:
        """The text, which names images relative to a folder, if there is one."""
        material = baked.held(request)
        graph = TARGETS["openpbr"].text(shown, material, baked.files(shown, None))
        variants = {CHOSEN: list(_Network(graph, folder).shaders())}
        if lobes:
            begin = f"{identifier(request.material)}_"
            variants |= {name: list(_Network(lobes.text, folder, begin, to).shaders()) for name, to in LOBES.items()}
        head = [*shown.comment, "", *plain.summary, "", *remarks]
        surface = usd.preview(plain, baked.files(plain, folder))
        return usd.document(shown.name, head, material, surface, OUTPUTS, variants)

    # A package names its images wherever they lie
    packed = {".usdz": partial(_packed, layer(None, shown, plain))}
    (shown, beside), (plain, others) = (baked.placed(each, request) for each in (shown, plain))
    text = layer(request.folder, shown, plain)
    return Export(text, notes=notes, binary=packed, apart={**beside, **others}, facts=facts)


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


@dataclass(frozen=True)
class _Network:
    """A document of MaterialX as shaders in USD: its text; the folder of the layer, if there is one; how names begin
    there that have no beginning here; the target of the graphs that nodes of its own are."""

    text: str
    folder: Path | None
    begin: str = ""
    target: str = ""

    def shaders(self) -> Iterator[Shader | Graph]:
        """The nodes of the document but its material."""
        root = ElementTree.fromstring(self.text)
        own = {each.attrib["node"]: each for each in root.iter("nodedef")}
        graphs = {
            each.attrib["nodedef"]: each for each in root.iter("nodegraph") if each.get("target", "") == self.target
        }
        if own:
            world = {"space": ("string", quoted("world"))}
            yield from (Shader(name, f"ND_{name}_vector3", {**world}, {"out": "float3"}) for name in FRAME)
        for node in root:
            if node.tag in own:
                definition = own[node.tag]
                yield self._graph(node, definition, graphs[definition.attrib["name"]])
            elif node.tag not in ("nodedef", "nodegraph", "surfacematerial"):
                yield self._shader(node)

    def _shader(self, node: Element) -> Shader:
        inputs = {each.attrib["name"]: self._port(each) for each in node}
        return Shader(self._name(node), _definition(node), inputs, {"out": TYPES[node.attrib["type"]]})

    def _graph(self, node: Element, definition: Element, graph: Element) -> Graph:
        """A node as a graph with the inputs of its definition."""
        given = {each.attrib["name"]: each for each in node}
        inputs = {}
        for each in definition.iter("input"):
            name = each.attrib["name"]
            kind = TYPES[each.attrib["type"]]
            inputs[name] = (kind, (name, "out")) if name in FRAME else self._port(given.get(name, each))
        shaders = [self._shader(each) for each in graph if each.tag != "output"]
        outputs = {each.attrib["name"]: self._port(each) for each in graph.iter("output")}
        return Graph(self._name(node), inputs, outputs, shaders)

    def _name(self, node: Element, key: str = "name") -> str:
        return node.attrib[key].removeprefix(self.begin)

    def _port(self, entry: Element) -> tuple[str, Given]:
        """The type of an input or output, and its value or what it is connected to."""
        kind = TYPES[entry.attrib["type"]]
        if "nodename" in entry.attrib:
            return kind, (self._name(entry, "nodename"), "out")
        if "interfacename" in entry.attrib:
            return kind, ("", entry.attrib["interfacename"])
        value = entry.attrib["value"]
        if kind == "asset":
            space = entry.get("colorspace")
            file = usd.asset(relative(Path(value), self.folder))
            return kind, file + (f" (colorSpace = {quoted(space)})" if space else "")
        if kind == "string":
            return kind, quoted(value)
        return kind, f"({value})" if "," in value else value


def _definition(node: Element) -> str:
    """The name of a node's definition in the libraries of MaterialX, by the types that it takes and gives."""
    tag, kind, taken = node.tag, node.attrib["type"], [each.attrib["type"] for each in node]
    if tag.endswith("_bsdf") or (tag, kind) in NAMED:
        return NAMED.get((tag, kind), f"ND_{tag}")
    if tag in BY_INPUT:
        kind = taken[0]
    elif tag == "convert":
        kind = f"{taken[0]}_{kind}"
    elif taken == [kind, "float"] and kind != "float":
        kind += "FA"
    return f"ND_{tag}_{kind}"
