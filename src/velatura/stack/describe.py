"""The format of material files, for machines and for the manual, derived from the declared parameters."""

from __future__ import annotations

from typing import Any

from velatura.stack.layers import LAYERS
from velatura.stack.mix import Mix, Part
from velatura.stack.phases import RECORDS
from velatura.stack.pigments import Pigment
from velatura.stack.schema import Parameter, Record, parameters
from velatura.stack.stack import Stack
from velatura.stack.values import Brushing, Film, Spectrum, Substance, Texture


def json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a material file. What only layers or parts together can break is not in it."""
    layers = [{**_object({entry: _keys(model)}), "required": [entry]} for entry, model in LAYERS.items()]
    stack = _keys(Stack)
    stack["properties"]["layers"] = {"type": "array", "minItems": 1, "items": {"oneOf": layers}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Velatura material",
        "oneOf": [{"$ref": "#/$defs/stack"}, {"$ref": "#/$defs/mixture"}],
        "$defs": {
            "stack": {**stack, "required": ["layers"]},
            "mixture": {**_keys(Mix), "required": _required(Mix)},
            "part": {**_keys(Part), "required": _required(Part)},
            "spectrum": {**_keys(Spectrum), "required": ["spectrum"]},
            "substance": {**_keys(Substance), "required": ["refractiveindex"]},
            "texture": {**_keys(Texture), "required": ["texture"]},
            "brushing": {**_keys(Brushing), "required": ["brushing"]},
            "film": {**_keys(Film), "required": ["eta", "thickness_nm"]},
            "pigment": _keys(Pigment),
            **{name: {**_keys(record), "required": _required(record)} for name, record in RECORDS.items()},
        },
    }


def parameter_table() -> str:
    """The table of all parameters, in Markdown, for the manual."""
    lines = [
        "| where | key | value | unit | range | default | texture | gradient | meaning |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    models: dict[str, type[Record]] = {
        "material": Stack,
        "mixture": Mix,
        "part": Part,
        **LAYERS,
        "spectrum": Spectrum,
        "substance": Substance,
        "texture": Texture,
        "brushing": Brushing,
        "film": Film,
        "pigment": Pigment,
        **RECORDS,
    }
    for where, model in models.items():
        for key, parameter in parameters(model).items():
            lines.append(_row(where, key, parameter, model.model_fields[key].default))
    return "\n".join(lines) + "\n"


def _keys(model: type[Record]) -> dict[str, Any]:
    return _object(
        {key: {**parameter.json_schema(), "description": parameter.doc} for key, parameter in parameters(model).items()}
    )


def _required(model: type[Record]) -> list[str]:
    return [key for key, field in model.model_fields.items() if field.is_required()]


def _object(properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _row(where: str, key: str, parameter: Parameter, default: object) -> str:
    cells = (
        where,
        f"`{key}`",
        parameter.values,
        parameter.unit,
        parameter.bounds,
        f"{default:g}" if isinstance(default, float) else default if isinstance(default, str) else "",
        "yes" if parameter.texturable else "",
        "yes" if parameter.differentiable else "",
        parameter.doc,
    )
    return f"| {' | '.join(cells)} |"
