"""BSDF plugins beside the named models, compared by their samples; they have no lobes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from velatura import api, files, kernel
from velatura.bakes import TARGETS
from velatura.checks.probe import Probe
from velatura.comparison.evaluated_lobes import LightPoints, distribution
from velatura.comparison.result import Account
from velatura.errors import InvalidInput
from velatura.model import MODELS
from velatura.optics.directions import directions
from velatura.reference import WalkedLobe
from velatura.stack import Described
from velatura.stack.schema import unknown

#: A plugin by name, with Mitsuba's defaults; the XML file of a BSDF; or its parameters as `mi.load_dict` takes them.
Plugin: TypeAlias = str | Path | Mapping[str, Any]

HOLDERS = ("blendbsdf", "bumpmap", "mask", "normalmap", "twosided")  # Mitsuba's own, that hold other BSDFs
SAMPLES = 2**21  # for each direction, as noisy as the truth


def name_of(plugin: Plugin) -> str:
    """The name of a plugin among the models: its `id`, if it has one; the name of its file without the ending."""
    if isinstance(plugin, Mapping):
        return str(plugin.get("id", plugin.get("type")))
    return Path(plugin).stem if _is_file(plugin) else str(plugin)


def made(plugin: Plugin, material: Described, microsurface: bool) -> Any:
    """The `mi.BSDF`; Velatura's own plugins are given the material.

    Raises:
        InvalidInput: no such plugin, none for BSDFs, or one that holds others, without which Mitsuba may crash; what
            Mitsuba refuses; a variant that is not vectorised, or without RGB.
        MissingTool: LLVM is missing or too old.
    """
    mi = kernel.mitsuba()
    if not mi.is_rgb or mi.variant().startswith("scalar"):
        raise InvalidInput(f"models: plugins are compared in llvm_ad_rgb or the like, not in {mi.variant()}")
    if isinstance(plugin, str) and plugin in api.PLUGINS:
        often: dict[str, Any] = {
            "reference": {"microsurface": microsurface},
            "exact": {"reflectance": "fgd-multi" if microsurface else "fgd"},
        }
        return api.bsdf(material, plugin, **often.get(plugin, {}))
    if not plugin:
        raise InvalidInput("models: a name is empty")
    try:
        bsdf = _from_file(mi, plugin) if _is_file(plugin) else _from_type(mi, plugin)
    except RuntimeError as error:
        said = " ".join(str(error).split())
        if isinstance(plugin, str) and "not found!" in said:
            known = [*(model.name for model in MODELS), *api.PLUGINS, *TARGETS]
            raise InvalidInput(f"{unknown('model', plugin, known)}, nor a BSDF plugin of Mitsuba's") from None
        reason = re.sub(r".*\[[\w.:]+\] ", "", said)  # without the places in Mitsuba's sources
        raise InvalidInput(f"models: {name_of(plugin)}: {reason}") from None
    if not isinstance(bsdf, mi.BSDF):
        raise InvalidInput(f"models: {name_of(plugin)} is no BSDF")
    return bsdf


def _from_file(mi: Any, path: Any) -> Any:
    """The content of an XML file, refused before Mitsuba reads it unless it is a BSDF."""
    try:
        root = ElementTree.fromstring(files.content(Path(path)))
    except (LookupError, ElementTree.ParseError) as error:
        raise InvalidInput(f"{path}: cannot be read: {error}") from None
    if root.tag != "bsdf":
        raise InvalidInput(f"{path}: must hold a <bsdf>, got a <{root.tag}>")
    api.register()
    kernel.allow_pictures()
    return mi.load_file(str(path))


def _from_type(mi: Any, plugin: Any) -> Any:
    """A plugin with given parameters, or Mitsuba's."""
    fields = dict(plugin) if isinstance(plugin, Mapping) else {"type": plugin}
    name = str(fields.get("type", ""))
    if name in HOLDERS:
        raise InvalidInput(f"models: {name} holds other BSDFs; write it with them into an XML file, and name that")
    kind = mi.PluginManager.instance().plugin_type(name)
    if kind not in (mi.ObjectType.BSDF, mi.ObjectType.Unknown):  # of plugins in Python it knows no kind
        raise InvalidInput(f"models: {name} is no BSDF")
    api.register()
    return kernel.load_dict(fields)


def account(bsdf: Any, material: Described, cos_theta: Sequence[float]) -> Account:
    """The distribution of the light of a BSDF, by its own sampling; its lobes are unknown, and NaN."""
    probe, rng = Probe(bsdf), np.random.default_rng(0)
    grids = []
    for wi in directions(cos_theta):
        drawn = probe.sample(np.broadcast_to(wi, (SAMPLES, 3)), rng.random((SAMPLES, 3)))
        up = drawn.wo[:, 2] > 0
        grids.append(distribution(LightPoints(drawn.wo[up, :2].T, drawn.weight[up].T / SAMPLES)))
    return without_lobes(material, np.stack(grids, axis=1))


def without_lobes(material: Described, grid: NDArray[np.floating]) -> Account:
    """An account of a distribution (3, N, bins, bins) alone."""

    def nothing(*shape: int) -> NDArray[np.floating]:
        return np.full((*shape, grid.shape[1]), np.nan)

    lobe = WalkedLobe(energy=nothing(3), alpha=nothing(2), rotation=nothing(), mean=nothing(2), covariance=nothing(3))
    surfaces = sum(len(stack.surfaces) for _, stack in material.leaves())
    passing = sum(stack.transmits for _, stack in material.leaves())
    return Account((lobe,) * surfaces, (lobe,) * passing, grid.sum(axis=(2, 3)), grid)


def _is_file(plugin: Plugin) -> bool:
    return isinstance(plugin, str | Path) and Path(plugin).suffix == ".xml"
