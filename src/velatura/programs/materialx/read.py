"""MaterialX documents: their materials, with numbers, colours and plain images on the inputs of a surface."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura import files
from velatura.errors import InvalidInput, within
from velatura.programs import xml
from velatura.programs.given import ROUNDING, Given
from velatura.programs.gltf import read as gltf
from velatura.programs.imported import Imported, Notes
from velatura.programs.materialx import closures
from velatura.programs.mixture import beside
from velatura.programs.openpbr import read as openpbr
from velatura.programs.parameters import Input
from velatura.programs.principled import read as principled
from velatura.programs.principled.formulas import COAT_ALPHA
from velatura.programs.standard_surface import read as standard_surface
from velatura.programs.usd import read as usd
from velatura.programs.values import Value, changed, colour, linear, listed
from velatura.programs.xml import Element
from velatura.stack import Described, Texture
from velatura.stack.schema import show, unknown
from velatura.stack.values import cleaned

SHADERS = {
    "open_pbr_surface": openpbr,
    "standard_surface": standard_surface,
    "gltf_pbr": gltf,
    "disney_principled": principled,
    "UsdPreviewSurface": usd,
}


def _input_of(factor: str) -> str:
    """The input of `gltf_pbr` for a factor or an image of glTF."""
    plain = re.sub("(Factor|Texture|Maximum)$", "", factor)
    return re.sub("[A-Z]", lambda found: f"_{found[0].lower()}", plain)


_NO_INPUTS = ("iridescenceThicknessMinimum", "diffuseTransmissionFactor")
_FACTORS = [
    name
    for name in (*(each.name for each in gltf.PARAMETERS), *gltf.IGNORED)
    if name not in _NO_INPUTS and not name.startswith("coat")
]
#: Inputs of nodes that have other names than in the source.
RENAMED: Mapping[str, Mapping[str, str | None]] = {
    "gltf_pbr": {
        **{_input_of(name): name for name in _FACTORS},
        **dict.fromkeys(("tangent", "sheen_roughness", "emissive_strength")),
    },
    "disney_principled": {
        "baseColor": "base_color",
        "specularTint": "spec_tint",
        "sheenTint": "sheen_tint",
        "clearcoatGloss": "clearcoat_gloss",
        "specTrans": "spec_trans",
        "subsurface": "flatness",
        "subsurfaceDistance": None,
        "ior": "eta",
    },
}
#: Defaults of nodes that are not those of the source.
DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    "gltf_pbr": {"iridescenceThicknessMaximum": 100.0},
    "disney_principled": {"base_color": 0.16, "clearcoat_gloss": 1.0, "sheen_tint": 0.5},
}
_COVER, _MODES = {"alpha_mode": 0.0, "alpha_cutoff": 0.5}, {1.0: "MASK", 2.0: "BLEND"}  # inputs of gltf_pbr
IMAGES = ("image", "tiledimage", "gltf_image", "gltf_colorimage")
DEEPEST = 64  # nodes in a row, and of a mix of surfaces
LINEAR_FROM_ACESCG = np.array(  # primaries AP1 and white of ACES to those of sRGB, adapted by Bradford's matrix
    [[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]]
)


class _Unread(ValueError):
    """Raised where an input is connected to neither a number nor a plain image."""


def materials(path: Path) -> tuple[dict[str, Callable[[Notes], Imported]], str | None]:
    """The materials of a document by name, or its surfaces where it has no materials, each as a function that reads it;
    and the name of the one that its looks assign, None where they assign none or several.

    Raises:
        InvalidInput: it cannot be read, or is no document of MaterialX.
    """
    root = _document(path)
    found = list(root.of("surfacematerial")) or list(root.of(*SHADERS, *closures.SURFACES))

    def reader(element: Element) -> Callable[[Notes], Imported]:
        return lambda notes: of_material(element, path, notes)

    assigned = {each.get("material") for look in root.of("look") for each in look.of("materialassign")}
    return {element.name: reader(element) for element in found}, assigned.pop() if len(assigned) == 1 else None


def _document(path: Path) -> Element:
    """The root of a document. All elements of the documents that it includes are in it, each document once.

    They keep their own root as parent, since what that says of them holds, and those roots have all elements as well.
    """
    known: set[str] = set()
    elements: list[Element] = []

    def gather(path: Path, including: tuple[str, ...]) -> Element:
        place = os.path.realpath(path)
        if place in including:
            raise InvalidInput(f"{path}: includes itself")
        known.add(place)
        root = xml.read(path)
        if root.tag != "materialx":
            raise InvalidInput(f"{path}: is no document of MaterialX: begins with {show(root.tag)}")
        root.attributes["file"] = str(path)
        others = [path.parent / (include.get("href") or "") for include in root.of("xi:include")]
        elements.extend(root.children)
        root.children = elements
        for other in others:
            if os.path.realpath(other) not in known or os.path.realpath(other) in (*including, place):
                gather(other, (*including, place))
        return root

    return gather(path, ())


def of_material(element: Element, path: Path, notes: Notes) -> Imported:
    """The material of an element of a document.

    Raises:
        InvalidInput: it has no surface that is read.
    """
    surface = element
    if element.tag == "surfacematerial":
        for each in element.of("input"):
            if each.name == "displacementshader" and (height := each.get("nodename") or each.get("nodegraph")):
                notes.add(each.name, height, "a stack has no height")
        entry = element.child("input", "surfaceshader")
        if entry is None:
            raise InvalidInput(f"{path}: material {element.name}: has no surface")
        surface = _connected(entry, path, element.name)
    if surface.tag == "mix":
        mixed = _Mixed(path, element.name, notes)(surface)
        return Imported(
            mixed.model_copy(update={"name": element.name, "source": "imported from MaterialX"}), notes.left
        )
    return _surface(surface, path, element.name, notes)


def _connected(entry: Element, path: Path, name: str) -> Element:
    """The node of a surface that an input of a material is connected to."""
    try:
        return _node(entry)
    except _Unread as error:
        raise InvalidInput(f"{path}: material {name}: {error}") from None


class _Mixed:
    """Surfaces, and mixtures of them by nodes `mix`, of one material, each read once."""

    def __init__(self, path: Path, name: str, notes: Notes) -> None:
        self._path, self._name, self._notes = path, name, notes
        self._reader = _Reader(path, notes)
        self._found: dict[int, Described | None] = {}  # None of nodes that are being read

    def __call__(self, node: Element) -> Described:
        if id(node) not in self._found:
            if len(self._found) >= DEEPEST:
                raise InvalidInput(f"{self._path}: material {self._name}: mixes more than {DEEPEST} nodes")
            self._found[id(node)] = None
            self._found[id(node)] = self._mix(node) if node.tag == "mix" else self._surface(node)
        found = self._found[id(node)]
        if found is None:
            raise InvalidInput(f"{self._path}: material {self._name}: a cycle of nodes")
        return found

    def _mix(self, node: Element) -> Described:
        inputs = {each.name: each for each in node.of("input")}
        share: Any = 0.0
        if "mix" in inputs:
            try:
                share = self._reader.value(inputs["mix"], "mix")
            except _Unread as error:
                self._notes.add(f"{node.name}: mix", inputs["mix"].get("value"), f"{error}; its default stands for it")
        share = Given({"mix": share}, (Input("mix", 0.0),), {}, self._notes).share("mix")
        if lacking := next((key for key in ("fg", "bg") if key not in inputs), None):
            raise InvalidInput(f"{self._path}: material {self._name}: the node {node.name} lacks {lacking}")
        first, second = (self(_connected(inputs[key], self._path, self._name)) for key in ("fg", "bg"))
        return beside(share, first, second, self._notes)

    def _surface(self, node: Element) -> Described:
        notes = Notes()
        found = _surface(node, self._path, node.name, notes).stack
        for each in notes.left:
            self._notes.add(f"{node.name}: {each.parameter}", each.value, each.why)
        plain: Described = found.model_copy(update={"source": ""})
        return plain


def _surface(surface: Element, path: Path, name: str, notes: Notes) -> Imported:
    if surface.tag in closures.SURFACES:
        return _layered(surface, path, name, notes)
    if surface.tag not in SHADERS:
        read = f"none of {', '.join((*SHADERS, *closures.SURFACES))}, nor a mix of these"
        raise InvalidInput(f"{path}: material {name}: its surface {surface.tag} is {read}")
    values: dict[str, Any] = dict(DEFAULTS.get(surface.tag, {}))
    source, renamed = SHADERS[surface.tag], RENAMED.get(surface.tag, {})
    known = [
        *renamed,
        *(each.name for each in source.PARAMETERS),
        *getattr(source, "IGNORED", ()),
        *_COVER,
        "opacityMode",
    ]
    reader = _Reader(path, notes)
    for each in surface.of("input"):
        parameter = renamed.get(each.name, each.name)
        if parameter is None:
            continue
        connected = each.get("nodename") or each.get("nodegraph") or each.get("interfacename")
        if parameter not in known:  # of a newer version, or misspelt
            notes.add(each.name, each.get("value") or connected, f"{unknown('input', each.name, known)}: left out")
            continue
        if parameter == "opacityMode":  # a word, or a number
            values[parameter] = each.get("value")
            continue
        if parameter in getattr(source, "IGNORED", {}):
            if connected:
                values[parameter] = connected
            continue
        try:
            value = reader.value(each, parameter)
        except _Unread as error:
            notes.add(each.name, connected or each.get("value"), f"{error}; its default stands for it")
            continue
        values[parameter] = value
    mode, cutoff = (values.pop(key, default) for key, default in _COVER.items())
    if "alpha" in values:
        values["alpha"] = gltf.covered(_MODES.get(mode, ""), values["alpha"], float(np.mean(cutoff)))
    if "eta" in values and "specular" in values:  # the node has one for what passes, and one for what is reflected
        values.pop("specular" if values.get("spec_trans") else "eta")
    if surface.tag == "disney_principled":
        values["clearcoat_gloss"] = changed(values["clearcoat_gloss"], _gloss)
    with within(f"{path}: material {name}"):
        return source.read(values, name, notes)


def _layered(surface: Element, path: Path, name: str, notes: Notes) -> Imported:
    """A surface that is a graph of closures."""
    reader = _Reader(path, notes)

    def value(entry: Element, parameter: str) -> Value:
        with within(parameter, _Unread):
            return reader.value(entry, parameter)

    def node(entry: Element) -> Element:
        with within(entry.name, _Unread):
            return _node(entry)

    with within(f"{path}: material {name}"):
        found = closures.material(closures.Closures(value, node, str(path), notes), surface)
    return Imported(found.model_copy(update={"name": cleaned(name), "source": "imported from MaterialX"}), notes.left)


def _gloss(gloss: Any) -> Any:
    """The gloss of Mitsuba's clearcoat that is as rough as the node's, whose roughness is what its gloss lacks."""
    rough, smooth = COAT_ALPHA
    return (rough - (1 - gloss) ** 2) / (rough - smooth)


# Connections ---------------------------------------------------------------------------------------------------------


def _node(entry: Element, through: tuple[Element, ...] = ()) -> Element:
    """The node that an input or an output is connected to, `through` other inputs and outputs."""
    if any(each is entry for each in through):
        raise _Unread("a cycle of nodes")
    if len(through) > DEEPEST:
        raise _Unread(f"more than {DEEPEST} nodes in a row")
    through = (*through, entry)
    graph = _graph(entry)
    name = entry.get("nodegraph")
    if name:
        inner = next(
            (each.child("nodegraph", name) for each in entry.outwards() if each.child("nodegraph", name)), None
        )
        inner = inner or _root(entry).child("nodegraph", name)
        if inner is None:
            raise _Unread(f"there is no graph {name}")
        outputs = [each for each in inner.of("output") if each.name == (entry.get("output") or each.name)]
        if not outputs:
            raise _Unread(f"the graph {name} has no such output")
        return _node(outputs[0], through)
    if entry.get("interfacename"):
        return _node(_outer(entry, graph.tag == "nodegraph"), through)
    name = entry.get("nodename")
    node = next((each for each in graph.named.get(name or "", ()) if each.tag not in _NO_NODES), None)
    if not name or node is None:
        raise _Unread(f"there is no node {name}" if name else "is not connected")
    return node


_NO_NODES = ("input", "output", "nodegraph")


def _outer(entry: Element, within: bool = True) -> Element:
    """The input of the graph around that an input stands for; `within`: there may be one."""
    outer = _graph(entry).child("input", entry.get("interfacename") or "") if within else None
    if outer is None:
        raise _Unread(f"there is no input {entry.get('interfacename')}")
    return outer


def _graph(element: Element) -> Element:
    """The graph or the document that an element is in."""
    return next(each for each in element.outwards() if each is not element and each.tag in ("nodegraph", "materialx"))


def _root(element: Element) -> Element:
    return list(element.outwards())[-2]


class _Reader:
    """Values of inputs, each worked out once for a parameter, however many nodes use it."""

    def __init__(self, path: Path, notes: Notes) -> None:
        self._path, self._notes = path, notes
        self._found: dict[tuple[str, int], Value] = {}
        self._within: list[int] = []  # inputs that are being worked out

    def value(self, entry: Element, parameter: str) -> Value:
        """The value of an input."""
        key = parameter, id(entry)
        if key not in self._found:
            if id(entry) in self._within:
                raise _Unread("a cycle of nodes")
            if len(self._within) > DEEPEST:
                raise _Unread(f"more than {DEEPEST} nodes in a row")
            with files.budget() as left:
                left.spend(self._path, "nodes")
            self._within.append(id(entry))
            try:
                self._found[key] = self._worked_out(entry, parameter)
            finally:
                self._within.pop()
        return self._found[key]

    def _worked_out(self, entry: Element, parameter: str) -> Value:
        if entry.get("interfacename") and not entry.get("nodename"):
            return self.value(_outer(entry), parameter)
        if not (entry.get("nodename") or entry.get("nodegraph")):
            return _literal(entry)
        node = _node(entry)
        inputs = {each.name: each for each in node.of("input")}

        def at(key: str, default: Value | None = None) -> Value:
            if key in inputs:
                return self.value(inputs[key], parameter)
            if default is None:
                raise _Unread(f"the node {node.name} lacks {key}")
            return default

        if node.tag == "tangent":  # by its angle
            return 0.0
        if node.tag == "rotate3d" and "in" in inputs and _node(inputs["in"]).tag == "tangent":
            return at("amount", 0.0)
        if node.tag in IMAGES:
            image = _image(node, inputs, parameter, self._notes)
            if isinstance(image, Texture) and entry.get("output") == "outa":
                return image.model_copy(update={"channel": "a"})
            return image
        if node.tag == "UsdUVTexture":
            return _uv_texture(node, inputs, entry.get("output") or "rgb", parameter, self._notes)
        if node.tag == "constant":
            return at("value")
        if node.tag in ("dot", "convert"):
            return at("in")
        if node.tag == "sqrt":
            return changed(at("in"), lambda x: np.sqrt(np.maximum(x, 0)))
        if node.tag in ("extract", "swizzle", "separate3", "separate4"):
            return _channel(node, at("in"), inputs, entry.get("output"))
        if node.tag in ("multiply", "add", "subtract", "divide", "power", "invert"):
            keys = ("in", "amount") if node.tag == "invert" else ("in1", "in2")
            return _together(node, at(keys[0], 0.0), at(keys[1], 1.0))
        raise _Unread(f"the node {node.name} ({node.tag}) is no number and no plain image")


def _together(node: Element, first: Value, second: Value) -> Value:
    """Two values by a node of arithmetic, of which one at most may be an image."""
    operations: dict[str, Callable[[Any, Any], Any]] = {
        **dict.fromkeys(("multiply", *IMAGES), np.multiply),
        "add": np.add,
        "subtract": np.subtract,
        "divide": lambda a, b: np.divide(a, np.where(b == 0, np.inf, b)),
        "power": lambda a, b: np.power(np.maximum(a, 0), b),
        "invert": lambda a, amount: amount - a,
    }
    operation = operations[node.tag]
    where = f"the node {node.name} ({node.tag})"
    if isinstance(first, Texture) and isinstance(second, Texture):
        raise _Unread(f"{where} has two images")
    plain = second if isinstance(first, Texture) else first
    if isinstance(first, Texture) or isinstance(second, Texture):
        if isinstance(plain, tuple) and len(set(plain)) > 1:
            raise _Unread(f"{where} has an image and a colour")
        number = float(np.mean(plain))  # type: ignore[arg-type]
        try:
            if isinstance(first, Texture):
                return changed(first, lambda x: operation(x, number))
            return changed(second, lambda x: operation(number, x))
        except InvalidInput as error:
            raise _Unread(f"{where}: {error}") from None
    with np.errstate(all="ignore"):
        found = operation(np.array(first), np.array(second))
    if not np.isfinite(found).all():
        raise _Unread(f"{where} gives no finite number")
    return colour(found) if np.ndim(found) else float(found)


def _channel(node: Element, value: Value, inputs: Mapping[str, Element], output: str | None) -> Value:
    """One channel of a colour or an image."""
    if node.tag == "extract":
        place = inputs["index"].get("value") if "index" in inputs else "0"
        number = int(place) if place and place in tuple("0123") else 4
    elif node.tag == "swizzle":
        number = "rgba".find((inputs["channels"].get("value") if "channels" in inputs else None) or "?")
    else:
        number = max("rgba".find((output or "outr")[-1:]), "xyzw".find((output or "outr")[-1:]))
    if not 0 <= number < 4:
        raise _Unread(f"the node {node.name} ({node.tag}) is no single channel")
    if isinstance(value, Texture):
        return value.model_copy(update={"channel": "rgba"[number]})
    return value[number] if isinstance(value, tuple) and number < 3 else float(np.mean(value))


def _image(node: Element, inputs: Mapping[str, Element], parameter: str, notes: Notes) -> Value:
    """A node's image, times its factor."""
    file = _file(node, inputs)
    prefix = "".join(reversed([each.get("fileprefix") or "" for each in file.outwards()]))
    name = (prefix + (file.get("value") or "")).replace("\\", "/")
    if "<" in name:
        raise _Unread(f"the node {node.name} ({node.tag}) has tiles, {name}")
    document = next(each.get("file") for each in file.outwards() if each.get("file") and each.tag == "materialx")
    is_colour = (node.get("type") or "").startswith(("color", "multi"))
    space = _space(file) if is_colour else ""
    if space not in ("", "srgb_texture", *_SPACES):
        notes.add(f"{parameter}: colorspace", space, "the image is read as linear sRGB")
    for key, value in _placed(inputs):
        notes.add(f"{parameter}: {key}", value, "the image lies on the texture coordinates as they are")
    with within(f"{document}: node {node.name}"):
        texture = Texture(
            texture=Path(document or "").parent / name,
            channel="rgb" if is_colour else "r",
            encoding="srgb" if space == "srgb_texture" else "linear",
        )
    return _together(node, texture, _literal(inputs["factor"])) if "factor" in inputs else texture


def _uv_texture(node: Element, inputs: Mapping[str, Element], output: str, parameter: str, notes: Notes) -> Value:
    """One output of an image of USD, scaled and shifted."""
    placed = {"file": inputs["file"]} if "file" in inputs else {}
    if "st" in inputs:
        placed["texcoord"] = inputs["st"]
    whole = _image(Element(node.tag, {**node.attributes, "type": "color3"}, node.parent), placed, parameter, notes)
    assert isinstance(whole, Texture)
    channel = "rgb" if output.startswith("rgb") else output
    if channel not in ("rgb", *"rgba"):
        raise _Unread(f"the node {node.name} ({node.tag}) has no output {output}")
    space = inputs["sourceColorSpace"].get("value") if "sourceColorSpace" in inputs else "auto"
    if space == "sRGB" or (space == "auto" and channel == "rgb" and "file" in inputs and not _space(inputs["file"])):
        whole = whole.model_copy(update={"encoding": "srgb"})
    numbers = []
    for key, default in (("scale", 1.0), ("bias", 0.0)):
        given = listed(inputs[key].get("value") or "") if key in inputs else []
        given = given if len(given) == 4 else [default] * 4
        chosen = given[:3] if channel == "rgb" else [given["rgba".index(channel)]]
        if max(chosen) - min(chosen) > ROUNDING:
            notes.add(f"{parameter}: {key}", tuple(chosen), "its mean is taken for the image")
        numbers.append(float(np.mean(chosen)))
    scale, bias = numbers
    return changed(whole.model_copy(update={"channel": channel}), lambda x: scale * x + bias)


def _file(node: Element, inputs: Mapping[str, Element]) -> Element:
    """The input that names the file of an image."""
    file = inputs.get("file")
    for _ in range(DEEPEST):
        if file is not None and file.get("interfacename"):
            file = _graph(file).child("input", file.get("interfacename") or "")
    if file is None or file.get("interfacename") or not file.get("value"):
        raise _Unread(f"the node {node.name} ({node.tag}) names no file")
    return file


def _placed(inputs: Mapping[str, Element]) -> Iterator[tuple[str, str | None]]:
    """Inputs of an image, with their values, that put it elsewhere than on the texture coordinates."""
    for key, plain in (("texcoord", None), ("uvtiling", [1.0, 1.0]), ("uvoffset", [0.0, 0.0]), ("scale", [1.0, 1.0])):
        entry = inputs.get(key)
        if entry is None or (plain is not None and listed(entry.get("value") or "") == plain):
            continue
        if not (key == "texcoord" and entry.get("nodename") and _plain_coordinates(entry)):
            yield key, entry.get("value") or entry.get("nodename") or entry.get("nodegraph")


def _plain_coordinates(entry: Element) -> bool:
    try:
        return _node(entry).tag in (
            "texcoord",
            "UsdPrimvarReader_float2",
            "UsdPrimvarReader_vector2",
            "UsdPrimvarReader",
        )
    except _Unread:
        return False


# Values --------------------------------------------------------------------------------------------------------------

_SPACES = ("lin_rec709", "linear", "lin_srgb", "none", "raw", "data")


def _space(element: Element) -> str:
    return next((each.get("colorspace") or "" for each in element.outwards() if each.get("colorspace")), "")


def _literal(entry: Element) -> Value:
    """A value that is written out, in linear sRGB."""
    text = (entry.get("value") or "").strip()
    if text in ("true", "false"):
        return float(text == "true")
    numbers = listed(text)
    if len(numbers) == 1:
        return numbers[0]
    if len(numbers) not in (3, 4) or not np.isfinite(numbers).all():
        raise _Unread(f"{show(text)} is no number and no colour")
    rgb, space = np.array(numbers[:3]), "" if entry.get("type") == "vector3" else _space(entry)
    if space == "srgb_texture":
        rgb = linear(rgb)
    elif space in ("acescg", "lin_ap1", "lin_ap1_scene"):
        rgb = np.clip(LINEAR_FROM_ACESCG @ rgb, 0, None)
    elif space not in ("", *_SPACES):
        raise _Unread(f"its colour space {space} is not read")
    return colour(tuple(rgb.tolist()))
