"""The named models, and the lobes of a stack by name."""

from __future__ import annotations

from numpy.typing import ArrayLike

from velatura.errors import InvalidInput
from velatura.model.base import Model
from velatura.model.lobe_statistics import MixtureLobes, StackLobes
from velatura.model.papers.model import PaperModel
from velatura.model.solved.model import SolvedModel
from velatura.optics.directions import directions
from velatura.stack import Described, Material, Mix, Stack
from velatura.stack.schema import unknown

MODELS: tuple[Model, ...] = (
    PaperModel(
        "belcour2018",
        reflectance="fgd-multi",
        tir="published",
    ),
    PaperModel(
        "yamaguchi2019",
        reflectance="fresnel",  # as its shader has it; `fg` in print
        tir="off",
    ),
    PaperModel(
        "weier2020",
        reflectance="fresnel",
        tir="off",
        map="weier",
        scale="angles",
        fetch="stretched",
    ),
    PaperModel(
        "bati2021",  # of the inverse
        reflectance="fgd",
        tir="off",
    ),
    PaperModel(
        "realtime",
        reflectance="split-sum",
        tir="off",
        medium="weighted",
        lobes="three",
    ),
    SolvedModel(
        "velatura",
        reflectance="fgd-multi",
        near=PaperModel("velatura", reflectance="fgd-multi", tir="off"),
    ),
)

DEFAULT = "velatura"


def named(model: str | Model, /, **switches: str) -> Model:
    """The model of that name, with switches changed.

    Raises:
        InvalidInput: an unknown name or switch, or a value that a switch does not have.
    """
    if isinstance(model, Model):
        return model.with_switches(**switches)
    found = next((m for m in MODELS if m.name == model), None)
    if found is None:
        raise InvalidInput(unknown("model", model, [m.name for m in MODELS]))
    return found.with_switches(**switches)


def stack_lobes(
    stack: Stack,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    model: str | Model = DEFAULT,
    **switches: str,
) -> StackLobes:
    """The lobes of a stack; see `velatura.lobes`."""
    chosen = named(model, **switches)
    x, y, z = directions(cos_theta, phi).T
    return chosen.statistics(Material.of(stack).solid(), (x, y, z))


def lobes(
    material: Described,
    cos_theta: ArrayLike,
    phi: ArrayLike = 0.0,
    model: str | Model = DEFAULT,
    **switches: str,
) -> StackLobes | MixtureLobes:
    """The lobes of a stack or a mixture; see `velatura.lobes`."""
    if not isinstance(material, Mix):
        return stack_lobes(material, cos_theta, phi, model, **switches)
    shares = material.weighted("lobes are those of one point; replace it, as in --set part0_weight=0.5")
    parts = [stack_lobes(stack, cos_theta, phi, model, **switches).times(share) for share, stack in shares]
    return MixtureLobes(parts, [" ".join(f"part{number}" for number in path) for path, _ in material.leaves()])
