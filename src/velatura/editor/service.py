"""The calls of the page: parameters and presets, the shader of a material, an object, a text.

Every verb is a function of a mapping to a mapping, both of JSON's types. Textures in a material are relative to the
working directory. All errors that a user can make are InvalidInput.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pydantic.fields import FieldInfo

from velatura import kernel
from velatura.editor import appearance, class_maps, exporting, films, truth, validations, views, wishes
from velatura.editor.messages import (
    Answer,
    Body,
    Verb,
    admitting,
    array,
    document,
    field,
    material_of,
    model_of,
    to_write,
)
from velatura.editor.shading import contents, shading
from velatura.editor.shading import tables as kept_tables
from velatura.errors import InvalidInput
from velatura.model import DEFAULT, MODELS, SWITCHES, Model
from velatura.scenes.denoise import can_denoise
from velatura.scenes.environments import PHOTOGRAPHS, sky, studio
from velatura.scenes.objects import OBJECTS, ground, plinth
from velatura.scenes.surfaces import Mesh
from velatura.stack import (
    Described,
    Mix,
    Named,
    Part,
    Stack,
    Substance,
    Texture,
    dumps,
    loads,
    names,
    phases,
    preset,
    presets,
    rgb,
    substances,
)
from velatura.stack.layers import LAYERS, LayerRecord, has
from velatura.stack.phases import Phase
from velatura.stack.pigments import CoefficientOf, Pigment, Pigments
from velatura.stack.schema import Parameter, Record, parameters, unknown
from velatura.stack.spectra import MIRROR
from velatura.stack.values import (
    Angle,
    Brushing,
    Choice,
    Colour,
    Conductor,
    Film,
    Films,
    Flag,
    Index,
    Pair,
    Scalar,
    Text,
)
from velatura.tables import load as load_tables
from velatura.version import __version__

#: The control of the page for each type of parameter.
KINDS: dict[type[Parameter], str] = {
    Scalar: "number",
    Colour: "colour",
    Index: "index",
    Pair: "pair",
    Angle: "angle",
    Choice: "choice",
    Films: "films",
    Conductor: "choice",
    Phase: "phase",
    Pigments: "pigments",
    CoefficientOf: "colour",
    Flag: "flag",
    Text: "text",
}

#: Pictures of light that need no file.
ENVIRONMENTS: dict[str, Callable[[], ArrayLike]] = {
    "studio": studio,
    "sky": kernel.exclusive(sky),
    "furnace": lambda: np.ones((2, 4, 3), np.float32),
}

#: Photographs by their addresses on the server.
FILES = {f"/environments/{path.name}": path for path in PHOTOGRAPHS.values()}


# Verbs ---------------------------------------------------------------------------------------------------------------


def session(body: Body) -> Answer:
    """The initial data of the page; nothing is `opened` yet."""
    return {**_constants(), "presets": _presets(Path.cwd()), "opened": None}


@functools.cache
def _constants() -> Answer:
    environments = [(name, None) for name in ENVIRONMENTS] + [(path.stem, url) for url, path in FILES.items()]
    return {
        "version": __version__,
        "schema": {where: _keys(model) for where, model in _RECORDS.items()},
        "layers": {name: _layer(layer) for name, layer in LAYERS.items()},
        "models": [_model(model) for model in MODELS],
        "default_model": DEFAULT,
        "formats": exporting.formats(),
        "denoises": can_denoise(),
        "names": _names(),
        "objects": list(OBJECTS),
        "views": views.views(),
        "environments": [{"name": name, "title": _titled(name), "url": url} for name, url in environments],
    }


_RECORDS: dict[str, type[Record]] = {
    "material": Stack,
    "part": Part,
    **LAYERS,
    "film": Film,
    "pigment": Pigment,
    "texture": Texture,
    "brushing": Brushing,
    **phases.RECORDS,
}


def _keys(model: type[Record]) -> Answer:
    """The declared parameters of a layer, or of the whole material."""
    return {
        key: _parameter(declared, model.model_fields[key])
        for key, declared in parameters(model).items()
        if type(declared) in KINDS
    }


def _parameter(declared: Parameter, place: FieldInfo) -> Answer:
    """One parameter as its control needs it; None stands for no default."""
    known: Answer = {"kind": KINDS[type(declared)], "unit": declared.unit, "doc": declared.doc}
    known |= {"default": None if place.is_required() else place.default, "texturable": declared.texturable}
    if isinstance(declared, Scalar):
        known |= {"low": declared.low, "high": declared.high, "strict": declared.strict}
    if isinstance(declared, Films | Pigments):
        known["most"] = declared.most
    if isinstance(declared, Choice):
        known["options"] = declared.options
    if isinstance(declared, Conductor):
        known["options"] = (MIRROR, *names()[0])
    return known


def _layer(layer: type[LayerRecord]) -> Answer:
    """A kind of layer: its title, and the keys of a new one."""
    declared = has(next(iter(layer.lacks))).items()
    typical = {key: each.typical for key, each in declared if isinstance(each, Scalar) and each.typical is not None}
    return {"title": layer.title, "fresh": {**typical, **layer.fresh}}


def _titled(name: str) -> str:
    """A name as a heading: `belcour2018` as Belcour 2018."""
    words = re.sub(r"(?<=\D)(?=\d)|[-_]", " ", name)
    return words[:1].upper() + words[1:]


@functools.lru_cache(1)
def _presets(folder: Path) -> list[Answer]:
    """All presets, their images relative to the working directory."""
    return [_preset(name) for name in presets()]


def _preset(name: str) -> Answer:
    material: Described = preset(name)
    group = "Mixture" if isinstance(material, Mix) else _group(material)
    return {"name": name, "title": material.name or _titled(name), "group": group, "material": document(material)}


def _group(stack: Stack) -> str:
    return "Glass" if stack.transmits else "Paint" if stack.base else "Metal"


def _model(model: Model) -> Answer:
    return {
        "name": model.name,
        "title": _titled(model.name),
        "switches": {switch: model.allowed(switch) for switch in SWITCHES},
        "defaults": {switch: getattr(model, switch) for switch in SWITCHES},
    }


def _names() -> Answer:
    """Named indices as RGB, and those of the pages of refractiveindex.info that come with the package."""
    conductors, dielectrics = names()
    return {
        "dielectrics": {name: rgb(Named(name, "eta")) for name in dielectrics},
        "conductors": {name: {"eta": rgb(Named(name, "eta")), "k": rgb(Named(name, "k"))} for name in conductors},
        "pages": {name: _page(name) for name in substances.names()},
    }


def _page(name: str) -> Answer:
    eta = Substance(refractiveindex=name)
    k = rgb(eta.of("k")) if eta.opaque else 0
    return {"title": substances.entry(name).short, "opaque": eta.opaque, "eta": rgb(eta), "k": k}


def shader(body: Body) -> Answer:
    """The data to draw a material, of `shading.shading`, with the model and its switches."""
    return shading(material_of(body), model_of(body), _stretched(body))


def values(body: Body) -> Answer:
    """The values of a material, of `shading.contents`, for code that is known; `coarse` ones while something moves."""
    return contents(material_of(body), model_of(body), _stretched(body), field(body, "coarse", bool, False))


def _stretched(body: Body) -> list[bool]:
    return [_is_stretched(stack) for stack in _written(body["material"])]


def _written(material: Answer) -> Iterator[Answer]:
    """The stacks of a material as the page has written them."""
    if "mix" not in material:
        yield material
    for part in material.get("mix", ()):
        yield from _written(part["material"])


def _is_stretched(stack: Answer) -> bool:
    written = (entry.get("interface") or {} for entry in stack["layers"])
    return any(isinstance(keys.get("alpha"), list) for keys in written)


def tables(body: Body) -> Answer:
    """The averages that a shader looks up, as texels."""
    return {"texture": array(kept_tables(field(body, "key", str)))}


def table(body: Body) -> Answer:
    """A table of averages by its name, channels on the last axis."""
    name, known = field(body, "name", str), dict(load_tables().items())
    if name not in known:
        raise InvalidInput(unknown("table", name, known))
    return {"table": array(known[name].data)}


def read(body: Body) -> Answer:
    """The material in a text, YAML or JSON; errors name the file that it was in."""
    name = field(body, "file", str, "the text")
    material = loads(field(body, "text", str), name if name.isprintable() else repr(name))
    return {"material": document(material)}


def write(body: Body) -> Answer:
    """A material as YAML, its textures relative to the working directory."""
    return {"text": dumps(to_write(body), "yaml", ".")}


def object_(body: Body) -> Answer:
    """An object with its plinth and the ground, as triangles, and its camera."""
    name = field(body, "name", str)
    if name not in OBJECTS:
        raise InvalidInput(unknown("object", name, OBJECTS))
    surfaces = {"object": OBJECTS[name].surface(), "plinth": plinth(), "ground": ground()}
    return {"parts": [_part(role, surface) for role, surface in surfaces.items()], "view": OBJECTS[name].view._asdict()}


def _part(role: str, surface: Mesh) -> Answer:
    return {
        "role": role,
        "positions": array(surface.positions),
        "normals": array(surface.normals),
        "uv": array(surface.uv),
        "triangles": array(surface.triangles, "uint32"),
    }


def environment(body: Body) -> Answer:
    """A picture of the light from all around, linear RGB, equirectangular."""
    name = field(body, "name", str)
    if name not in ENVIRONMENTS:
        raise InvalidInput(unknown("environment", name, ENVIRONMENTS))
    return {"picture": array(ENVIRONMENTS[name]())}


_VERBS: dict[str, Verb] = {
    "session": session,
    "shader": shader,
    "values": values,
    "tables": tables,
    "table": table,
    "read": read,
    "write": write,
    "object": object_,
    "environment": environment,
    **exporting.VERBS,
    **films.VERBS,
    **validations.VERBS,
    **appearance.VERBS,
    **wishes.VERBS,
    **class_maps.VERBS,
    **truth.VERBS,
}

#: Every verb by the name that the page calls it by.
VERBS: dict[str, Verb] = {name: admitting(verb) for name, verb in _VERBS.items()}
