"""Plans: a space, and what is asked of each of its points; in Python or as a file."""

from __future__ import annotations

import hashlib
import importlib.metadata
import inspect
import platform
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from velatura.errors import within
from velatura.stack import io
from velatura.stack.paths import rewritten
from velatura.stack.schema import Parameter, show, unknown
from velatura.sweeps.questions import QUESTIONS, Question
from velatura.sweeps.space import Number, Space
from velatura.version import __version__

#: Packages whose versions may change the numbers.
PACKAGES = ("mitsuba", "drjit", "numpy", "scipy")


class QuestionName(Parameter):
    """The name of a question, or a function."""

    what = f"one of {', '.join(QUESTIONS)}, or in Python a function (material, seed)"

    def check(self, value: Any) -> str | Callable[..., Any]:
        if isinstance(value, str) and value not in QUESTIONS:
            raise ValueError(unknown("question", value, QUESTIONS))
        if not isinstance(value, str) and not callable(value):
            raise self.refuse(value)
        return value


class Options(Parameter):
    """Keyword arguments of the question."""

    what = "keys and values"

    def check(self, value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise self.refuse(value)
        return {str(key): _plain(str(key), entry) for key, entry in value.items()}


class Plan(Space):
    """A space, and what is asked of each of its points.

    Args:
        what: `lobes`, `albedo`, `statistics`, `distribution`, `check`, `render` or `inverse`; or a function that is
            called with the material and the seed of a point, and returns its arrays by name.
        options: keyword arguments of it.
        chunk: points in a chunk of the store, at most, which is computed and written at once. By default, half the
            root of the number of points.
    """

    holds = "the keys of a plan, material above all"

    what: Annotated[str | Callable[..., Any], QuestionName("what is asked of each point")] = "lobes"
    options: Annotated[dict[str, Any], Options("keyword arguments of the question")] = Field(default_factory=dict)
    chunk: Annotated[int | None, Number("points that are computed and written at once", low=1)] = None

    @model_validator(mode="after")
    def _options_fit(self) -> Plan:
        try:
            inspect.signature(self.question.ask).bind(self.material, 0, **self.options)
        except TypeError as error:
            raise ValueError(f"options: {error}") from None
        return self

    @property
    def question(self) -> Question:
        """The question."""
        return Question(self.what) if callable(self.what) else QUESTIONS[self.what]

    def to_dict(self) -> dict[str, Any]:
        """The mapping of a file; a function by its name and the digest of its source."""
        fields = super().to_dict()
        return {**fields, "what": _described(self.what) if callable(self.what) else self.what}


def load_plan(path: str | Path) -> Plan:
    """The plan in a file (.yaml, .yml or .json); files that it names are relative to it.

    Raises:
        InvalidInput: no such file, or its content is not a plan; one line that names the file.
    """
    fields = io.read(path, "a plan")
    with within(str(path)):
        return Plan.from_dict(_beside(Path(path).parent, fields))


def _beside(folder: Path, fields: Any) -> Any:
    """The keys of a plan, with files of materials relative to its folder; what holds no keys as it is."""
    if not isinstance(fields, Mapping):
        return fields

    def found(material: Any) -> Any:
        if isinstance(material, str):
            return str(folder / material) if Path(material).suffix else material
        return rewritten(material, lambda path: str(folder / path))

    fields, vary = {**fields, "material": found(fields.get("material"))}, fields.get("vary")
    axis = vary.get("material") if isinstance(vary, Mapping) else None
    if isinstance(vary, Mapping) and isinstance(axis, Mapping) and isinstance(axis.get("values"), list):
        fields["vary"] = {**vary, "material": {**axis, "values": [found(each) for each in axis["values"]]}}
    return fields


def versions() -> dict[str, str]:
    """Versions of what the numbers depend on; of a renderer that is not installed "none"."""
    found = {"velatura": __version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "none"
    return found


def _described(function: Callable[..., Any]) -> dict[str, str]:
    name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', type(function).__name__)}"
    try:
        source = inspect.getsource(function)
    except (OSError, TypeError):  # typed into a prompt, or no Python
        return {"function": name}
    return {"function": name, "source": hashlib.sha256(source.encode()).hexdigest()[:16]}


def _plain(key: str, value: Any) -> Any:
    """An option in the types of a file."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(key, entry) for entry in value]
    if isinstance(value, Mapping):
        return {str(name): _plain(key, entry) for name, entry in value.items()}
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise ValueError(f"{key}: must be a number, text, or a list or mapping of these, got {show(value)}")
