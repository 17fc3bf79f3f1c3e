"""A material as a shader: its recording, printed with all declarations."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Literal

import numpy as np

from velatura.errors import InvalidInput, remark
from velatura.model import DEFAULT, SWITCHES, Model, named
from velatura.results import Fields
from velatura.shader.lookups import atlas, films
from velatura.shader.lookups.lookup import LookUp, stacked
from velatura.shader.material import filled as contents
from velatura.shader.material import title
from velatura.shader.mixture import Mixture
from velatura.shader.part import PartCode
from velatura.shader.printers.glsl import GLSL
from velatura.shader.printers.printer import Printer
from velatura.shader.recorder.cost import Cost
from velatura.shader.recorder.recording import check_constant
from velatura.stack import MaterialLike, Mix, Texture, load

PREFIX = "vt"  # of names in code
_PREFIX = re.compile(r"(?!gl_)[A-Za-z](_?[A-Za-z0-9])*")
_NAME = re.compile(r"\b(vt_|Vt(?=[A-Z])|VT_)")


@dataclass(frozen=True, repr=False)
class Shader(Fields):
    """The code, the names of the tables that it looks up, and its uniforms.

    `uniforms` are the values that the struct of the material holds, or that `baked` reads: flat names (`layer0_eta`)
    and where they lie in the struct (`layer0.eta`). `maps` are the textures of the material by sampler. `parts` are the
    recorded stacks, one or those of a mixture; `lines` are the first line of each in the texture `vt_baked`, of those
    that share functions the same.

    Of a stack alone, where values are parameters: `shown` names the lobes that `vt_shown` weighs, in order, and `baked`
    is what works out the lobes for the texture `vt_baked`, None where a texture makes them differ from point to point.
    A solved material always has one; `columns` is the texture `vt_baked` of known values, float32 of shape (height,
    width, 4).
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
    parts: Sequence[PartCode]
    lines: Sequence[int]
    columns: np.ndarray | None
    film_tables: Sequence[str]
    films: np.ndarray | None  # their texture, float32 of shape (height, width, 4); None without any
    costs: Mapping[str, Cost]
    shared: bool

    @property
    def tables(self) -> np.ndarray:
        """The texture of the tables that are looked up, or of all, float32 of shape (height, width, 4)."""
        return atlas.texture(atlas.every() if self.shared else self.looked_up)

    @property
    def baked(self) -> LookUp | None:
        return None if self._alone is None else self._alone.recording.baked

    @property
    def shown(self) -> Sequence[str]:
        return [] if self._alone is None else self._alone.recording.shown

    @property
    def shares(self) -> Sequence[str]:
        return [] if self._alone is None else self._alone.recording.shares

    @property
    def lobes(self) -> Sequence[Sequence[int]]:
        return [] if self._alone is None else self._alone.interfaces

    @property
    def _alone(self) -> PartCode | None:
        """The stack, unless it is in a mixture."""
        return None if self.parts[0].parts else self.parts[0]

    @cached_property
    def key(self) -> str:
        """Equal for equal code."""
        looked_up = [part.recording.baked for part in self.parts]
        tapes = [baked.tape if baked else None for baked in looked_up]
        return hashlib.sha256(f"{self.text}{tapes}".encode()).hexdigest()[:16]


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

    A mixture has functions of its parts, shared by those whose stacks are of the same kinds, and functions that weigh
    them.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name). Its kinds of layers make the code; its
            values go into `vt_material`, which gives them.
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
    material, chosen, general = load(stack), named(model, **switches), values == "uniforms"
    check_constant(material, constant)
    parts = [PartCode.of(path, leaf, chosen, constant, printer, general, baking) for path, leaf in material.leaves()]
    mixture = Mixture.of(material, parts, constant) if isinstance(material, Mix) else None
    own = mixture.own if mixture else parts

    # Put together what their code reads
    symbols = [symbol for part in own for symbol in part.recording.symbols]
    looked_up = {symbol.detail for symbol in symbols if symbol.op in ("texels", "value")}
    layouts = atlas.layouts(looked_up, atlas.every() if shared else None)
    tables = {name: table for part in own for name, table in sorted(part.films.items())}
    placed = films.layouts(tables)
    lines = [0, *accumulate(part.lines for part in own)]
    read = {name for part in parts for name in part.read}.union(mixture.weights if mixture else ())
    changing = [array for part in parts for array in part.parameters]
    filled = contents(material, read, bool(changing))
    costs = mixture.costs if mixture else parts[0].costs

    # Print
    name = "A material" if changing else remark(title(material))
    models = " and ".join(dict.fromkeys(described(part.recording.model) for part in parts))
    texts = [
        printer.header(name, models, not read, costs),
        *(part.named(part.values) for part in own),
        *([printer.structs([mixture.values])] if mixture else []),
        *([printer.parameters(changing)] if changing else []),
        printer.material(filled),
        *(part.named(part.lobes) for part in own),
        *([printer.structs([mixture.lobes])] if mixture else []),
        *([printer.tables(layouts)] if layouts else []),
        *([printer.baked_texture(max(part.width for part in own), lines[-1])] if lines[-1] else []),
        *(part.named(part.lookup(first)) for part, first in zip(own, lines) if part.lines),
        *([printer.films(placed)] if placed else []),
        printer.helpers({(symbol.op, symbol.kind) for symbol in symbols}),
        *(part.named(part.functions) for part in own),
        *([printer.mixture(mixture.members)] if mixture else []),
    ]
    return Shader(
        text=prefixed("\n".join(texts), prefix),
        looked_up=[layout.name for layout in layouts],
        uniforms={name: place for part in parts for name, place in part.uniforms.items()}
        | {name: name for name in (mixture.weights if mixture else ())},
        maps={prefixed(name, prefix): image for name, image in filled.samplers.items()},
        parts=parts,
        lines=[lines[k] for k in (mixture.functions if mixture else [0])],
        columns=stacked([part.columns for part in own if part.columns is not None]),
        film_tables=[layout.name for layout in placed],
        films=films.texture(tables),
        costs={prefixed(name, prefix): cost for name, cost in costs.items()},
        shared=shared,
    )


def prefixed(text: str, prefix: str) -> str:
    """Code whose own names begin with a prefix."""
    words = "".join(word[:1].upper() + word[1:] for word in prefix.split("_"))
    names = {"vt_": f"{prefix}_", "Vt": words, "VT_": f"{prefix.upper()}_"}
    return text if prefix == PREFIX else _NAME.sub(lambda found: names[found[1]], text)


def described(model: Model) -> str:
    """The name of a model, with the switches that were changed."""
    shipped = named(model.name)
    changed = [f"{key}={getattr(model, key)}" for key in SWITCHES if getattr(model, key) != getattr(shipped, key)]
    changed += ["in closed form"] if model.closed_form and not shipped.closed_form else []
    return " ".join([model.name, *([f"({', '.join(changed)})"] if changed else [])])
