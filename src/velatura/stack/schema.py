"""Declarations of the parameters of a material, and the models that hold parameters.

A parameter is declared once, as the annotation of a model's field: its type (a class of `values`: `Scalar`,
`Colour`, ...), its range, unit and meaning, and whether it may be textured and differentiated. Validation, the JSON
Schema and the manual's table are derived from that declaration.
"""

from __future__ import annotations

import difflib
import functools
import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import CoreSchema, core_schema

from velatura.errors import InvalidInput, short

RecordType = TypeVar("RecordType", bound="Record")
Given = TypeVar("Given", contravariant=True)
Kept = TypeVar("Kept", covariant=True)


def unknown(what: str, name: object, known: Iterable[str], listed: str = "") -> str:
    """One line about an unknown name: the known one that looks alike; else all, or where so many are `listed`."""
    # Of a file's own names, which may be many and long, a part is compared
    lower_case = {option.lower(): option for option in itertools.islice(known, 1000) if len(option) <= 100}
    near = difflib.get_close_matches(str(name)[:100].lower(), lower_case, n=1, cutoff=0.65)
    if near:
        return f"unknown {what} {show(name)} (did you mean {lower_case[near[0]]}?)"
    if len(lower_case) <= 16:
        return f"unknown {what} {show(name)} (known: {', '.join(lower_case.values())})"
    return f"unknown {what} {show(name)}" + (f" ({listed})" if listed else "")


def show(value: object) -> str:
    """`value` as quoted in an error message: one line, of limited length."""
    if value is None:
        return "nothing"
    try:
        text = repr(value)
    except ValueError:  # of an integer of more digits than Python writes
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


@dataclass(frozen=True)
class Parameter:
    """The declaration of one parameter."""

    doc: str
    unit: str = ""
    differentiable: bool = False
    texturable: bool = False

    what: ClassVar[str] = ""

    @property
    def values(self) -> str:
        """The allowed values, as in the manual."""
        return self.what

    @property
    def expects(self) -> str:
        """The allowed values, as in an error message."""
        return self.values

    @property
    def bounds(self) -> str:
        """The range, as the manual prints it; empty where the parameter has none."""
        return ""

    def check(self, value: Any) -> Any:
        """The value in its canonical form; ValueError, in one line, where it is not a value of this parameter."""
        raise NotImplementedError

    def json_schema(self) -> dict[str, Any]:
        """The JSON Schema of the values."""
        raise NotImplementedError

    def refuse(self, value: object) -> ValueError:
        """The error for a value of the wrong type."""
        return ValueError(f"must be {self.expects}, got {show(value)}")

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)


class Taken(Generic[Given, Kept]):
    """The type of a field that is given as one type and kept as another, as type checkers read it."""

    if TYPE_CHECKING:

        def __get__(self, record: object, owner: type | None = None) -> Kept: ...

        def __set__(self, record: object, value: Given) -> None: ...


def by_default(value: Any) -> Any:
    """The default of a `Taken` field, which is not of that type."""
    return value


LONGEST_REPR = 4_000  # characters of a field


class _Written(str):
    """A text that is its own repr."""

    __repr__ = str.__str__


class Record(BaseModel):
    """A frozen model whose fields are declared parameters; its errors are InvalidInput, in one line.

    `holds` is what a mapping of it holds, in words.
    """

    model_config = ConfigDict(frozen=True)
    holds: ClassVar[str] = "keys and values"

    def __init__(self, /, **fields: Any) -> None:
        for key in fields:
            if key not in type(self).model_fields:
                raise InvalidInput(unknown("key", key, type(self).model_fields))
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise InvalidInput(_first_line(error)) from None

    def __setattr__(self, key: str, value: Any) -> None:
        if key.startswith("_"):  # what a record keeps of files that it has read
            return super().__setattr__(key, value)
        raise InvalidInput(f"{key}: a {type(self).__name__} is never changed; make another one with that value")

    def __delattr__(self, key: str) -> None:
        raise InvalidInput(f"{key}: a {type(self).__name__} is never changed; make another one without that value")

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Fields and values, of long ones their ends: a table of a spectrum would fill screens."""
        for key, value in super().__repr_args__():
            yield key, _Written(short(repr(value), LONGEST_REPR))

    @classmethod
    def from_dict(cls: type[RecordType], fields: Any) -> RecordType:
        """The model described by a mapping as it stands in a file.

        Raises:
            InvalidInput: no mapping, an unknown key, a key without a value, or a value outside its range.
        """
        if not isinstance(fields, Mapping):
            raise InvalidInput(f"must hold {cls.holds}, got {show(fields)}")
        for key, value in fields.items():
            if value is None and key in cls.model_fields:
                raise InvalidInput(f"{key}: has no value")
        return cls(**{str(key): value for key, value in fields.items()})

    def to_dict(self) -> dict[str, Any]:
        """The mapping that `from_dict` reads back: plain values, defaults left out."""
        fields = type(self).model_fields
        return {key: plain(value) for key, value in self if value != fields[key].default}


def plain(value: Any) -> Any:
    """`value` in the types of YAML and JSON."""
    if isinstance(value, Record):
        return value.to_dict()
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, tuple):
        return [plain(entry) for entry in value]
    return value


@functools.cache
def parameters(model: type[Record]) -> Mapping[str, Parameter]:
    """The declared parameters of a model, in order."""
    return {
        key: declaration
        for key, field in model.model_fields.items()
        for declaration in field.metadata
        if isinstance(declaration, Parameter)
    }


def _first_line(error: ValidationError) -> str:
    first = error.errors()[0]
    reason = "missing" if first["type"] == "missing" else str(first["ctx"]["error"])
    return ": ".join([*map(str, first["loc"]), reason])
