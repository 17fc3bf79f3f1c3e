"""The verb `export`: a material for other programs, with what is lost and what lies beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura import exports
from velatura.editor.messages import Answer, Body, Verb, array, field, material_of, model_of
from velatura.imports import FORMATS
from velatura.programs import BAKED

SHARED = "velatura.tables.bin"  # the file of tables that several exports share
PAGES = {f"page-{kind}": f".{kind}" for kind in ("png", "svg", "pdf")}  # a material on one page, and the file's ending
_PASSED = ("prefix", "group", "binding", "baked", "half")  # options that are handed on as they are


def formats() -> list[Answer]:
    """The formats of text, as the page offers them: the options that each takes, the ending of its files, and whether
    `import` reads what is fitted for it. Then those of a picture."""
    known = {name: format for name, format in exports.FORMATS.items() if format.is_text}
    texts = [
        {
            "name": name,
            "options": sorted(format.options),
            "ending": format.endings[0],
            "read": name in BAKED and format.endings[0] in FORMATS,
        }
        for name, format in known.items()
    ]
    return [*texts, *({"name": name, "options": [], "ending": ending, "read": False} for name, ending in PAGES.items())]


def export(body: Body) -> Answer:
    """A material for other programs: the text and its first ending, what lies `beside` it by ending and `apart` by
    name, what calls of its functions cost, the `loss` by angle, what is `left`, other `notes`, and the facts as JSON.

    Values are worked in where they are `fixed` and the format allows that; with `tables`, all lie in one file; `file`
    is how the text will be called, for the facts. Of a material on one page, the `picture` and its ending alone.
    """
    to = field(body, "to", str)
    if to in PAGES:
        from velatura import overview  # it loads SciPy

        ending = PAGES[to]
        drawn = overview.page(material_of(body), ending.removeprefix("."), model_of(body))
        return {"picture": _packed({ending: drawn})[ending], "ending": ending}
    options: dict[str, Any] = {key: body[key] for key in _PASSED if body.get(key) not in (None, False)}
    constant = ["all"] if body.get("fixed") and to in exports.taking("constant") else []
    tables = Path(SHARED) if body.get("tables") else None
    made = exports.export(
        material_of(body), to, model_of(body), constant=constant, tables=tables, folder=Path.cwd(), **options
    )
    ending = exports.FORMATS[to].endings[0]
    facts = made.described(Path(field(body, "file", str, f"material{ending}"))) if made.facts else ""
    return {
        "text": made.text,
        "ending": ending,
        "beside": _packed(made.beside),
        "apart": _packed({path.name: data for path, data in made.apart.items()}),
        "costs": made.costs,
        "loss": made.facts.get("loss", []),
        "left": made.facts.get("left_out", []),
        "notes": [] if made.facts.get("loss") else list(made.notes),
        "facts": facts,
    }


def _packed(files: Mapping[str, bytes]) -> Answer:
    return {name: array(np.frombuffer(data, np.uint8), "uint8") for name, data in files.items()}


#: What `service.VERBS` takes over.
VERBS: dict[str, Verb] = {"export": export}
