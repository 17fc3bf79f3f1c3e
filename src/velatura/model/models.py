"""Named models: what each one chooses where the papers, and their published code, differ."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from velatura.errors import InvalidInput
from velatura.stack.schema import unknown

#: Every switch with its values; `Model` says what each one means.
SWITCHES: dict[str, tuple[str, ...]] = {
    "reflectance": ("fresnel", "fgd"),
    "tir": ("off", "published", "clean"),
    "map": ("belcour", "belcour-release", "weier"),
    "scale": ("shipped", "angles"),
    "channels": ("mean", "separate"),
    "medium": ("shipped", "weighted"),
}


@dataclass(frozen=True)
class Model:
    """A set of choices.

    Args:
        reflectance: energy that an interface reflects: `fresnel` at the mean direction, or directional albedo (`fgd`).
        tir: share of light that leaves upwards after a reflection from inside: all of it (`off`), the `published` mean
            of 1 - F, or the energy fraction within the critical cone (`clean`).
        map: the roughness map f, from GGX roughness to a variance that adds.
        scale: whether the roughness of a refraction is scaled as at normal incidence (`shipped`) or by the real
            cosines (`angles`).
        channels: one variance for all colours, from the `mean` of the energies, or one per channel (`separate`).
        medium: a scattering medium gives its variance to all that it transmits (`shipped`), or to the scattered share
            (`weighted`).
        exceptions: laws of `velatura.checks` that a BSDF of this model does not keep, and is known not to.
    """

    name: str
    reflectance: str
    tir: str
    map: str
    scale: str
    channels: str
    medium: str
    exceptions: frozenset[str] = frozenset()

    def with_switches(self, **switches: str) -> Model:
        """This model with some choices changed.

        Raises:
            InvalidInput: an unknown switch, or a value that it does not have.
        """
        for key, value in switches.items():
            if key not in SWITCHES:
                raise InvalidInput(unknown("switch", key, SWITCHES))
            if value not in SWITCHES[key]:
                raise InvalidInput(f"{key}: must be one of {', '.join(SWITCHES[key])}, got {value!r}")
        changes: dict[str, Any] = {**switches}
        return dataclasses.replace(self, **changes)


MODELS: tuple[Model, ...] = (
    Model(
        "belcour2018",
        reflectance="fgd",
        tir="published",
        map="belcour",
        scale="shipped",
        channels="mean",
        medium="shipped",
        exceptions=frozenset({"reciprocity", "lossless"}),
    ),
)

DEFAULT = "belcour2018"


def named(model: str | Model, **switches: str) -> Model:
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
