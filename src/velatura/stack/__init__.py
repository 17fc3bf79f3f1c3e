"""Materials: layers, their parameters, and the files that hold them, without optics or rendering."""

from velatura.stack.describe import json_schema, parameter_table
from velatura.stack.io import MaterialLike, dumps, load, loads, preset, presets, save
from velatura.stack.layers import Diffuse, Interface, Kind, Layer, Medium, Value, declared, is_colour, reduced, within
from velatura.stack.material import DiffuseValues, InterfaceValues, LayerValues, Material, MediumValues
from velatura.stack.spectra import Measured, Named, names, rgb, spectrum, srgb_weights
from velatura.stack.stack import Stack
from velatura.stack.values import RGB, Brushing, Spectrum, Texture, Varying

__all__ = [
    "RGB",
    "Brushing",
    "Diffuse",
    "DiffuseValues",
    "Interface",
    "InterfaceValues",
    "Kind",
    "Layer",
    "LayerValues",
    "Material",
    "MaterialLike",
    "Measured",
    "Medium",
    "MediumValues",
    "Named",
    "Spectrum",
    "Stack",
    "Texture",
    "Value",
    "Varying",
    "declared",
    "dumps",
    "is_colour",
    "json_schema",
    "load",
    "loads",
    "names",
    "parameter_table",
    "preset",
    "presets",
    "reduced",
    "rgb",
    "save",
    "spectrum",
    "srgb_weights",
    "within",
]
