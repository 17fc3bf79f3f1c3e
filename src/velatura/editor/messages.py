"""Bodies and answers of the page's calls, mappings of JSON's types, and their common parts.

The allowed values of the keys of bodies are declared once, in `KEYS`; a verb that is `admitting` is called
with declared keys only, and checks itself which of them it requires.
"""

from __future__ import annotations

import base64
import dataclasses
import functools
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from velatura.editor import library
from velatura.editor.arrays import Picture, Triangles
from velatura.errors import InvalidInput
from velatura.inverse.lobes.target import MOST_INTERFACES
from velatura.inverse.wishes import Available
from velatura.inverse.wishes.wish import STEEPEST
from velatura.model import DEFAULT, Model, named
from velatura.stack import Described, Stack, dumps, single
from velatura.stack.mix import MOST, from_dict
from velatura.stack.schema import Parameter, show
from velatura.stack.values import THICKEST_NM, Films, Flag, Scalar, Whole

Body: TypeAlias = Mapping[str, Any]
Answer: TypeAlias = dict[str, Any]
Verb: TypeAlias = Callable[[Body], Answer]

_TYPES: dict[Any, str] = {
    str: "text",
    dict: "an object",
    tuple: "a list",
    bool: "true or false",
    int: "a whole number",
    float: "a number",
}

LAYERS, LOBES = 48, 16  # of a material, and of a target
DEEPEST = 24  # lists and objects in one another
BIGGEST = 1e30  # number, which single precision holds
DIGITS = 8  # of values in files, all that single precision has
TEXT = 2**18  # characters of a material file


def field(body: Body, key: str, kind: type, default: Any = None) -> Any:
    """A value of a body; InvalidInput where it is missing, unless there is a default, or of another type."""
    value = body.get(key, default)
    if not isinstance(value, kind):
        raise InvalidInput(f"{key}: must be {_TYPES[kind]}, got {show(value)}")
    return value


def material_of(body: Body) -> Described:
    """The stack or the mixture that a body describes under `material`."""
    return from_dict(field(body, "material", dict))


def stack_of(body: Body, what: str) -> Stack:
    """The stack under `material`, for what takes no mixture. Raises InvalidInput where it is one."""
    return single(material_of(body), what)


def model_of(body: Body) -> Model:
    """The model under `model`, with its `switches`."""
    return named(field(body, "model", str, DEFAULT), **field(body, "switches", dict, {}))


# What bodies may hold ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Words(Parameter):
    """Text, up to a length."""

    most: int = 255

    what: ClassVar[str] = "text"

    def check(self, value: Any) -> str:
        if not isinstance(value, str):
            raise self.refuse(value)
        if len(value) > self.most:
            raise ValueError(f"may have {self.most} characters at most, got {len(value)}")
        return value


@dataclass(frozen=True)
class Several(Parameter):
    """A list of values."""

    entry: Parameter = dataclasses.field(default_factory=lambda: Scalar("", texturable=False))
    most: int = LAYERS

    @property
    def values(self) -> str:
        return f"a list, each {self.entry.values}"

    def check(self, value: Any) -> list[Any]:
        if not isinstance(value, list):
            raise self.refuse(value)
        if len(value) > self.most:
            raise ValueError(f"may hold {self.most} at most, got {len(value)}")
        return [self.entry.check(entry) for entry in value]


@dataclass(frozen=True)
class Fields(Parameter):
    """An object; its reader checks the content, except the number of `entries` under one of its keys."""

    entries: str = ""
    most: int = LAYERS

    what: ClassVar[str] = "an object"

    def check(self, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.refuse(value)
        entries = value.get(self.entries)
        if isinstance(entries, list) and len(entries) > self.most:
            raise ValueError(f"{self.entries}: may be {self.most} at most here, got {len(entries)}")
        return value


@dataclass(frozen=True)
class Written(Fields):
    """A material: a stack, or a mixture whose materials are written out, as none is read from a file here."""

    def check(self, value: Any) -> dict[str, Any]:
        checked = super().check(value)
        for number, part in enumerate(_parts(checked)):
            material = part.get("material") if isinstance(part, dict) else None
            if not isinstance(material, dict):
                raise ValueError(f"part {number}: material: must be written out here, got {show(material)}")
            try:
                self.check(material)
            except ValueError as error:
                raise ValueError(f"part {number}: {error}") from None
        return checked


def _parts(material: dict[str, Any]) -> list[Any]:
    parts = material.get("mix", [])
    if not isinstance(parts, list):
        raise ValueError(f"mix: must be a list of parts, got {show(parts)}")
    if len(parts) > MOST:
        raise ValueError(f"mix: may be {MOST} parts at most, got {len(parts)}")
    return parts


class Size(Parameter):
    """A number of pixels, or of both sides."""

    what = "a whole number, or two"

    def check(self, value: Any) -> Any:
        side = Whole("", low=1, high=4096)
        return Several("", entry=side, most=2).check(value) if isinstance(value, list) else side.check(value)


class Camera(Parameter):
    """A view from `origin` to `target`, `fov` degrees wide; upwards is y."""

    what = "an object of fov, origin and target"

    def check(self, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.refuse(value)
        fov = _within("camera.fov", value.get("fov"), Scalar("", low=0, high=180, strict=True, texturable=False))
        origin, target = (_point(f"camera.{key}", value.get(key)) for key in ("origin", "target"))
        if math.hypot(origin[0] - target[0], origin[2] - target[2]) < 1e-4 * max(1.0, math.dist(origin, target)):
            raise InvalidInput("camera.origin: must not lie on, above or below the target")
        return {"fov": fov, "origin": origin, "target": target}


def _within(name: str, value: Any, declared: Parameter) -> Any:
    try:
        return declared.check(value)
    except InvalidInput:
        raise
    except ValueError as error:
        raise InvalidInput(f"{name}: {error}") from None


def _point(name: str, value: Any) -> list[float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InvalidInput(f"{name}: must be three numbers, got {show(value)}")
    return [_within(name, x, Scalar("", low=-1e4, high=1e4, texturable=False)) for x in value]


#: The allowed values of the keys of all bodies; null is the same as a missing key.
KEYS: dict[str, Parameter] = {
    "material": Written("of a material", entries="layers", most=LAYERS),
    "target": Fields("of a target", entries="lobes", most=LOBES),
    "read": Fields("of the lobes that a material has", entries="lobes", most=LOBES),
    "model": Words("of a model"),
    "switches": Fields("of the model"),
    "coarse": Flag("directions, and searches"),
    "available": Available("substances that a workshop has"),
    "thinnest": Scalar("depth of a coat", low=0, texturable=False),
    "angle": Scalar("of a second look, degrees", low=0, high=STEEPEST, texturable=False),
    "lobe": Whole("which lobe of the target", high=LOBES - 1),
    "layer": Whole("which layer of the material", high=LAYERS - 1),
    "film": Whole("which film of the layer", high=Films.most - 1),
    "thickness_nm": Scalar("of a film", low=1, high=THICKEST_NM, texturable=False),
    "interfaces": Several("interfaces of each lobe", entry=Whole("", low=1, high=MOST_INTERFACES)),
    "point": Several("of a class", most=3),
    "map": Words("of a class"),
    "depths": Fields("of a member: optical depths [r, g, b] by name"),
    "eta": Scalar("of a coat", texturable=False),
    "alpha": Scalar("of a coat", texturable=False),
    "keep": Flag("the appearance below the coat"),
    "name": Words("of a table, an object, an environment, a validation"),
    "parameters": Fields("of a validation"),
    "key": Words("of tables"),
    "to": Words("of a format"),
    "fixed": Flag("the values of an export"),
    "prefix": Words("of the names of an export", most=64),
    "group": Whole("of the textures of an export", high=2**16),
    "binding": Whole("of the first texture of an export", high=2**16),
    "baked": Flag("the lobes of an export"),
    "half": Flag("the precision of textures of an export"),
    "tables": Flag("of an export, in one file for several"),
    "bare": Flag("what is read of a file: not the material that a bake holds, but its parameters"),
    "text": Words("of a material file", most=TEXT),
    "file": Words("of the folder"),
    "version": Words("of a file"),
    **library.KEYS,
    "data": Words("of a file, in base64", most=2**26),
    "object": Words("that is seen"),
    "mesh": Triangles("in the place of a named object"),
    "environment": Words("that lights it"),
    "light": Picture("in the place of that of the environment"),
    "rotation": Scalar("of the environment, degrees about y", low=-BIGGEST, high=BIGGEST, texturable=False),
    "camera": Camera("that sees it"),
    "size": Size("of a picture, a map"),
    "spp": Whole("samples per pixel", low=1, high=64),
    "samples": Whole("per pixel of a picture that is written", low=1, high=65536),
    "step": Whole("of a picture that is written", high=2**31),
    "walk": Flag("through the layers, instead of the model"),
    "transparent": Flag("the ground of a picture"),
    "denoised": Flag("the picture"),
    "view": Words("of the view transform of a picture"),
    "exposure": Scalar("of a picture, in stops", low=-20, high=20, texturable=False),
    "seed": Whole("of the random numbers", low=1, high=2**31),
}


def admitted(body: Body) -> Body:
    """The declared keys of a body. Raises InvalidInput for values that are not allowed."""
    checked = {}
    for key, declared in KEYS.items():
        value = body.get(key)
        if value is not None:
            _check_plain(key, value)
            checked[key] = _within(key, value, declared)
    return checked


def admitting(verb: Verb) -> Verb:
    """The verb, called with the admitted part of a body."""
    return functools.wraps(verb)(lambda body: verb(admitted(body)))


def _check_plain(key: str, value: Any, depth: int = 1) -> None:
    """Raise InvalidInput for numbers, and for lists in lists, that lead nowhere."""
    if isinstance(value, dict | list):
        if depth > DEEPEST:
            raise InvalidInput(f"{key}: lists and objects may lie in one another {DEEPEST} deep at most")
        for entry in value.values() if isinstance(value, dict) else value:
            _check_plain(key, entry, depth + 1)
    elif isinstance(value, int | float) and not abs(value) <= BIGGEST:
        raise InvalidInput(f"{key}: numbers must be finite and at most {BIGGEST:g} in size, got {show(value)}")


# What answers hold ---------------------------------------------------------------------------------------------------


def document(material: Described) -> Answer:
    """A material as a body holds it."""
    fields: Answer = json.loads(dumps(material, "json", "."))
    return fields


def to_write(body: Body) -> Described:
    """The material of a body with DIGITS digits of every value, where these make one: files are read by people."""
    material = material_of(body)
    try:
        return from_dict(_rounded(material.to_dict()))
    except InvalidInput:  # of a value beside the excluded end of its range
        return material


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_rounded(entry) for entry in value)
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def array(values: ArrayLike, dtype: str = "float32") -> Answer:
    """An array as a body holds it, in base64."""
    array = np.ascontiguousarray(values, dtype)
    return {"dtype": dtype, "shape": array.shape, "data": base64.b64encode(array.tobytes()).decode()}
