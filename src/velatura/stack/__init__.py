"""Materials: layers, their parameters, and the files that hold them, without optics or rendering."""

from velatura.stack.coatings import refuse as refuse_films
from velatura.stack.describe import json_schema, parameter_table
from velatura.stack.flat_names import Address
from velatura.stack.io import MaterialLike, dumps, load, loads, preset, presets, save, single
from velatura.stack.layers import (
    BaseValues,
    Diffuse,
    DiffuseValues,
    FilmValues,
    Interface,
    InterfaceValues,
    Kind,
    Layer,
    LayerValues,
    Medium,
    MediumValues,
    SlabValues,
    Value,
)
from velatura.stack.material import Material, as_described, number
from velatura.stack.mix import Described, Mix, Part, addressed
from velatura.stack.pigments import Pigment
from velatura.stack.spectra import (
    Measured,
    MeasuredIndex,
    Named,
    luminance_sensitivity,
    names,
    rgb,
    spectrum,
    srgb_sensitivity,
    srgb_weights,
)
from velatura.stack.stack import Stack
from velatura.stack.values import RGB, Brushing, Film, Spectrum, Substance, Texture, Varying

__all__ = [
    "RGB",
    "Address",
    "BaseValues",
    "Brushing",
    "Described",
    "Diffuse",
    "DiffuseValues",
    "Film",
    "FilmValues",
    "Interface",
    "InterfaceValues",
    "Kind",
    "Layer",
    "LayerValues",
    "Material",
    "MaterialLike",
    "Measured",
    "MeasuredIndex",
    "Medium",
    "MediumValues",
    "Mix",
    "Named",
    "Part",
    "Pigment",
    "SlabValues",
    "Spectrum",
    "Stack",
    "Substance",
    "Texture",
    "Value",
    "Varying",
    "addressed",
    "as_described",
    "dumps",
    "json_schema",
    "load",
    "loads",
    "luminance_sensitivity",
    "names",
    "number",
    "parameter_table",
    "preset",
    "presets",
    "refuse_films",
    "rgb",
    "save",
    "single",
    "spectrum",
    "srgb_sensitivity",
    "srgb_weights",
]
