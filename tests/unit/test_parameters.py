"""Every declared parameter is read by every model, or listed here as not read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura.model import MODELS
from velatura.stack import Material
from velatura.stack.layers import KINDS
from velatura.stack.schema import parameters
from velatura.stack.values import Film

METAL = vt.Interface(eta=0.2, k=3.0, alpha=0.2)
# kind -> layers in which all of its parameters count, and the place of the layer of that kind
STACKS: dict[str, tuple[list[Any], int]] = {
    "dielectric": ([vt.Interface(eta=1.5, alpha=(0.1, 0.3), rotation=20.0), METAL], 0),
    "conductor": ([vt.Interface(eta=1.5, alpha=0.1), vt.Interface(eta=0.2, k=3.0, alpha=(0.1, 0.3), rotation=20.0)], 1),
    "mirror": (
        [vt.Interface(eta=1.5, alpha=0.1), vt.Interface(conductor="mirror", alpha=(0.1, 0.3), rotation=20.0)],
        1,
    ),
    "medium": ([vt.Interface(eta=1.5), vt.Medium(depth=0.3, sigma_a=0.2, sigma_s=0.4, g=0.7), METAL], 1),
    "diffuse": ([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=0.5)], 1),
}
FILMED = vt.Interface(eta=1.5, alpha=0.1, films=[vt.Film(eta=1.8, k=0.1, thickness_nm=300.0)])
OTHER = {"rotation": 50.0, "thickness_nm": 360.0}  # values instead of 1.2 times as much

#: (model, flat name) of values that a model does not read; each with its reason.
NOT_READ: set[tuple[str, str]] = set()


def lobes(stack: vt.Stack, model: str) -> np.ndarray:
    found = vt.lobes(stack, [1.0, 0.5], 0.4, model=model)
    return np.concatenate([np.ravel(x) for x in (*found.energy, *found.alpha, *found.covariance, found.remainder)])


def changed(stack: vt.Stack, name: str) -> vt.Stack:
    value = stack.flat()[name]
    key = name.rpartition("_")[2] if "rotation" in name else name.partition("_")[2].removeprefix("film0_")
    return stack.replace(**{name: OTHER.get(key, 0.8 * float(np.max(value)))})


def cases() -> list[tuple[str, str, str]]:
    each = [(kind, f"layer{place}_{key}") for kind, (layers, place) in STACKS.items() for key in keys(layers, place)]
    each += [("film", f"layer0_film0_{key}") for key in parameters(Film)]
    return [(model.name, *case) for model in MODELS for case in each]


def keys(layers: list[Any], place: int) -> list[str]:
    prefix = f"layer{place}_"
    return [name.removeprefix(prefix) for name in vt.Stack(layers).flat() if name.startswith(prefix)]


def test_every_kind_is_tried() -> None:
    assert STACKS.keys() == KINDS.keys()


@pytest.mark.parametrize(("model", "kind", "name"), cases())
def test_a_parameter_changes_the_lobes(model: str, kind: str, name: str) -> None:
    layers = [FILMED, METAL] if kind == "film" else STACKS[kind][0]
    stack = vt.Stack(layers)
    apart = np.abs(lobes(changed(stack, name), model) - lobes(stack, model)).max()
    assert (apart > 1e-6) == ((model, name) not in NOT_READ)


@pytest.mark.parametrize("kind", STACKS)
def test_a_stack_and_its_values_agree_on_what_passes(kind: str) -> None:
    layers, place = STACKS[kind]
    for stack in (vt.Stack(layers), vt.Stack(layers[: place + 1])) if kind != "medium" else (vt.Stack(layers),):
        assert stack.transmits == Material.of(stack).transmits
