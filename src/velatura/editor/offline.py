"""The editor as a folder of files that any web server can host: the page, and the answers that it needs of Python.

Answers are those of the verbs of `velatura.editor.service`, worked out once, each in a file of `packing.py`. Shaders
are those of all orders of a few layers, in closed form, whose values the page sets; presets lie there solved as well,
with tables by which the page interpolates about them (`tabulated.py`). The page finds them by `page/offline.js`.
"""

from __future__ import annotations

import functools
import gc
import itertools
import multiprocessing
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

from velatura import files
from velatura.editor import bundle, tabulated
from velatura.editor.messages import Answer, document
from velatura.editor.packing import numbered, packed
from velatura.editor.service import ENVIRONMENTS, VERBS
from velatura.editor.shading import in_closed_form, pattern
from velatura.errors import InvalidInput
from velatura.exports.request import headed
from velatura.model import MODELS, Model, named
from velatura.scenes.objects import OBJECTS
from velatura.shader import shader
from velatura.stack import Stack, preset, presets
from velatura.stack.layers import KINDS

LAYERS = 4  # of a material, at most
DATA = "data"  # the folder of answers
SESSION = f"{DATA}/session.pack"  # by which a folder is known to be one of these
WORTH = 80  # tasks of a process

#: What the page is told in its text: where answers lie.
_MARK = '<html lang="en">', f'<html lang="en" data-answers="{DATA}/">'


class Made(NamedTuple):
    """Contents of files, by their places in the folder; the names of tables that shaders in them look up; and the names
    of a model and of an order of layers, with the shaders of both: that which is drawn, and that which is exported."""

    contents: dict[str, bytes]
    looked_up: frozenset[str] = frozenset()
    shaders: tuple[str, str, Answer, Answer] | None = None


class Order(NamedTuple):
    """Kinds of layers from the top, whether interfaces are brushed, and whether all is a thin pane."""

    kinds: tuple[str, ...]
    brushed: bool = False
    thin: bool = False

    @property
    def name(self) -> str:
        """The name by which the page asks for it."""
        return "-".join([*self.kinds, *(["brushed"] if self.brushed else []), *(["thin"] if self.thin else [])])

    @property
    def stack(self) -> Stack:
        """One with values. Raises InvalidInput where layers cannot lie in this order."""
        return Stack.from_dict({"layers": [_EXAMPLES.get(kind, {kind: {}}) for kind in self.kinds], "thin": self.thin})

    @classmethod
    def of(cls, stack: Stack) -> Order:
        brushed = any(isinstance(layer.alpha, tuple) for layer in stack.interfaces)
        return cls(stack.kinds, brushed, stack.thin)


_EXAMPLES: dict[str, Answer] = {  # of kinds that are not written by their own name
    "dielectric": {"interface": {"eta": 1.5}},
    "conductor": {"interface": {"eta": 1.5, "k": 1.0}},
    "mirror": {"interface": {"conductor": "mirror"}},
}


def write(
    folder: str | Path,
    progress: Callable[[int, int], None] | None = None,
    layers: int = LAYERS,
    models: Sequence[Model] = MODELS,
) -> dict[str, int]:
    """Write the editor to a folder, which is made unless it is there.

    Args:
        folder: a new folder, an empty one, or one that was written by this function, which is replaced.
        progress: called with (steps done, all steps) now and then.
        layers: of a material, at most, unless it has the layers of a preset.
        models: those that materials are shown by.

    Returns:
        The size of every file, in bytes, by its place in the folder.

    Raises:
        InvalidInput: the folder has other files in it, or cannot be written; nothing has been changed.
        MissingTool: the page is missing.
    """
    page, place = bundle.require(), Path(folder)
    _check(place)
    existed = place.is_dir()
    try:
        place.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".velatura-", dir=place, ignore_cleanup_errors=True) as unfinished:
            sizes = _write(page, Path(unfinished), progress, layers, models)
            for made in sorted(Path(unfinished).iterdir()):
                _replace(made, place / made.name)
    except OSError as error:
        raise InvalidInput(f"{place}: cannot be written: {files.reason(error)}") from None
    finally:
        if not existed and place.is_dir() and not any(place.iterdir()):
            place.rmdir()
    return sizes


def _check(folder: Path) -> None:
    """Raise InvalidInput where the page cannot go to a folder."""
    if not folder.parent.is_dir():
        raise InvalidInput(f"{folder}: there is no folder {folder.parent}")
    if folder.exists() and not folder.is_dir():
        raise InvalidInput(f"{folder}: is a file; name a new folder, or an empty one")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / SESSION).is_file():
        raise InvalidInput(f"{folder}: holds other files; name a new folder, or an empty one")


def _replace(made: Path, place: Path) -> None:
    if place.is_dir():
        shutil.rmtree(place)
    os.replace(made, place)


def _write(
    page: Path, folder: Path, progress: Callable[[int, int], None] | None, layers: int, models: Sequence[Model]
) -> dict[str, int]:
    sizes: dict[str, int] = {}

    def put(contents: Mapping[str, bytes]) -> None:
        for name, data in contents.items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            sizes[name] = len(data)

    # The page
    for path in sorted(page.rglob("*")):
        if path.is_file() and path.suffix != ".map" and not path.name.startswith("widget."):
            put({path.relative_to(page).as_posix(): path.read_bytes()})
    put({"index.html": (page / "index.html").read_text("utf-8").replace(*_MARK).encode()})

    # Answers
    refusals = _refusals(layers)
    put(_common(refusals, models))
    tasks = _tasks([order for order, refusal in refusals.items() if not refusal], models)
    looked_up = set[str]()
    lines: dict[str, dict[str, dict[str, int]]] = {
        kind: {model.name: {} for model in models} for kind in ("drawn", "glsl")
    }
    exported: dict[str, dict[str, Answer]] = {model.name: {} for model in models}
    for done, made in enumerate(_all_made(tasks), 1):
        put(made.contents)
        looked_up |= made.looked_up
        if made.shaders:
            model, order, drawn, written = made.shaders
            by_lines = {**drawn, "text": numbered(drawn["text"], lines["drawn"][model])}
            put({f"{DATA}/shader/{model}/{order}.pack": packed(by_lines)})
            exported[model][order] = {**written, "text": numbered(written["text"], lines["glsl"][model])}
        if progress:
            progress(done, len(tasks))
    for model, texts in exported.items():
        put({f"{DATA}/lines/{model}.pack": packed(list(lines["drawn"][model]))})
        put({f"{DATA}/glsl/{model}.pack": packed({"lines": list(lines["glsl"][model]), "texts": texts})})
    put(_tables(looked_up))
    return sizes


def _tasks(plain: Sequence[Order], models: Sequence[Model]) -> list[Callable[[], Made]]:
    brushed = [order._replace(brushed=True) for order in plain if order.stack.interfaces]
    solved = [model.name for model in models if model.surrogate is not model]
    coated = [name for name in presets(mixtures=False) if any(layer.films for layer in preset(name).interfaces)]
    return [
        *(functools.partial(_coated, model, name) for model in models for name in coated),
        *(functools.partial(_shader, model.name, order) for model in models for order in [*plain, *brushed]),
        *(functools.partial(_solved, model, name) for model in solved for name in presets(mixtures=False)),
        *(functools.partial(_tabulated, model, name) for model in solved for name in presets(mixtures=False)),
    ]


def _all_made(tasks: Sequence[Callable[[], Made]]) -> Iterator[Made]:
    """Make all in as many processes as are worth their start."""
    processes = min(os.cpu_count() or 1, len(tasks) // WORTH)
    if processes < 2:
        yield from map(_made, tasks)
        return
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(_made, tasks, chunksize=8)


def _made(task: Callable[[], Made]) -> Made:
    # All objects of a recording live to its end: searches for garbage among them take as long as all else
    gc.disable()
    try:
        return task()
    finally:
        gc.enable()


# Answers -------------------------------------------------------------------------------------------------------------


def _common(refusals: Mapping[Order, str], models: Sequence[Model]) -> dict[str, bytes]:
    """The answers that do not depend on a material."""
    begun = VERBS["session"]({})
    names = [model.name for model in models]
    environments = [{**each, "url": each["url"] and each["url"].lstrip("/")} for each in begun["environments"]]
    offered = {
        "models": [each for each in begun["models"] if each["name"] in names],
        "environments": environments,
        "presets": [_followed(each) for each in begun["presets"] if "mix" not in each["material"]],
        "orders": {order.name: refusal for order, refusal in refusals.items()},
    }
    objects = {f"{DATA}/object/{name}.pack": packed(VERBS["object"]({"name": name})) for name in OBJECTS}
    lights = {f"{DATA}/environment/{name}.pack": packed(VERBS["environment"]({"name": name})) for name in ENVIRONMENTS}
    return {SESSION: packed({**begun, **offered}), **objects, **lights}


def _followed(known: Answer) -> Answer:
    """A preset of the session, with the flat names of values that its table follows."""
    along = tabulated.axes(preset(known["name"])) if known["name"] in presets(mixtures=False) else []
    return {**known, "followed": sorted({name for axis in along for name in axis.names})}


def _refusals(layers: int) -> dict[Order, str]:
    """Every order of so many layers, or of a preset, and why they cannot lie in it; empty where they can."""
    words = [word for count in range(1, layers + 1) for word in itertools.product(KINDS, repeat=count)]
    every = [order for word in words for order in (Order(word), Order(word, thin=True))]
    own = (Order.of(preset(name))._replace(brushed=False) for name in presets(mixtures=False))
    return {order: _refusal(order) for order in dict.fromkeys([*every, *own])}


def _refusal(order: Order) -> str:
    try:
        _ = order.stack
    except InvalidInput as error:
        return str(error)
    return ""


def _shader(model: str, order: Order) -> Made:
    """The shaders of an order of layers in closed form: that which the page draws, and that which it exports."""
    chosen, stack = named(model), order.stack
    drawn = in_closed_form(stack, chosen, order.brushed)
    written = shader(pattern(stack, [order.brushed]), chosen.surrogate)
    costs = {name: str(cost) for name, cost in written.costs.items()}
    exported = {"text": headed(written.text), "tables": ",".join(written.looked_up) or None, "costs": costs}
    names = [*written.looked_up, *_looked_up(drawn)]
    return Made(
        {},
        frozenset(filter(None, names)),
        (model, order.name, drawn, exported),
    )


def _looked_up(drawn: Answer) -> list[str]:
    """The names of tables that the shader of a stack, or what works out its lobes, looks up."""
    (stack,) = drawn["parts"]
    return [*(drawn["tables"] or "").split(","), *(stack["baked"] or {}).get("tables", [])]


def _solved(model: str, name: str) -> Made:
    """A preset as it is solved."""
    answer = VERBS["shader"]({"material": document(preset(name)), "model": model})
    return Made({f"{DATA}/solved/{model}/{name}.pack": packed(answer)})


def _tabulated(model: str, name: str) -> Made:
    """The table by which the page interpolates about a preset."""
    return Made({f"{DATA}/tabulated/{model}/{name}.pack": packed(tabulated.tabulated(preset(name), named(model)))})


def _coated(model: Model, name: str) -> Made:
    """A preset with thin films in closed form, for other values of all that its films do not depend on."""
    found: dict[str, bytes] = {}
    looked_up = set[str]()
    for brushed in (False, True):
        place = f"{DATA}/films/{model.name}/{name}{'-brushed' * brushed}.pack"
        try:
            drawn = in_closed_form(preset(name), model, brushed)
        except InvalidInput as error:
            found[place] = packed({"refused": str(error)})
            continue
        found[place] = packed(drawn)
        looked_up |= {*_looked_up(drawn)} - {""}
    return Made(found, frozenset(looked_up))


def _tables(names: Iterable[str]) -> dict[str, bytes]:
    return {f"{DATA}/table/{name}.pack": packed(VERBS["table"]({"name": name})) for name in names}
