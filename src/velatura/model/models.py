"""Named models: their choices where the papers, and their published code, differ."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from velatura.errors import InvalidInput
from velatura.model.recursion import ADDING, InOwnMedia, Recursion
from velatura.stack.schema import unknown

#: Every switch with its values; `Model` describes each one.
SWITCHES: dict[str, tuple[str, ...]] = {
    "reflectance": ("fresnel", "fg", "fgd", "fgd-multi", "split-sum"),
    "tir": ("off", "published", "clean"),
    "map": ("belcour", "belcour-release", "weier", "weier-2d"),
    "scale": ("shipped", "angles"),
    "channels": ("mean", "separate"),
    "medium": ("shipped", "weighted", "doubled"),
    "form": ("forward", "symmetric"),
    "fetch": ("averaged", "stretched"),
    "lobes": ("all", "three", "two"),
}

GAIN = frozenset({"energy", "white furnace"})  # laws that a gain breaks

#: By form and shape of the stack, the laws that BSDFs do not keep. Light that a lobe sends below the surface is lost.
#: The forward form is not reciprocal, the symmetric one gains at grazing angles, and its samples have any weight. Of
#: materials that are solved, the forms are `solved` and `exchanged`, or `balanced` where opaque, isotropic and uniform.
EXCEPTIONS: dict[tuple[str, str], frozenset[str]] = {
    ("forward", "opaque"): frozenset({"lossless", "reciprocity"}),
    ("forward", "pane"): frozenset({"lossless", "reciprocity"}),
    ("solved", "opaque"): frozenset({"lossless", "reciprocity"}),
    ("solved", "pane"): frozenset({"lossless", "reciprocity"}) | GAIN,
    ("symmetric", "opaque"): frozenset({"lossless", "spread"}) | GAIN,
    ("symmetric", "pane"): frozenset({"lossless", "spread"}) | GAIN,
    ("exchanged", "opaque"): frozenset({"lossless"}) | GAIN,
    ("exchanged", "pane"): frozenset({"lossless"}) | GAIN,
    ("balanced", "opaque"): frozenset({"lossless"}),
}


@dataclass(frozen=True)
class Model:
    """A set of choices.

    Args:
        reflectance: energy that an interface reflects: `fresnel` at the mean direction, the same times the masking of
            the mirror direction both ways (`fg`; Yamaguchi et al. 2019, 2), directional albedo of single reflections
            (`fgd`) or of any number of bounces between the facets (`fgd-multi`; Belcour 2018, 4.1), or the first with
            Schlick's Fresnel and the interface's own roughness (`split-sum`; Weier & Belcour 2020, Listing 1).
        tir: share of light that leaves upwards after a reflection from inside: all of it (`off`), the `published` mean
            of 1 - F, or the energy fraction within the critical cone (`clean`).
        map: the roughness map f, from GGX roughness to a variance that adds.
        scale: whether the roughness of a refraction is scaled as at normal incidence (`shipped`) or by the real
            cosines (`angles`).
        channels: one variance for all colours, from the `mean` of the energies, or one per channel (`separate`).
        medium: a scattering medium gives its variance to all that it transmits (`shipped`), or to the share that it
            scatters, once (`weighted`) or as often as it will, as layers do that are doubled from thin ones (`doubled`;
            Belcour 2018, 5.1).
        form: lobes from the cosine of the light's direction (`forward`), or from that of half the angle between light
            and view (`symmetric`; Belcour 2018, 6.2), which is reciprocal.
        fetch: where an average over an anisotropic interface is looked up: at a mean of its roughnesses in which that
            along the azimuth counts more (`averaged`), or at the lower one, for a `stretched` direction (Weier &
            Belcour 2020, Listing 1).
        lobes: reflected lobes that are evaluated: `all`, one for each interface, or at most `three` or `two`, inner
            ones merged.
        recursion: how the layers are summed up.
    """

    name: str
    reflectance: str
    tir: str
    map: str = "belcour"
    scale: str = "shipped"
    channels: str = "mean"
    medium: str = "shipped"
    form: str = "forward"
    fetch: str = "averaged"
    lobes: str = "all"
    recursion: Recursion = ADDING

    @property
    def microsurface(self) -> bool:
        """Whether light may bounce between the facets of an interface, as in the truth of that name."""
        return self.reflectance == "fgd-multi"

    @property
    def in_closed_form(self) -> Model:
        """The nearest model by the recursion of the papers, without total internal reflection."""
        return dataclasses.replace(self, recursion=ADDING, tir="off")

    @property
    def adder(self) -> Model:
        """This model, or where an interface does not follow from its lobe, the nearest one of which it does."""
        return self if self.recursion.closed_form else self.in_closed_form

    def with_switches(self, /, **switches: str) -> Model:
        """This model with some choices changed.

        Raises:
            InvalidInput: an unknown switch, or a value that it does not have.
        """
        for key, value in switches.items():
            if key not in SWITCHES:
                raise InvalidInput(unknown("switch", key, SWITCHES))
            if value not in SWITCHES[key]:
                raise InvalidInput(f"{key}: must be one of {', '.join(SWITCHES[key])}, got {value!r}")
            if value not in self.allowed(key):
                raise InvalidInput(
                    f"{key}={value}: {self.name} has {' and '.join(self.allowed(key))} only; "
                    "the models of the papers have all"
                )
        changes: dict[str, Any] = {**switches}
        return dataclasses.replace(self, **changes)

    def allowed(self, key: str) -> tuple[str, ...]:
        """Allowed values of a switch: all for models of the papers; otherwise those for which the model is calibrated,
        and every form.
        """
        reflectances = self.recursion.reflectances()
        if reflectances is None or key == "form":
            return SWITCHES[key]
        return reflectances if key == "reflectance" else (getattr(self, key),)


MODELS: tuple[Model, ...] = (
    Model(
        "belcour2018",
        reflectance="fgd-multi",
        tir="published",
    ),
    Model(
        "yamaguchi2019",
        reflectance="fresnel",  # as its shader has it; `fg` in print
        tir="off",
    ),
    Model(
        "weier2020",
        reflectance="fresnel",
        tir="off",
        map="weier",
        scale="angles",
        fetch="stretched",
    ),
    Model(
        "bati2021",  # of the inverse
        reflectance="fgd",
        tir="off",
    ),
    Model(
        "realtime",
        reflectance="split-sum",
        tir="off",
        medium="weighted",
        lobes="three",
    ),
    Model(
        "velatura",
        reflectance="fgd-multi",
        tir="published",
        recursion=InOwnMedia(),
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
