"""Requests for exports, what is written, and what several formats write alike."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from velatura import files
from velatura.errors import InvalidInput
from velatura.results import Fields
from velatura.version import __version__

if TYPE_CHECKING:
    from velatura.model import Model
    from velatura.shader.closures import Loss
    from velatura.stack import Described

LICENCE = "BSD-3-Clause"  # of code that is written


@dataclass(frozen=True)
class Request:
    """A request for an export: a format, a material, the model with its changed switches, and the format's options.

    Paths of textures are relative to `folder`, where the format allows that; absolute without one. `progress` is called
    with steps done and their total, by formats that take long.
    """

    to: str
    material: Described
    model: Model
    switches: Mapping[str, str]
    folder: Path | None
    options: Mapping[str, Any]
    progress: Callable[[int, int], None] | None = None

    @property
    def constants(self) -> Collection[str]:
        """Names of the values that are worked in; of all that do not vary for ["all"]."""
        from velatura.stack import Varying

        asked: Collection[str] = self.options.get("constant", ())
        if list(asked) != ["all"]:
            return asked
        return [name for name, value in self.material.flat().items() if not isinstance(value, Varying)]

    def bsdf(self, what: str) -> Any:
        """The plugin's BSDF of the material, which `what`, "a matrix", tabulates at one point.

        Raises:
            InvalidInput: a texture, or a variant other than those of RGB over arrays.
        """
        from velatura import api, kernel
        from velatura.stack import Varying

        varying = [address.name for address, value in self.material.values() if isinstance(value, Varying)]
        if varying:
            raise InvalidInput(f"{varying[0]}: {what} is of one point, and has no textures")
        mi = kernel.mitsuba()
        if not mi.is_rgb or mi.variant().startswith("scalar"):
            rule = "is written in a vectorised RGB variant, llvm_ad_rgb for one"
            raise InvalidInput(f"{self.to}: {rule}, not in {mi.variant()}")
        return api.bsdf(self.material, self.model)


class Stored(NamedTuple):
    """A texture in a file, in rows of little-endian numbers: its name in the code, the ending of the file or the path
    of one that lies apart, the size in texels, and the format of a texel; `filter` is how the code reads it."""

    name: str
    file: str | Path
    width: int
    height: int
    format: str
    filter: str = "nearest"


@dataclass(frozen=True, repr=False)
class Export(Fields):
    """A text, and the files that belong beside it, by ending: `.tables.bin` is `gold.tables.bin` beside `gold.glsl`.

    data: the file itself in a format that is no text, which then is empty.
    binary: by another ending of the format, what makes the file that has it and is no text; all is in it.
    costs: of code, what a call of each function costs, in words; notes: of parameters, what is lost, in
    sentences; of code, shared tables that it does not read.
    apart: files that several exports share, and baked images, by path.
    facts: what a program needs to know to use the file, as JSON: `gold.glsl.json` beside `gold.glsl`; none if empty.
    textures: those of the code that lie in files, for the facts.
    """

    text: str
    beside: Mapping[str, bytes] = field(default_factory=dict)
    costs: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    apart: Mapping[Path, bytes] = field(default_factory=dict)
    data: bytes | None = None
    binary: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)
    textures: Sequence[Stored] = ()

    def save(self, path: str | Path) -> list[Path]:
        """Write the text to a file, what belongs beside it, and the facts; the written files, that of the text first.

        Raises:
            InvalidInput: a file cannot be written; an existing file stays.
        """
        path = Path(path)
        others = {path.with_suffix(ending): data for ending, data in self.beside.items()}
        others |= {} if path.suffix.lower() in self.binary else self.apart
        others |= {facts_beside(path): self.described(path).encode()} if self.facts else {}
        for other, data in others.items():
            with files.whole(other) as unfinished:
                unfinished.write_bytes(data)
        with files.whole(path) as unfinished:
            unfinished.write_bytes(self._content(path.suffix.lower()))
        return [path, *others]

    def _content(self, ending: str) -> bytes:
        if ending in self.binary:
            return self.binary[ending]()
        return self.text.encode() if self.data is None else self.data

    def described(self, path: Path) -> str:
        """The facts in JSON, where the file has a path."""
        textures = [
            {**each._asdict(), "file": path.with_suffix(each.file).name}
            if isinstance(each.file, str)
            else {**each._asdict(), "file": relative(each.file, path.parent)}
            for each in self.textures
        ]
        given = {**self.facts, "file": path.name, "textures": textures, "notes": self.notes}
        return json.dumps(given, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def facts_beside(path: Path) -> Path:
    """The file of the facts of an export."""
    return path.with_name(f"{path.name}.json")


def relative(path: Path, folder: Path | None) -> str:
    """A path as it stands in a file of a folder, if there is one."""
    return path.resolve().as_posix() if folder is None else files.relative(path, folder.resolve())


def origin() -> str:
    """The version that writes code, the date, and the licence under which the code may be used.

    The date is today, or that of the environment's SOURCE_DATE_EPOCH.

    Raises:
        InvalidInput: SOURCE_DATE_EPOCH is no date.
    """
    given = files.source_date()
    day = datetime.fromtimestamp(time.time() if given is None else given, timezone.utc)
    return f"Velatura {__version__}, {day:%Y-%m-%d}; SPDX-License-Identifier: {LICENCE}"


def stated(losses: Iterable[Loss]) -> list[dict[str, float]]:
    """Losses, as facts have them."""
    return [asdict(loss) for loss in losses]


def headed(text: str) -> str:
    """Code of a shader with its origin, in a comment below the first line."""
    first, _, rest = text.partition("\n")
    return f"{first}\n// {origin()}\n{rest}"
