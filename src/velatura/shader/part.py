"""A stack of a program: its recording, and its own functions and structs, which a mixture names after a part."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from velatura.model import Model
from velatura.model.papers.lobe_merging import merging
from velatura.shader import material
from velatura.shader.lookups import films
from velatura.shader.printers.printer import Field, Printer, Struct
from velatura.shader.recorder.cost import Cost, cost
from velatura.shader.recorder.recording import Recording, record
from velatura.shader.recorder.seen import part as last
from velatura.shader.recorder.symbol import LAYOUT, REMAINDER, SHOWN
from velatura.stack import Stack
from velatura.stack.flat_names import prefix

_OWN = re.compile(
    r"\b(?:(vt_)(?=(?:lobes|energies|eval_pdf|eval|pdf|sample|baked_\w+|column|film\d\w*|shown|remainder|layout)\b)"
    r"|(Vt)(?=(?:Material|Layer\d+|Lobes?|Energies)\b))"
)


@dataclass(frozen=True)
class PartCode:
    """A stack in the parts of a mixture that have the numbers `parts`, or alone; as a printer spells it."""

    parts: tuple[int, ...]
    recording: Recording
    printer: Printer

    @classmethod
    def of(
        cls,
        parts: tuple[int, ...],
        stack: Stack,
        model: Model,
        constant: Collection[str],
        printer: Printer,
        parameters: bool,
        baking: bool,
    ) -> PartCode:
        """The part of a stack; `constant` are flat names of the whole material."""
        own = [name for name in stack.flat() if prefix(parts) + name in constant]
        return cls(parts, record(stack, model, own, parameters, baking), printer)

    @property
    def prefix(self) -> str:
        """How the names of its values and functions begin."""
        return prefix(self.parts)

    @property
    def member(self) -> str:
        """The member of the structs of a mixture that is its own."""
        return material.member(self.parts)

    # What it reads

    @property
    def parameters(self) -> list[tuple[str, str, int]]:
        """The arrays of its own beside the values that change: kind, name and length."""
        baked, shown = self.recording.baked, len(self.recording.shown)
        colours, numbers = (baked.colours, baked.numbers) if baked and shown else (0, 0)
        arrays = ("number", SHOWN, shown), ("colour", REMAINDER, colours), ("number", LAYOUT, numbers)
        return [(kind, self.named(name), length) for kind, name, length in arrays if length]

    @property
    def interfaces(self) -> list[list[int]]:
        """The layers whose light each reflected lobe is, seen from above."""
        recording, stack = self.recording, self.recording.stack
        places = stack.surfaces[: len(stack.interfaces)]
        if recording.energies:
            return [[place] for place in places]
        return [[places[k] for k in group] for group in merging(recording.model, len(places))]

    @cached_property
    def columns(self) -> NDArray[np.floating] | None:
        """Its lines of the texture of lobes over direction."""
        return self.recording.baked.known if self.recording.baked else None

    @property
    def lines(self) -> int:
        """How many of these there are."""
        baked = self.recording.baked
        return 0 if baked is None else baked.height if self.columns is None else len(self.columns)

    @property
    def width(self) -> int:
        """How many texels each of these has."""
        return self.recording.baked.nodes[0] if self.recording.baked else 0

    @cached_property
    def films(self) -> Mapping[str, NDArray[np.floating]]:
        """Its tables of films, by their names in the program."""
        recording = self.recording
        found = films.tables(recording.stack, recording.films, recording.model)
        return {self.prefix + name: table for name, table in found.items()}

    @property
    def read(self) -> list[str]:
        """The values that its code reads, by the flat names of the whole material."""
        return [self.prefix + name for name in self.recording.read]

    @property
    def uniforms(self) -> dict[str, str]:
        """The values that anything reads, by these names, and their place in the struct."""
        within = f"{self.member}." if self.parts else ""
        return {self.prefix + name: within + place for name, place in self.recording.parameters.items()}

    # Its text, in which names of its own are those of a stack alone

    @cached_property
    def values(self) -> str:
        """The structs of its values."""
        return self.printer.structs(material.structs(self.recording.stack, list(self.recording.read)))

    @cached_property
    def lobes(self) -> str:
        """The structs of its lobes."""
        return self.printer.structs(_structs(self.recording))

    def lookup(self, first: int) -> str:
        """The functions that look up its lobes, if it does so, in a texture of which they begin at a line."""
        baked = self.recording.baked
        return self.printer.lookup(baked, first) if baked else ""

    @cached_property
    def functions(self) -> str:
        """The functions of its lobes, values and samples."""
        printer, recording = self.printer, self.recording
        texts = [
            printer.lobes({key: (value, recording.kinds[key]) for key, value in recording.lobes.items()}),
            *([printer.energies([(x, "colour") for x in recording.energies])] if recording.energies else []),
            printer.eval_pdf((recording.value, "colour"), (recording.density, "number")),
            printer.sample([(w, "number") for w in recording.drawn]),
        ]
        return "\n".join(texts)

    @property
    def pattern(self) -> Hashable:
        """Equal for stacks whose functions are the same; those that read arrays of their own have their own."""
        if self.recording.shown:
            return self.parts
        tables = [table.tobytes() for table in (self.columns, *self.films.values()) if table is not None]
        return (self.values, self.lobes, self.lookup(0), self.functions, *tables)

    def named(self, text: str) -> str:
        """Text of a stack alone with the names of this part."""
        words = "".join(word.capitalize() for word in self.prefix.split("_"))
        return _OWN.sub(lambda found: f"vt_{self.prefix}" if found[1] else f"Vt{words}", text) if self.parts else text

    @property
    def costs(self) -> dict[str, Cost]:
        """The cost of each function; lobes are read from a texture of one or two axes."""
        recording = self.recording
        functions = {
            "vt_lobes": list(recording.lobes.values()),
            "vt_eval_pdf": [recording.value, recording.density],
            "vt_sample": recording.drawn,
        }
        axes = len(recording.baked.nodes) if recording.baked else 0
        return {name: cost(outputs, axes) for name, outputs in functions.items()}


def _structs(recording: Recording) -> list[Struct]:
    """A lobe, all that is known once wi is, and energies of a solved material."""
    kinds = recording.kinds
    places = dict.fromkeys(name.rpartition(".")[0] for name in kinds if "." in name)
    count = sum(place.startswith("reflected") for place in places)
    parts = {last(name): kind for name, kind in kinds.items() if "." in name}
    members = [Field("reflected", "VtLobe", count)] if count else []
    members += [Field("transmitted", "VtLobe")] if "transmitted" in places else []
    alone = [name for name in kinds if "." not in name]
    lengths = Counter(name.partition("[")[0] for name in alone)
    members += [
        Field(name, kinds[first], lengths[name] if first != name else 0)
        for first in alone
        if first in (name := first.partition("[")[0], f"{name}[0]")
    ]
    lobe = Struct("VtLobe", [Field(name, kind) for name, kind in parts.items()], "rotation in radians")
    lobes = Struct("VtLobes", members, "of light from one direction")
    count = len(recording.energies)
    energies = Struct("VtEnergies", [Field("parts", "colour", count)], "of interfaces, the remainder, what passes")
    return [*([lobe] if parts else []), lobes, *([energies] if count else [])]
