"""A Sphinx extension: insert the program's own help and numbers into the manual, so that the two cannot disagree.

`<!-- parameters -->` becomes the table of a material's parameters, `<!-- help VERB -->` the output of
`velatura VERB --help`, `<!-- presets -->` a card for each preset, `<!-- substances -->` the table of the pages of
refractiveindex.info that come with the package, `<!-- retrieved MODEL -->` that of the layers that the inverse
retrieves by a model for the figures of Bati et al. 2021, each with a link to its file.

`{{belcour2018-13: rmse/forward}}` becomes a number of `docs/figures/belcour2018-13.json`, which `make figures`
computes. After the figure's name stand the keys that lead to the number; an item of a list has an index or its name. A
number with a standard error (`x` beside `x_error`) is printed with it, others to three places, or to as many as ` to 2`
asks for; text stands as it is. Numbers of a page's own lie beside it, as `docs/explanation/validation.json`.

`<!-- table validation: media/truths -->` becomes a table of such a list, a row for each item, to two digits.

A link to a script in `docs/examples` becomes one to its page in the gallery, where it stands with its picture.

Records of a material's parameters (`Interface`, ...) are shown with the signature and the ranges that they declare.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib import import_module
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "velatura"
DOCS = ROOT / "docs"
NUMBERS = (DOCS / "figures", DOCS / "explanation")  # folders
PLACES = 3  # after the point

EXAMPLES = (
    "first_render",
    "one_look",
    "lobes",
    "compare",
    "coat_law",
    "films",
    "brushed",
    "textured",
    "glass",
    "phases",
    "pigments",
    "polarised",
    "polariser",
    "exact",
    "inverse",
    "wishes",
    "fit",
    "simplify",
    "recover",
    "recover_texture",
    "coats",
    "export_wgsl",
    "bake",
    "openpbr",
)  # in the order of the gallery


class ExampleOrder:
    """A key that sorts scripts as `EXAMPLES` lists them. Raises ValueError where one is missing there."""

    def __init__(self, folder: str) -> None:
        pass

    def __call__(self, script: str) -> int:
        return EXAMPLES.index(Path(script).stem)


def setup(app: Any) -> dict[str, bool]:
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("builder-inited", _forget_old_examples, priority=100)  # before the gallery
    app.connect("builder-inited", forget_old_pages, priority=100)  # before autosummary
    app.connect("builder-inited", _write_retrieved)
    app.connect("source-read", _on_source_read)
    app.connect("autodoc-process-signature", _on_signature)
    app.connect("autodoc-process-docstring", _on_docstring)
    app.add_lexer("csv", import_module("pygments.lexers.special").TextLexer)  # Pygments has none of its own
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _on_source_read(app: Any, page: str, source: list[str]) -> None:
    if app.env.doc2path(page).suffix == ".md":
        written = replaced(source[0])
        if written != source[0]:
            app.env.note_reread()  # what is inserted does not come from the page alone
        source[0] = written


def _forget_old_examples(app: Any) -> None:
    """Remove the gallery where the package has changed, so that pictures are those of its sources."""
    digest = hashlib.sha256()
    for path in sorted(path for kind in ("py", "yaml", "npz") for path in PACKAGE.rglob(f"*.{kind}")):
        digest.update(path.read_bytes())
    gallery = DOCS / "gallery"
    stamp = gallery / "sources.sha256"
    if not stamp.exists() or stamp.read_text() != digest.hexdigest():
        shutil.rmtree(gallery, ignore_errors=True)
        gallery.mkdir()
        stamp.write_text(digest.hexdigest())


def forget_old_pages(app: Any) -> None:
    """Remove generated pages of names that the reference no longer lists: one outside every table of contents ends a
    strict build."""
    reference = DOCS / "reference"
    listed = re.findall(r"^   (velatura\.\S+)$", (reference / "api.rst").read_text(), re.MULTILINE)
    for page in (reference / "api").glob("*.rst"):
        if page.stem not in listed:
            page.unlink()


def _on_signature(app: Any, what: str, name: str, item: Any, *_: Any) -> tuple[str, str] | None:
    if not _is_record(item):
        return None
    fields = (
        f"{key}{'' if field.is_required() else f'={field.default!r}'}" for key, field in item.model_fields.items()
    )
    return f"(*, {', '.join(fields)})", ""


def _on_docstring(app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    if _is_record(item):
        from velatura.stack.schema import parameters

        lines += ["", "Args:", *(f"    {key}: {_described(each)}" for key, each in parameters(item).items())]


def _is_record(item: Any) -> bool:
    from velatura.stack.schema import Record

    return isinstance(item, type) and issubclass(item, Record)


def _described(parameter: Any) -> str:
    """The meaning of a parameter, and in brackets its range and unit."""
    range_and_unit = " ".join(text for text in (parameter.bounds, parameter.unit) if text)
    return f"{parameter.doc} ({range_and_unit})" if range_and_unit else parameter.doc


def replaced(markdown: str) -> str:
    """A page with its placeholders replaced."""
    markdown = re.sub(r"<!-- parameters -->", lambda _: _parameters(), markdown)
    markdown = re.sub(r"<!-- presets -->", lambda _: _presets(), markdown)
    markdown = re.sub(r"<!-- substances -->", lambda _: _substances(), markdown)
    markdown = re.sub(r"<!-- retrieved (\w+) -->", lambda match: _retrieved(match[1]), markdown)
    markdown = re.sub(r"<!-- table (.*?): (.*?) -->", lambda match: _table(*match.groups()), markdown)
    markdown = re.sub(r"\{\{(.*?)\}\}", lambda match: _number(match[1]), markdown)
    markdown = re.sub(r"\]\(((?:\.\./)*)examples/(\w+)\.py\)", r"](\1gallery/\2.rst)", markdown)
    return re.sub(r"<!-- help((?: \w+)*) -->", lambda match: _help(match[1].split()), markdown)


def _parameters() -> str:
    from velatura.stack import parameter_table

    return parameter_table()


def _presets() -> str:
    """A grid of cards: picture, file, lobes of light along the normal, and distance from the truth."""
    import velatura as vt

    distances = json.loads((DOCS / "reference" / "presets.json").read_text())
    cards = (_card(name, vt.preset(name), distances[name]) for name in vt.presets())
    return "\n".join(["::::{grid} 1 2 3 4", ":gutter: 3", "", *cards, "::::"])


def _substances() -> str:
    from velatura.cli.substances import pages

    rows = ["| page | substance | range (nm) | metal | source |", "|---|---|---|---|---|"]
    for row in pages():
        low, high = row["range_nm"]
        cells = (f"`{row['name']}`", row["substance"], f"{low:.0f} to {high:.0f}", row["colour"] or "", row["source"])
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def _write_retrieved(app: Any) -> None:
    """Write the files that `_retrieved` links to."""
    from velatura.stack import save

    folder = DOCS / "reference" / "retrieved"
    folder.mkdir(exist_ok=True)
    for model in ("bati2021", "velatura"):
        for name, stack in retrieved(model).items():
            save(stack, folder / _retrieved_file(name, model))


@cache
def retrieved(model: str) -> dict[str, Any]:
    """The stacks of Bati et al. 2021 by figure: as the figures drew them, or those of the default model."""
    from velatura.figures.bati2021_targets import FIGURES
    from velatura.inverse import invert_stack
    from velatura.stack import Stack

    if model != "bati2021":
        return {name: invert_stack(lobes, model).stack for name, lobes in FIGURES.items()}
    found = {}
    for path in sorted((DOCS / "figures").glob("bati2021-*.json")):
        numbers, number = _figure(path.stem), str(int(path.stem[-2:]))
        looks = numbers.get("looks") or [
            {"name": key, **each} for key, each in numbers.items() if isinstance(each, dict) and "stack" in each
        ]
        for look in looks:
            name = look["name"] if look["name"].split()[0] == number else f"{number} {look['name']}"
            found[name] = Stack.from_dict(look["stack"])
    return found


def _retrieved(model: str) -> str:
    rows = ["| figure | layers | file |", "|---|---|---|"]
    for name, stack in retrieved(model).items():
        layers = "; ".join(filter(None, (_layer(layer) for layer in stack.layers)))
        file = _retrieved_file(name, model)
        rows.append(f"| {name} | {layers} | [{file}](retrieved/{file}) |")
    return "\n".join(rows)


def _retrieved_file(name: str, model: str) -> str:
    """The name of a file: letters, digits and hyphens."""
    return f"{'-'.join(re.findall('[a-z0-9]+', name.lower()))}-{model}.yaml"


def _layer(layer: Any) -> str:
    """The values of a layer, as a figure of the paper has them."""

    def written(value: Any) -> str:
        values = value if isinstance(value, (list, tuple)) else [value]
        return " ".join(f"{each:.4g}" for each in values)

    values = layer.to_dict()
    if layer.kind == "medium":
        depth = [float(each) * layer.depth for each in np.atleast_1d(layer.sigma_a)]
        return f"depth {written(depth)}" if any(depth) else ""
    if layer.kind == "diffuse":
        return f"diffuse {written(layer.albedo)}"
    return ", ".join(f"{key} {written(values[key])}" for key in ("eta", "k", "alpha") if key in values)


def _card(name: str, material: Any, distance: dict[str, float]) -> str:
    import velatura as vt
    from velatura.programs.textures import means

    whole = material.replace(**means(material)) if isinstance(material, vt.Mix) else material
    lobes: list[str] = []
    for share, stack in whole.weighted("a card has no textures"):
        where = f"{stack.name}, on {100 * share:.0f} %: " if isinstance(material, vt.Mix) else ""
        lobes += [where + each for each in _lobes(stack)]
    return f"""\
:::{{grid-item-card}} {material.name}
:img-top: ../../src/velatura/editor/page/thumbnails/{name}.jpg
:img-alt: The preset {name} on the material ball

[`{name}`](../../src/velatura/stack/presets/{name}.yaml)

{chr(10).join(f"- {lobe}" for lobe in lobes)}

Total variation {_written(distance["total_variation"], 3)} (noise {_written(distance["noise"], 3)}), albedo within
{_written(distance["albedo"], 3)}
:::"""


def _lobes(stack: Any) -> list[str]:
    """Each lobe of a stack, and what is in none, for light along the normal."""
    import velatura as vt

    found = vt.lobes(stack, 1.0)
    kinds = [kind for kind in stack.kinds if kind not in ("medium", "diffuse")]
    lobes = [f"{kind}: {_energy(e)}, α {_alphas(a)}" for kind, e, a in zip(kinds, found.energy, found.alpha)]
    if found.transmitted is not None:
        lobes.append(f"passed: {_energy(found.transmitted.energy)}, α {_alphas(found.transmitted.alpha)}")
    return [*lobes, f"in no lobe: {_energy(found.remainder)}"]


def _energy(energy: Any) -> str:
    return f"{100 * energy.mean():.0f} %"


def _alphas(alpha: Any) -> str:
    """Roughness along both axes, once where they agree."""
    return " by ".join(dict.fromkeys(_written(float(a), 2) for a in alpha[:, 0]))


def _help(verb: list[str]) -> str:
    command = [sys.executable, "-m", "velatura", *verb, "--help"]
    run = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, "COLUMNS": "100"})
    return f"```text\n{run.stdout.rstrip()}\n```"


def _number(placeholder: str) -> str:
    """The number that a placeholder stands for. Raises LookupError where no figure has that number."""
    match = re.fullmatch(r"([a-z0-9-]+): (.+?)(?: to (\d))?", placeholder)
    if not match:
        raise LookupError(f"{{{{{placeholder}}}}} is none of the manual's placeholders")
    name, path, places = match[1], match[2].split("/"), int(match[3] or PLACES)
    try:
        value, error = _found(name, path)
    except (OSError, LookupError, TypeError) as missing:
        raise LookupError(f"{{{{{placeholder}}}}}: docs/figures/{name}.json has no such number") from missing
    return _written(value, places) if error is None else _with_error(value, error)


@cache
def _figure(name: str) -> Any:
    paths = [folder / f"{name}.json" for folder in NUMBERS]
    return json.loads(next((path for path in paths if path.is_file()), paths[0]).read_text())


def _table(name: str, path: str) -> str:
    """A table of a list of items, headed by their keys."""
    items, _ = _found(name, path.split("/"))
    titles = ["" if key == "name" else key.replace("_", " ") for key in items[0]]
    rows = [[_cell(value) for value in item.values()] for item in items]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (titles, ["---"] * len(titles), *rows))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.0f}" if abs(value) >= 100 else re.sub(r"^0\.", ".", f"{value:.2g}")


def _found(name: str, path: list[str]) -> tuple[Any, Any]:
    """The value that the keys of a figure lead to, and its standard error or None."""
    value, error = _figure(name), None
    for key in path:
        if error is not None:
            error = _item(error, key)
        elif isinstance(value, dict):
            error = value.get(f"{key}_error")
        value = _item(value, key)
    return value, error


def _item(found: Any, key: str) -> Any:
    if isinstance(found, list):
        return found[int(key)] if key.isdigit() else {item["name"]: item for item in found}[key]
    return found[key]


def _written(value: Any, places: int) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        return ", ".join(_written(item, places) for item in value)
    return re.sub(r"^(-?)0\.", r"\1.", f"{round(value, places) + 0.0:.{places}f}")  # no -.000


def _with_error(value: float, error: float) -> str:
    """Both to the first digit of the standard error, or to the second where the first is 1."""
    first = floor(log10(error)) if error > 0 else -PLACES
    places = max((1 if error >= 2 * 10**first else 2) - 1 - first, 0)
    return f"{_written(value, places)} ± {_written(error, places)}"
