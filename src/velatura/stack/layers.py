"""The layers of a stack: interfaces, media, and a diffuse base."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import model_validator

from velatura.stack.schema import Record, parameters
from velatura.stack.spectra import MIRROR, Measured, Named, names, rgb
from velatura.stack.values import (
    INDEX_HIGH,
    INDEX_LOW,
    RGB,
    Angle,
    Brushing,
    Colour,
    Conductor,
    Index,
    Pair,
    Scalar,
    Spectrum,
    Texture,
)

Kind: TypeAlias = Literal["dielectric", "conductor", "mirror", "medium", "diffuse"]
Value: TypeAlias = float | RGB | Named | Spectrum | Texture | Brushing


class Interface(Record):
    """A boundary to the medium below it.

    It is a dielectric where `eta` stands alone, and opaque where `k` (even 0) or `conductor` is given.
    """

    eta: Annotated[
        float | RGB | str | Spectrum | Texture | None,
        Index("absolute index of refraction of the medium below", low=INDEX_LOW, high=INDEX_HIGH, part="eta"),
    ] = None
    k: Annotated[
        float | RGB | str | Spectrum | Texture | None,
        Index(
            "absolute extinction of what lies below; written, even as 0, it makes it opaque",
            low=0,
            high=INDEX_HIGH,
            part="k",
        ),
    ] = None
    conductor: Annotated[
        str | None,
        Conductor("a metal by name, in place of eta and k; `mirror` reflects all light"),
    ] = None
    alpha: Annotated[
        float | Texture | tuple[float | Texture, float | Texture],
        Pair("GGX roughness along the tangent and the bitangent", low=0, high=1),
    ] = 0.0
    rotation: Annotated[
        float | Texture | Brushing,
        Angle("turn of the tangent, anticlockwise seen from outside, from dp/du", unit="degrees"),
    ] = 0.0

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Interface:
        for key in ("eta", "k"):
            if self.conductor is not None and getattr(self, key) is not None:
                raise ValueError(f"{key}: not together with conductor; write conductor, or eta and k")
        if self.conductor is None and self.eta is None:
            raise ValueError("eta: missing; write eta, or eta and k, or conductor")
        if self.k is None and isinstance(self.eta, str) and self.eta in names()[0]:
            raise ValueError(f"eta: {self.eta} is a metal; write conductor: {self.eta}")
        return self

    @property
    def opaque(self) -> bool:
        """Whether nothing passes: `k` or `conductor` is given."""
        return self.k is not None or self.conductor is not None

    @property
    def kind(self) -> Kind:
        """dielectric, conductor or mirror."""
        if self.conductor == MIRROR:
            return "mirror"
        return "conductor" if self.opaque else "dielectric"

    def flat(self) -> dict[str, Value]:
        """Every value under its own key; a mirror has no indices, a dielectric no extinction."""
        values: dict[str, Value] = {}
        if self.kind != "mirror":
            values["eta"] = _spectrum(self.conductor or self.eta, "eta")
        if self.kind == "conductor":
            values["k"] = _spectrum(self.conductor or self.k, "k")
        values["alpha_u"], values["alpha_v"] = self.alpha if isinstance(self.alpha, tuple) else (self.alpha, self.alpha)
        values["rotation"] = self.rotation
        return values


class Medium(Record):
    """A homogeneous medium between two interfaces, or above the first."""

    depth: Annotated[float | Texture, Scalar("thickness, in the unit of length of sigma", unit="length", low=0)] = 1.0
    sigma_a: Annotated[float | RGB | Spectrum | Texture, Colour("absorption coefficient", unit="1/length", low=0)] = 0.0
    sigma_s: Annotated[float | RGB | Spectrum | Texture, Colour("scattering coefficient", unit="1/length", low=0)] = 0.0
    g: Annotated[
        float | Texture,
        Scalar("mean cosine of the scattering angle (Henyey-Greenstein)", low=-1, high=1, strict=True),
    ] = 0.0

    @property
    def kind(self) -> Kind:
        """medium."""
        return "medium"

    def flat(self) -> dict[str, Value]:
        """Every value under its own key."""
        return {"depth": self.depth, "sigma_a": self.sigma_a, "sigma_s": self.sigma_s, "g": self.g}


class Diffuse(Record):
    """An ideally diffuse base, opaque, below everything else."""

    albedo: Annotated[float | RGB | Spectrum | Texture, Colour("fraction of light reflected", low=0, high=1)] = 0.5

    @property
    def kind(self) -> Kind:
        """diffuse."""
        return "diffuse"

    def flat(self) -> dict[str, Value]:
        """Every value under its own key."""
        return {"albedo": self.albedo}


Layer: TypeAlias = Interface | Medium | Diffuse

LAYERS: dict[str, type[Interface] | type[Medium] | type[Diffuse]] = {
    "interface": Interface,
    "medium": Medium,
    "diffuse": Diffuse,
}


_COLOURS = {k for model in LAYERS.values() for k, declared in parameters(model).items() if isinstance(declared, Colour)}


def is_colour(name: str) -> bool:
    """Whether the value of that flat name (`layer0_eta`) may differ between colours."""
    return name.partition("_")[2] in _COLOURS


def declared(name: str) -> Scalar:
    """How the value of that flat name is declared; `exterior` is an index as well."""
    key = "eta" if name == "exterior" else name.partition("_")[2]
    known: dict[str, Any] = {k: p for model in LAYERS.values() for k, p in parameters(model).items()}
    return known["alpha" if key.startswith("alpha") else key]


def within(name: str) -> tuple[float, float]:
    """Range of the value of that flat name, a little inside where its ends are excluded."""
    parameter = declared(name)
    margin = 1e-3 if parameter.strict else 0.0
    return parameter.low + margin, parameter.high - margin


def reduced(name: str, measured: Measured) -> RGB:
    """A spectrum as the colour that it gives the value of that flat name; where sRGB does not hold it, the nearest."""
    low, high = within(name)
    red, green, blue = (min(max(channel, low), high) for channel in rgb(measured))
    return red, green, blue


def entry_name(layer: Layer) -> str:
    """Name of the layer in a file: interface, medium or diffuse."""
    return type(layer).__name__.lower()


def _spectrum(value: float | RGB | str | Spectrum | Texture | None, part: Literal["eta", "k"]) -> Value:
    assert value is not None  # the validator saw to that
    return Named(value, part) if isinstance(value, str) else value
