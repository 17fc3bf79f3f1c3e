"""Generators of MaterialX, on documents that are exported."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as glsl
import MaterialX.PyMaterialXGenMdl as mdl
import MaterialX.PyMaterialXGenMsl as msl
import MaterialX.PyMaterialXGenOsl as osl
import MaterialX.PyMaterialXGenShader as gen
import MaterialX.PyMaterialXGenSlang as slang
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

GENERATORS = {
    "glsl": glsl.GlslShaderGenerator,
    "essl": glsl.EsslShaderGenerator,
    "vulkan": glsl.VkShaderGenerator,
    "wgsl": glsl.WgslShaderGenerator,
    "osl": osl.OslShaderGenerator,
    "mdl": mdl.MdlShaderGenerator,
    "msl": msl.MslShaderGenerator,
    "slang": slang.SlangShaderGenerator,
}


def document(text: str) -> Any:
    """A document with the libraries of MaterialX.

    Raises:
        AssertionError: it is not valid.
    """
    made = mx.createDocument()
    mx.readFromXmlString(made, text)
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    made.importLibrary(library)
    valid, why = made.validate()
    assert valid, why
    return made


_GLSL = {"float": "float", "integer": "int", "vector2": "vec2", "color3": "vec3"}


FILTERED = gen.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_FIS


def generated(made: Any, target: str, environment: Any = FILTERED) -> str:
    """The code of the first material of a document."""
    return str(_shader(made, target, made.getMaterialNodes()[0], environment).getSourceCode(gen.PIXEL_STAGE))


def drawing(made: Any, node: str) -> str:
    """Code in GLSL ES that draws a node of a document, with the document's values as constants."""
    shader = _shader(made, "essl", made.getNode(node))
    code = str(shader.getSourceCode(gen.PIXEL_STAGE))
    for port in shader.getStage(gen.PIXEL_STAGE).getUniformBlock("PublicUniforms"):
        kind, name = _GLSL.get(port.getType().getName()), port.getVariable()
        code = code.replace(f"uniform {kind} {name};", f"{kind} {name} = {kind}({port.getValueString()});")
    return code


def _shader(made: Any, target: str, element: Any, environment: Any = FILTERED) -> Any:
    generator = GENERATORS[target].create()
    context = gen.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    generator.registerTypeDefs(made)
    context.getOptions().hwSpecularEnvironmentMethod = environment
    return generator.generate("drawn", element, context)


# Values of graphs: of vectors and colours the parts (k, N), of numbers (N,)


OPERATIONS: dict[str, Callable[..., Array]] = {
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "divide": np.divide,
    "power": np.power,
    "max": np.maximum,
    "min": np.minimum,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "atan2": np.arctan2,
    "absval": np.abs,
    "clamp": np.clip,
    "ifgreater": lambda a, b, *of: _chosen(a > b, *of),
    "ifgreatereq": lambda a, b, *of: _chosen(a >= b, *of),
    "convert": lambda x: x if np.ndim(x) > 1 else _stacked(x, x, x),
    "combine2": lambda *each: _stacked(*each),
    "combine3": lambda *each: _stacked(*each),
    "extract": lambda vector, index: vector[int(index)],
    "dotproduct": lambda a, b: np.sum(a * b, axis=0),
    "crossproduct": lambda a, b: np.cross(a, b, axis=0),
}


def _chosen(holds: NDArray[np.bool_], one: Array, other: Array) -> Array:
    return np.asarray(np.where(holds, one, other))


def _stacked(*each: Array) -> Array:
    """Numbers as the parts of one vector."""
    return np.stack(np.broadcast_arrays(*map(np.atleast_1d, each)))


def evaluated(graph: Any, given: Mapping[str, Array]) -> dict[str, Array]:
    """Outputs of a graph of standard nodes, by NumPy.

    Args:
        graph: the nodegraph.
        given: values of its interface, and of the nodes without inputs, such as `viewdirection`.
    """
    known: dict[str, Array] = {}

    def of(name: str) -> Array:
        node = graph.getNode(name)
        if name not in known:
            known[name] = np.asarray(
                given[node.getCategory()]
                if node.getCategory() in given
                else OPERATIONS[node.getCategory()](*map(value, _in_order(node)))
            )
        return known[name]

    def value(port: Any) -> Array:
        if port.getInterfaceName():
            return np.asarray(given[port.getInterfaceName()])
        if port.getNodeName():
            return of(port.getNodeName())
        parts = np.array([float(x) for x in port.getValueString().split(",")])
        return parts[:, None] if len(parts) > 1 else parts[0]

    return {output.getName(): of(output.getNodeName()) for output in graph.getOutputs()}


def _in_order(node: Any) -> list[Any]:
    """Inputs in the order of the node's definition."""
    return [node.getInput(each.getName()) for each in node.getNodeDef().getActiveInputs()]
