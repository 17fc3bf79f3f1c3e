"""Generators of MaterialX, on documents that are exported."""

from __future__ import annotations

from typing import Any

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as glsl
import MaterialX.PyMaterialXGenMdl as mdl
import MaterialX.PyMaterialXGenMsl as msl
import MaterialX.PyMaterialXGenOsl as osl
import MaterialX.PyMaterialXGenShader as gen
import MaterialX.PyMaterialXGenSlang as slang

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


def generated(
    made: Any,
    target: str,
    environment: Any = gen.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_FIS,
) -> str:
    """The code of the first material of a document."""
    generator = GENERATORS[target].create()
    context = gen.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    generator.registerTypeDefs(made)
    context.getOptions().hwSpecularEnvironmentMethod = environment
    return str(generator.generate("material", made.getMaterialNodes()[0], context).getSourceCode(gen.PIXEL_STAGE))
