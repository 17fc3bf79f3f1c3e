"""Scenes of Mitsuba: their `principled` BSDFs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from velatura.errors import InvalidInput, within
from velatura.programs import xml
from velatura.programs.given import Given
from velatura.programs.imported import Imported, Notes
from velatura.programs.parameters import Input
from velatura.programs.principled import read as principled
from velatura.programs.values import linear, listed
from velatura.programs.xml import Element
from velatura.stack import Texture
from velatura.stack.schema import show

_AROUND = ("twosided",)  # BSDFs that change nothing of what they hold


def materials(path: Path) -> tuple[dict[str, Callable[[Notes], Imported]], None]:
    """The `principled` BSDFs of a scene by their ids, or their numbers, each as a function that reads it; the
    file chooses none.

    Raises:
        InvalidInput: it cannot be read, or is no scene.
    """
    root = xml.read(path)
    if root.tag not in ("scene", "bsdf"):
        raise InvalidInput(f"{path}: is no scene of Mitsuba: begins with {show(root.tag)}")
    default = {each.name: each.get("value") or "" for each in root.of("default")}

    def reader(element: Element, name: str) -> Callable[[Notes], Imported]:
        def read(notes: Notes) -> Imported:
            with within(f"{path}: {name}"):
                values = _values(element, path.parent, default, notes)
                cover = _cover(element, path.parent, default, notes)
                return principled.read(values, name, notes, cover)

        return read

    found: dict[str, Callable[[Notes], Imported]] = {}
    for element in root.all():
        if element.tag == "bsdf" and element.get("type") == "principled":
            around = [each for each in element.outwards() if each.tag == "bsdf" and each.get("type") in _AROUND]
            name = next(filter(None, (each.get("id") for each in (element, *around))), f"bsdf {len(found)}")
            found[name] = reader(element, name)
    return found, None


def of_dict(described: Mapping[str, Any], notes: Notes) -> Imported:
    """The stack nearest to a `principled` as `mi.load_dict` takes it.

    Raises:
        InvalidInput: a plugin of another type, an unknown parameter, or a value of another kind.
    """
    if not isinstance(described, Mapping):
        raise InvalidInput(f"principled: must be described by keys and values, got {show(described)}")
    if described.get("type", "principled") != "principled":
        raise InvalidInput(f"type: must be principled, got {show(described['type'])}")
    values: dict[str, Any] = {}
    for name, value in described.items():
        if name not in ("type", "id"):
            values[name] = _plugin(name, value, Path(), notes) if isinstance(value, Mapping) else value
    return principled.read({name: value for name, value in values.items() if value is not None}, notes=notes)


def _cover(element: Element, folder: Path, default: Mapping[str, str], notes: Notes) -> float | Texture:
    """The share of a surface that a mask around a BSDF leaves; BSDFs of other types are noted."""
    share: float | Texture = 1.0
    for around in element.outwards():
        if around is element or around.tag != "bsdf" or around.get("type") in _AROUND:
            continue
        if around.get("type") != "mask" or share != 1:
            notes.add(f"bsdf {around.get('type')}", "", "the principled in it is read alone")
            continue
        values = {key: value for key, value in _values(around, folder, default, notes).items() if key == "opacity"}
        share = Given(values, (Input("opacity", (0.5, 0.5, 0.5)),), {}, notes).share("opacity")
    return share


def _values(element: Element, folder: Path, default: Mapping[str, str], notes: Notes) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for each in element.children:
        text = each.get("value") or ""
        text = default.get(text[1:], text) if text.startswith("$") else text
        value: Any = None
        if each.tag in ("float", "integer") or each.tag in ("rgb", "srgb", "spectrum"):
            value = _numbers(text)
        elif each.tag == "bsdf":
            continue
        elif each.tag == "texture":
            inside: dict[str, Any] = {part.name: part.get("value") for part in each.children}
            inside |= {"type": each.get("type"), "raw": inside.get("raw") == "true"}
            value = _plugin(each.name, inside, folder, notes)
            if value is None:
                continue
        if value is None:
            why = "is neither a number nor a colour nor a plain image: its default stands for it"
            notes.add(each.name or each.tag, text or each.get("id") or each.tag, why)
            continue
        values[each.name] = value
    return values


def _numbers(text: str) -> Any:
    """A number or a colour; None for other texts."""
    if re.fullmatch("#[0-9a-fA-F]{6}", text):
        return linear(np.array([int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)])).tolist()
    numbers = listed(" ".join(text.replace(",", " ").split()), " ")
    return numbers[0] if len(numbers) == 1 else numbers if len(numbers) == 3 else None


def _plugin(name: str, plugin: Mapping[str, Any], folder: Path, notes: Notes) -> Any:
    """The value of a texture's plugin; None where it is noted instead."""
    kind = plugin.get("type")
    if kind in ("rgb", "srgb", "spectrum", "uniform", "rawconstant") and "value" in plugin:
        return _numbers(plugin["value"]) if isinstance(plugin["value"], str) else plugin["value"]
    if kind == "bitmap" and isinstance(plugin.get("filename"), str | Path):
        is_colour = name == "base_color"
        if {"to_uv", "wrap_mode"} & set(plugin):
            notes.add(f"{name}: to_uv", "", "the image lies on the texture coordinates as they are")
        return Texture(
            texture=folder / plugin["filename"],
            channel="rgb" if is_colour else "r",
            encoding="linear" if plugin.get("raw") else "srgb",
        )
    notes.add(name, kind, "is neither a number nor a colour nor a plain image: its default stands for it")
    return None
