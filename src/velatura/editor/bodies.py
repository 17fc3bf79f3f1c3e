"""Bodies and answers of the page's calls, mappings of JSON's types, and what stands in many of them."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from velatura.errors import InvalidInput
from velatura.model import DEFAULT, Model, named
from velatura.stack import Stack, dumps
from velatura.stack.schema import show

Body: TypeAlias = Mapping[str, Any]
Answer: TypeAlias = dict[str, Any]
Verb: TypeAlias = Callable[[Body], Answer]

_TYPES: dict[Any, str] = {str: "text", dict: "an object"}


def field(body: Body, key: str, kind: type, default: Any = None) -> Any:
    """A value of a body; InvalidInput where it is missing, unless there is a default, or of another type."""
    value = body.get(key, default)
    if not isinstance(value, kind):
        raise InvalidInput(f"{key}: must be {_TYPES[kind]}, got {show(value)}")
    return value


def material_of(body: Body) -> Stack:
    """The stack that a body describes under `material`."""
    return Stack.from_dict(field(body, "material", dict))


def model_of(body: Body) -> Model:
    """The model under `model`, with its `switches`."""
    return named(field(body, "model", str, DEFAULT), **field(body, "switches", dict, {}))


def document(stack: Stack) -> Answer:
    """A stack as a body holds it."""
    fields: Answer = json.loads(dumps(stack, "json", "."))
    return fields


def array(values: ArrayLike, dtype: str = "float32") -> Answer:
    """An array as a body holds it, in base64."""
    array = np.ascontiguousarray(values, dtype)
    return {"dtype": dtype, "shape": array.shape, "data": base64.b64encode(array.tobytes()).decode()}
