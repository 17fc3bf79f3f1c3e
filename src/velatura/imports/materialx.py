"""MaterialX documents: their materials, with numbers, colours and plain images on the inputs of a surface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.imports import gltf, openpbr, principled, standard_surface, xml
from velatura.imports.result import Imported, Notes
from velatura.imports.values import Value, changed, colour, linear
from velatura.imports.xml import Element
from velatura.stack import Texture
from velatura.stack.schema import show
from velatura.targets.principled import COAT_ALPHA

SHADERS = {
    "open_pbr_surface": openpbr,
    "standard_surface": standard_surface,
    "gltf_pbr": gltf,
    "disney_principled": principled,
}
#: Inputs of nodes that have other names than in the source, where a name does not just say it in another case.
RENAMED: Mapping[str, Mapping[str, str | None]] = {
    "gltf_pbr": {
        "base_color": "baseColorFactor",
        "metallic": "metallicFactor",
        "roughness": "roughnessFactor",
        "normal": "normalTexture",
        "tangent": None,
        "occlusion": "occlusionTexture",
        "transmission": "transmissionFactor",
        "specular": "specularFactor",
        "specular_color": "specularColorFactor",
        "alpha_cutoff": None,
        "iridescence": "iridescenceFactor",
        "iridescence_ior": "iridescenceIor",
        "iridescence_thickness": "iridescenceThicknessMaximum",
        "sheen_color": "sheenColorFactor",
        "sheen_roughness": None,
        "clearcoat": "clearcoatFactor",
        "clearcoat_roughness": "clearcoatRoughnessFactor",
        "clearcoat_normal": "clearcoatNormalTexture",
        "emissive": "emissiveFactor",
        "emissive_strength": None,
        "thickness": "thicknessFactor",
        "attenuation_distance": "attenuationDistance",
        "attenuation_color": "attenuationColor",
        "anisotropy_strength": "anisotropyStrength",
        "anisotropy_rotation": "anisotropyRotation",
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
IMAGES = ("image", "tiledimage", "gltf_image", "gltf_colorimage")
DEEPEST = 64  # nodes in a row, and files that include each other
LINEAR_FROM_ACESCG = np.array(  # primaries AP1 and white of ACES to those of sRGB, adapted by Bradford's matrix
    [[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]]
)


class _Unread(Exception):
    """What an input is connected to is neither a number nor a plain image."""


def materials(path: Path) -> dict[str, Callable[[Notes], Imported]]:
    """The materials of a document by name, or its surfaces where it has no materials, each as a function that reads it.

    Raises:
        InvalidInput: it cannot be read, or is no document of MaterialX.
    """
    root = _document(path, ())
    found = list(root.of("surfacematerial")) or list(root.of(*SHADERS))

    def reader(element: Element) -> Callable[[Notes], Imported]:
        return lambda notes: _material(element, path, notes)

    return {element.name: reader(element) for element in found}


def _document(path: Path, including: tuple[Path, ...]) -> Element:
    """The root of a document, with what it includes."""
    if path.resolve() in including or len(including) > DEEPEST:
        raise InvalidInput(f"{path}: includes itself")
    root = xml.read(path)
    if root.tag != "materialx":
        raise InvalidInput(f"{path}: is no document of MaterialX: begins with {show(root.tag)}")
    root.attributes["file"] = str(path)
    for include in list(root.of("xi:include")):
        other = _document(path.parent / (include.get("href") or ""), (*including, path.resolve()))
        for child in other.children:
            # What the other root says of its elements stays with them
            child.parent = other
        root.children += other.children
    return root


def _material(element: Element, path: Path, notes: Notes) -> Imported:
    surface, name = element, element.name
    if element.tag == "surfacematerial":
        for each in element.of("input"):
            if each.name == "displacementshader" and (each.get("nodename") or each.get("nodegraph")):
                notes.add(each.name, each.get("nodename") or each.get("nodegraph"), "a stack has no height")
        entry = element.child("input", "surfaceshader")
        if entry is None:
            raise InvalidInput(f"{path}: material {name}: has no surface")
        try:
            surface = _node(entry, 0)
        except _Unread as error:
            raise InvalidInput(f"{path}: material {name}: {error}") from None
    if surface.tag not in SHADERS:
        raise InvalidInput(f"{path}: material {name}: its surface {surface.tag} is none of {', '.join(SHADERS)}")
    values: dict[str, Any] = dict(DEFAULTS.get(surface.tag, {}))
    source, renamed = SHADERS[surface.tag], RENAMED.get(surface.tag, {})
    for each in surface.of("input"):
        parameter = renamed.get(each.name, each.name)
        if parameter is None:
            continue
        connected = each.get("nodename") or each.get("nodegraph") or each.get("interfacename")
        if parameter in getattr(source, "IGNORED", {}):
            if connected:
                values[parameter] = connected
            continue
        try:
            value = _value(each, parameter, notes, 0)
        except _Unread as error:
            notes.add(each.name, connected or each.get("value"), f"{error}; its default stands for it")
            continue
        values[parameter] = value
    if not values.pop("alpha_mode", 0.0):
        values.pop("alpha", None)
    if "eta" in values and "specular" in values:  # the node has one for what passes, and one for what is reflected
        values.pop("specular" if values.get("spec_trans") else "eta")
    if surface.tag == "disney_principled":
        values["clearcoat_gloss"] = changed(values["clearcoat_gloss"], _gloss)
    try:
        return source.read(values, name, notes)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: material {name}: {error}") from None


def _gloss(gloss: Any) -> Any:
    """The gloss of Mitsuba's clearcoat that is as rough as the node's, whose roughness is what its gloss lacks."""
    rough, smooth = COAT_ALPHA
    return (rough - (1 - gloss) ** 2) / (rough - smooth)


# Connections ---------------------------------------------------------------------------------------------------------


def _node(entry: Element, depth: int) -> Element:
    """The node that an input or an output is connected to."""
    if depth > DEEPEST:
        raise _Unread("a cycle of nodes")
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
        return _node(outputs[0], depth + 1)
    if entry.get("interfacename"):
        outer = graph.child("input", entry.get("interfacename") or "")
        if outer is None or graph.tag != "nodegraph":
            raise _Unread(f"there is no input {entry.get('interfacename')}")
        return _node(outer, depth + 1)
    name = entry.get("nodename")
    found = [each for each in graph.children if each.name == name and each.tag not in ("input", "output", "nodegraph")]
    if not name or not found:
        raise _Unread(f"there is no node {name}" if name else "is not connected")
    return found[0]


def _graph(element: Element) -> Element:
    """The graph or the document that an element is in."""
    return next(each for each in element.outwards() if each is not element and each.tag in ("nodegraph", "materialx"))


def _root(element: Element) -> Element:
    return list(element.outwards())[-2]


def _value(entry: Element, parameter: str, notes: Notes, depth: int) -> Value:
    """The value of an input."""
    if depth > DEEPEST:
        raise _Unread("a cycle of nodes")
    if entry.get("interfacename") and not entry.get("nodename"):
        outer = _graph(entry).child("input", entry.get("interfacename") or "")
        if outer is None:
            raise _Unread(f"there is no input {entry.get('interfacename')}")
        return _value(outer, parameter, notes, depth + 1)
    if not (entry.get("nodename") or entry.get("nodegraph")):
        return _literal(entry)
    node = _node(entry, depth)
    inputs = {each.name: each for each in node.of("input")}

    def at(key: str, default: Value | None = None) -> Value:
        if key in inputs:
            return _value(inputs[key], parameter, notes, depth + 1)
        if default is None:
            raise _Unread(f"the node {node.name} lacks {key}")
        return default

    if node.tag == "tangent":  # by its angle
        return 0.0
    if node.tag == "rotate3d" and "in" in inputs and _node(inputs["in"], depth).tag == "tangent":
        return at("amount", 0.0)
    if node.tag in IMAGES:
        image = _image(node, inputs, parameter, notes)
        return image.model_copy(update={"channel": "a"}) if entry.get("output") == "outa" else image
    if node.tag == "constant":
        return at("value")
    if node.tag in ("dot", "convert"):
        return at("in")
    if node.tag in ("extract", "swizzle", "separate3", "separate4"):
        return _channel(node, at("in"), inputs, entry.get("output"))
    if node.tag in ("multiply", "add", "subtract", "divide", "power", "invert"):
        first, second = (at("in", 0.0), at("amount", 1.0)) if node.tag == "invert" else (at("in1", 0.0), at("in2", 1.0))
        return _together(node, first, second)
    raise _Unread(f"the node {node.name} ({node.tag}) is no number and no plain image")


def _together(node: Element, first: Value, second: Value) -> Value:
    """Two values by a node of arithmetic, of which one at most may be an image."""
    operations: dict[str, Callable[[Any, Any], Any]] = {
        "multiply": np.multiply,
        "add": np.add,
        "subtract": np.subtract,
        "divide": lambda a, b: np.divide(a, np.where(b == 0, np.inf, b)),
        "power": lambda a, b: np.power(np.maximum(a, 0), b),
        "invert": lambda a, amount: amount - a,
    }
    operation = operations[node.tag]
    if isinstance(first, Texture) and isinstance(second, Texture):
        raise _Unread(f"the node {node.name} ({node.tag}) has two images")
    plain = second if isinstance(first, Texture) else first
    if isinstance(first, Texture) or isinstance(second, Texture):
        if isinstance(plain, tuple) and len(set(plain)) > 1:
            raise _Unread(f"the node {node.name} ({node.tag}) has an image and a colour")
        number = float(np.mean(plain))  # type: ignore[arg-type]
        if isinstance(first, Texture):
            return changed(first, lambda x: operation(x, number))
        return changed(second, lambda x: operation(number, x))
    found = operation(np.array(first), np.array(second))
    return colour(found) if np.ndim(found) else float(found)


def _channel(node: Element, value: Value, inputs: Mapping[str, Element], output: str | None) -> Value:
    """One channel of a colour or an image."""
    if node.tag == "extract":
        place = inputs["index"].get("value") if "index" in inputs else "0"
        number = int(place) if place and place.isdigit() else 4
    elif node.tag == "swizzle":
        number = "rgba".find((inputs["channels"].get("value") if "channels" in inputs else None) or "?")
    else:
        number = max("rgba".find((output or "outr")[-1:]), "xyzw".find((output or "outr")[-1:]))
    if not 0 <= number < 4:
        raise _Unread(f"the node {node.name} ({node.tag}) is no single channel")
    if isinstance(value, Texture):
        return value.model_copy(update={"channel": "rgba"[number]})
    return value[number] if isinstance(value, tuple) and number < 3 else float(np.mean(value))


def _image(node: Element, inputs: Mapping[str, Element], parameter: str, notes: Notes) -> Texture:
    file = inputs.get("file")
    for _ in range(DEEPEST):
        if file is not None and file.get("interfacename"):
            file = _graph(file).child("input", file.get("interfacename") or "")
    if file is None or file.get("interfacename") or not file.get("value"):
        raise _Unread(f"the node {node.name} ({node.tag}) names no file")
    prefix = "".join(reversed([each.get("fileprefix") or "" for each in file.outwards()]))
    name = (prefix + (file.get("value") or "")).replace("\\", "/")
    if "<" in name:
        raise _Unread(f"the node {node.name} ({node.tag}) has tiles, {name}")
    document = next(each.get("file") for each in file.outwards() if each.get("file") and each.tag == "materialx")
    is_colour = (node.get("type") or "").startswith(("color", "multi"))
    space = _space(file) if is_colour else ""
    if space not in ("", "srgb_texture", *_SPACES):
        notes.add(f"{parameter}: colorspace", space, "the image is read as linear sRGB")
    for key, plain in (("texcoord", None), ("uvtiling", (1.0, 1.0)), ("uvoffset", (0.0, 0.0)), ("scale", (1.0, 1.0))):
        entry = inputs.get(key)
        if entry is not None and (plain is None or _numbers(entry.get("value")) != list(plain)):
            value = entry.get("value") or entry.get("nodename") or entry.get("nodegraph")
            if not (key == "texcoord" and entry.get("nodename") and _plain_coordinates(entry)):
                notes.add(f"{parameter}: {key}", value, "the image lies on the texture coordinates as they are")
    try:
        texture = Texture(
            texture=Path(document or "").parent / name,
            channel="rgb" if is_colour else "r",
            encoding="srgb" if space == "srgb_texture" else "linear",
        )
    except InvalidInput as error:
        raise InvalidInput(f"{document}: node {node.name}: {error}") from None
    if "factor" in inputs:
        factor = _literal(inputs["factor"])
        return changed(texture, lambda x: x * float(np.mean(factor)))  # type: ignore[arg-type,return-value]
    return texture


def _plain_coordinates(entry: Element) -> bool:
    try:
        return _node(entry, 0).tag == "texcoord"
    except _Unread:
        return False


# Values --------------------------------------------------------------------------------------------------------------

_SPACES = ("lin_rec709", "linear", "lin_srgb", "none", "raw", "data")


def _space(element: Element) -> str:
    return next((each.get("colorspace") or "" for each in element.outwards() if each.get("colorspace")), "")


def _numbers(text: str | None) -> list[float]:
    try:
        return [float(part) for part in (text or "").split(",")]
    except ValueError:
        return []


def _literal(entry: Element) -> Value:
    """A value that is written out, in linear sRGB."""
    text = (entry.get("value") or "").strip()
    if text in ("true", "false"):
        return float(text == "true")
    numbers = _numbers(text)
    if len(numbers) == 1:
        return numbers[0]
    if len(numbers) not in (3, 4) or not np.isfinite(numbers).all():
        raise _Unread(f"{show(text)} is no number and no colour")
    rgb, space = np.array(numbers[:3]), _space(entry)
    if space == "srgb_texture":
        rgb = linear(rgb)
    elif space in ("acescg", "lin_ap1", "lin_ap1_scene"):
        rgb = np.clip(LINEAR_FROM_ACESCG @ rgb, 0, None)
    elif space not in ("", *_SPACES):
        raise _Unread(f"its colour space {space} is not read")
    return colour(tuple(rgb.tolist()))
