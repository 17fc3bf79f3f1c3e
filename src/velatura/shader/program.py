"""A material as a shader: its recording, printed with all declarations."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from velatura.errors import InvalidInput, remark
from velatura.model import DEFAULT, SWITCHES, Model, named
from velatura.model.papers.lobe_merging import merging
from velatura.shader import material
from velatura.shader.lookups import atlas, films
from velatura.shader.lookups.lookup import LookUp
from velatura.shader.printers.glsl import GLSL
from velatura.shader.printers.printer import Field, Printer, Struct
from velatura.shader.recorder.cost import Cost, cost
from velatura.shader.recorder.recording import Recording, record
from velatura.shader.recorder.seen import part
from velatura.stack import MaterialLike, Texture, single

PREFIX = "vt"  # of names in code
_PREFIX = re.compile(r"(?!gl_)[A-Za-z](_?[A-Za-z0-9])*")
_NAME = re.compile(r"\b(vt_|Vt(?=[A-Z])|VT_)")


@dataclass(frozen=True)
class Shader:
    """The code, the names of the tables that it looks up, and its uniforms.

    `uniforms` are the values that the struct of the material holds, or that `baked` reads: flat names (`layer0_eta`)
    and where they lie in the struct (`layer0.eta`). `maps` are the textures of the material by sampler.

    Where values are parameters: `shown` names the lobes that `vt_shown` weighs, in order, and `baked` is what works out
    the lobes for the texture `vt_baked`, None where a texture makes them differ from point to point. A solved material
    always has one; `columns` is the texture of a single one.
    `film_tables` names the tables of thin films that the code, or `baked`, looks up in the texture `vt_films`.
    `lobes` are the layers whose light each reflected lobe is, seen from above; `shares` names the energies or chances,
    fields of `VtLobes`, by which `vt_sample` divides its first number, in order.
    `costs` are those of `vt_lobes`, `vt_eval_pdf` and `vt_sample`, each called once; `shared` says whether the texture
    of tables is the same for all materials.
    """

    text: str
    looked_up: Sequence[str]
    uniforms: Mapping[str, str]
    maps: Mapping[str, Texture]
    lobes: Sequence[Sequence[int]]
    shown: Sequence[str]
    shares: Sequence[str]
    baked: LookUp | None
    film_tables: Sequence[str]
    films: np.ndarray | None  # their texture, float32 of shape (height, width, 4); None without any
    costs: Mapping[str, Cost]
    shared: bool

    @property
    def tables(self) -> np.ndarray:
        """The texture of the tables that are looked up, or of all, float32 of shape (height, width, 4)."""
        return atlas.texture(atlas.every() if self.shared else self.looked_up)

    @property
    def columns(self) -> np.ndarray | None:
        """The texture `vt_baked` of known values, float32 of shape (height, width, 4)."""
        return self.baked.known if self.baked else None

    @cached_property
    def key(self) -> str:
        """Equal for equal code."""
        tape = self.baked.tape if self.baked else None
        return hashlib.sha256(f"{self.text}{tape}".encode()).hexdigest()[:16]


def shader(
    stack: MaterialLike,
    model: str | Model = DEFAULT,
    constant: Collection[str] = (),
    values: Literal["literals", "uniforms"] = "literals",
    printer: Printer = GLSL,
    prefix: str = PREFIX,
    shared: bool = False,
    baking: bool = False,
    **switches: str,
) -> Shader:
    """A material as shader code: the structs `VtMaterial` and `VtLobes`, and functions on them.

    Args:
        stack: a material (a stack, a file, or a preset's name). Its kinds of layers make the code; its values go into
            `vt_material`, which gives them.
        constant: flat names of values that never change, which are worked out now and are not in the struct. Of a
            material that is solved, all are.
        values: plain values as `literals`, or as `uniforms` that a user changes; then the code is the same for all
            of them, be roughnesses equal or not, and lobes are drawn once for a change, and read.
        printer: the language; GLSL ES 3.00 by default.
        prefix: begins the names of functions, structs, textures and macros, so that one program may hold several
            materials: `vt` of `vt_lobes`, `VtLobes` and `VT_TABLES_BINDING`.
        shared: whether the texture of tables holds all of them, so that it is the same for all materials.
        baking: whether lobes are read from a texture over direction for any model, of values that never change.

    Raises:
        InvalidInput: as `record`; a prefix that names cannot begin with.
    """
    if not _PREFIX.fullmatch(prefix):
        raise InvalidInput(f"prefix: must be letters, digits and single underscores, a letter first, not {prefix!r}")
    stack = single(stack, "shader code")
    recording = record(stack, model, constant, values == "uniforms", baking, **switches)
    baked, read, shown = recording.baked, list(recording.read), recording.shown
    looked_up = {symbol.detail for symbol in recording.symbols if symbol.op in ("texels", "value")}
    layouts, filled = (
        atlas.layouts(looked_up, atlas.every() if shared else None),
        material.filled(stack, read, bool(shown)),
    )
    placed = films.layouts(recording.films)
    name = "A material" if shown else remark(material.title(stack))
    costs = _costs(recording)
    parts = [
        printer.header(name, described(recording.model), not recording.read, costs),
        printer.structs(material.structs(stack, read)),
        *([printer.parameters(len(shown), *((baked.colours, baked.numbers) if baked else (0, 0)))] if shown else []),
        printer.material(filled),
        printer.structs(_structs(recording)),
        *([printer.tables(layouts)] if layouts else []),
        *([printer.lookup(baked)] if baked else []),
        *([printer.films(placed)] if placed else []),
        printer.helpers({(symbol.op, symbol.kind) for symbol in recording.symbols}),
        printer.lobes({name: (value, recording.kinds[name]) for name, value in recording.lobes.items()}),
        *([printer.energies([(value, "colour") for value in recording.energies])] if recording.energies else []),
        printer.eval_pdf((recording.value, "colour"), (recording.density, "number")),
        printer.sample([(w, "number") for w in recording.drawn]),
    ]
    return Shader(
        text=prefixed("\n".join(parts), prefix),
        looked_up=[layout.name for layout in layouts],
        uniforms=recording.parameters,
        maps={prefixed(name, prefix): image for name, image in filled.samplers.items()},
        lobes=_interfaces(recording),
        shown=shown,
        shares=recording.shares,
        baked=baked,
        film_tables=[layout.name for layout in placed],
        films=films.texture(films.tables(stack, recording.films, recording.model)),
        costs={prefixed(name, prefix): cost for name, cost in costs.items()},
        shared=shared,
    )


def prefixed(text: str, prefix: str) -> str:
    """Code whose own names begin with a prefix."""
    words = "".join(word[:1].upper() + word[1:] for word in prefix.split("_"))
    names = {"vt_": f"{prefix}_", "Vt": words, "VT_": f"{prefix.upper()}_"}
    return text if prefix == PREFIX else _NAME.sub(lambda found: names[found[1]], text)


def _costs(recording: Recording) -> dict[str, Cost]:
    """Cost of each function; lobes are read from a texture of one or two axes."""
    functions = {
        "vt_lobes": list(recording.lobes.values()),
        "vt_eval_pdf": [recording.value, recording.density],
        "vt_sample": recording.drawn,
    }
    axes = len(recording.baked.nodes) if recording.baked else 0
    return {name: cost(outputs, axes) for name, outputs in functions.items()}


def _interfaces(recording: Recording) -> list[list[int]]:
    """The layers whose light each reflected lobe is, seen from above."""
    places = recording.stack.surfaces[: len(recording.stack.interfaces)]
    if recording.energies:
        return [[place] for place in places]
    return [[places[k] for k in group] for group in merging(recording.model, len(places))]


def described(model: Model) -> str:
    """The name of a model, with the switches that were changed."""
    shipped = named(model.name)
    changed = [f"{key}={getattr(model, key)}" for key in SWITCHES if getattr(model, key) != getattr(shipped, key)]
    changed += ["in closed form"] if model.closed_form and not shipped.closed_form else []
    return " ".join([model.name, *([f"({', '.join(changed)})"] if changed else [])])


def _structs(recording: Recording) -> list[Struct]:
    """A lobe, all that is known once wi is, and energies of a solved material."""
    kinds = recording.kinds
    places = dict.fromkeys(name.rpartition(".")[0] for name in kinds if "." in name)
    count = sum(place.startswith("reflected") for place in places)
    parts = {part(name): kind for name, kind in kinds.items() if "." in name}
    members = [Field("reflected", "VtLobe", count)] if count else []
    members += [Field("transmitted", "VtLobe")] if "transmitted" in places else []
    members += [Field(name, kind) for name, kind in kinds.items() if "." not in name]
    lobe = Struct("VtLobe", [Field(name, kind) for name, kind in parts.items()], "rotation in radians")
    lobes = Struct("VtLobes", members, "of light from one direction")
    count = len(recording.energies)
    energies = Struct("VtEnergies", [Field("parts", "colour", count)], "of interfaces, the remainder, what passes")
    return [*([lobe] if parts else []), lobes, *([energies] if count else [])]
