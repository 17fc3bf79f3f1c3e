"""The layers of a stack: interfaces, media, and a diffuse base, as written in files, and the records of their values.

A kind of layer is declared here and nowhere else in this package: its parameters, the record of its values, and what
it is to its neighbours. Files, flat names, `--set`, plugins, textures, schema and manual follow from that.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import model_validator

from velatura.errors import within
from velatura.stack.phases import Phase, PhaseRecord, WrittenPhase, asymmetry
from velatura.stack.pigments import Pigment, Pigments, coefficients
from velatura.stack.schema import Parameter, Record, Taken, by_default, parameters
from velatura.stack.spectra import MIRROR, Measured, MeasuredIndex, Named, names
from velatura.stack.values import (
    INDEX_HIGH,
    INDEX_LOW,
    RGB,
    Angle,
    Brushing,
    Colour,
    ColourLike,
    ColourValue,
    Conductor,
    Film,
    Films,
    Index,
    IndexLike,
    IndexValue,
    NumbersLike,
    Pair,
    Scalar,
    ScalarLike,
    Spectrum,
    Substance,
    Texture,
    Written,
)

Kind: TypeAlias = Literal["dielectric", "conductor", "mirror", "medium", "diffuse"]
Value: TypeAlias = float | RGB | Named | Spectrum | Substance | Texture | Brushing

# Values, in any dialect: floats, arrays, a renderer's numbers, recorded symbols --------------------------------------


@dataclass(frozen=True)
class FilmValues:
    """A thin film of index eta + i k."""

    eta: Any
    k: Any
    thickness_nm: Any


@dataclass(frozen=True)
class InterfaceValues:
    """A dielectric, a conductor or a mirror: GGX roughness along two axes, turned by `rotation` (degrees), and absolute
    indices of the medium below; a mirror has none, and a dielectric no extinction `k`. Thin films are listed from the
    top; `coating` is their reflectance as a renderer has it, None where it follows from the values. `measured` is the
    index over wavelength that `eta` and `k` are colours of, None where these are all that is known.
    """

    kind: Kind
    alpha_u: Any
    alpha_v: Any
    rotation: Any
    eta: Any = None
    k: Any = None
    films: tuple[FilmValues, ...] = ()
    coating: Any = None
    measured: MeasuredIndex | None = None

    @property
    def spreads(self) -> bool:
        """Whether it spreads light over directions; what is not known to be 0 does."""
        return not (is_zero(self.alpha_u) and is_zero(self.alpha_v))


class SlabValues(ABC):
    """A medium between two surfaces, as models read it: its optical depths along the normal (colours), and its
    asymmetry `g`, the mean cosine of the scattering angle. Its phase function is Henyey and Greenstein's of that, or
    else `phase` as written (`velatura.media`).
    """

    kind: ClassVar[Kind]
    g: Any
    phase: WrittenPhase | None = None

    @property
    @abstractmethod
    def tau_a(self) -> Any:
        """Optical depth of absorption."""

    @property
    @abstractmethod
    def tau_s(self) -> Any:
        """Optical depth of scattering."""

    @property
    def spreads(self) -> bool:
        """Whether it spreads light over directions; what is not known to be 0 does."""
        return not is_zero(self.tau_s)


@dataclass(frozen=True)
class MediumValues(SlabValues):
    """A homogeneous medium: thickness, coefficients per unit of length, asymmetry, and maybe a phase function."""

    kind: ClassVar[Kind] = "medium"
    depth: Any
    sigma_a: Any
    sigma_s: Any
    g: Any
    phase: WrittenPhase | None = None

    @property
    def tau_a(self) -> Any:
        return _product(self.sigma_a, self.depth)

    @property
    def tau_s(self) -> Any:
        return _product(self.sigma_s, self.depth)

    @property
    def spreads(self) -> bool:
        """Whether it spreads light over directions, also where its values are textures, which have no product."""
        return not (is_zero(self.sigma_s) or is_zero(self.depth))


class BaseValues(ABC):
    """An ideally diffuse base, as models read it, by its `albedo` (a colour)."""

    kind: ClassVar[Kind]
    spreads: ClassVar[bool] = True
    albedo: Any


@dataclass(frozen=True)
class DiffuseValues(BaseValues):
    """A diffuse base of a given albedo."""

    kind: ClassVar[Kind] = "diffuse"
    albedo: Any


LayerValues: TypeAlias = InterfaceValues | SlabValues | BaseValues


def is_zero(value: object) -> bool:
    """Whether a value is 0 and may be looked at."""
    if isinstance(value, float):
        return value == 0
    import numpy as np  # slow to import, and most stacks have numbers alone

    return isinstance(value, np.ndarray) and not value.any()


def _product(a: Any, b: Any) -> Any:
    """The product; a factor that is known to be 0 keeps the other one out of recorded code."""
    return 0.0 if any(isinstance(x, float) and x == 0 for x in (a, b)) else a * b


#: Of a medium, which may follow from pigments.
COEFFICIENTS = "sigma_a", "sigma_s"

#: Indices of a mirror under films, which absorbs less than 1e-6 of light.
PERFECT = {"eta": 1.0, "k": INDEX_HIGH}


# As they are written -------------------------------------------------------------------------------------------------


class LayerRecord(Record):
    """The common part of all kinds of layers.

    Attributes:
        record: of its values.
        lacks: kinds that it may be of, each with the parameters that it then has not.
        opaque_kinds: those below which nothing may lie.
        surface: whether light meets it at one depth and may turn back; media lie above surfaces.
        title: its name, in words.
        fresh: values of a new one in the editor, besides the typical values of its parameters.
    """

    record: ClassVar[type[LayerValues]]
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]]
    opaque_kinds: ClassVar[frozenset[Kind]] = frozenset()
    surface: ClassVar[bool]
    title: ClassVar[str]
    fresh: ClassVar[Mapping[str, Any]] = {}

    @property
    def kind(self) -> Kind:
        """The kind of the layer."""
        return next(iter(self.lacks))

    @property
    def opaque(self) -> bool:
        """Whether nothing may lie below it."""
        return self.kind in self.opaque_kinds

    @property
    def lossless(self) -> bool:
        """Whether it absorbs no light, wherever light meets it."""
        return True

    def written(self, key: str) -> Any:
        """The value of a parameter as written."""
        return getattr(self, key)

    def flat(self) -> dict[str, Value]:
        """Every value under its own key, those of its kind only."""
        values: dict[str, Value] = {}
        for key, declared in parameters(type(self)).items():
            if isinstance(declared, Scalar) and key not in self.lacks[self.kind]:
                values.update(zip(declared.parts(key), declared.single(self.written(key))))
        return values


class Interface(LayerRecord):
    """A boundary to the medium below it.

    It is a dielectric where `eta` stands alone, and opaque where `k` (even 0) or `conductor` is given. The page of a
    metal in the refractiveindex.info database, as `eta` alone, gives both.
    """

    record = InterfaceValues
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]] = {
        "dielectric": ("k", "conductor"),
        "conductor": (),
        "mirror": ("eta", "k"),
    }
    opaque_kinds = frozenset({"conductor", "mirror"})
    surface = True
    title = "interface"

    eta: Annotated[
        Taken[IndexLike | None, IndexValue | None],
        Index(
            "absolute index of refraction of the medium below", low=INDEX_LOW, high=INDEX_HIGH, part="eta", typical=1.5
        ),
    ] = by_default(None)
    k: Annotated[
        Taken[IndexLike | None, IndexValue | None],
        Index(
            "absolute extinction of what lies below; written, even as 0, it makes it opaque",
            low=0,
            high=INDEX_HIGH,
            part="k",
            typical=1.0,
        ),
    ] = by_default(None)
    conductor: Annotated[
        str | None,
        Conductor("a metal by name, in place of eta and k; `mirror` reflects all light"),
    ] = None
    alpha: Annotated[
        Taken[
            ScalarLike | NumbersLike | Sequence[ScalarLike], float | Texture | tuple[float | Texture, float | Texture]
        ],
        Pair("GGX roughness along the tangent and the bitangent", low=0, high=1, typical=0.1),
    ] = by_default(0.0)
    rotation: Annotated[
        Taken[ScalarLike | Brushing, float | Texture | Brushing],
        Angle("turn of the tangent, anticlockwise seen from outside, from dp/du", unit="degrees"),
    ] = by_default(0.0)
    films: Annotated[Taken[Sequence[Film | Written], tuple[Film, ...]], Films("thin films on it, from the top")] = (
        by_default(())
    )

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Interface:
        for key in ("eta", "k"):
            if self.conductor is not None and getattr(self, key) is not None:
                raise ValueError(f"{key}: not together with conductor; write conductor, or eta and k")
        if self.conductor is None and self.eta is None:
            raise ValueError("eta: missing; write eta, or eta and k, or conductor")
        if self.k is None and isinstance(self.eta, str) and self.eta in names()[0]:
            raise ValueError(f"eta: {self.eta} is a metal; write conductor: {self.eta}")
        if self.k is None and self.conductor is None and isinstance(self.eta, Substance) and self.eta.opaque:
            with within("k", ValueError):
                object.__setattr__(self, "k", parameters(Interface)["k"].check(self.eta))  # frozen from here on
        return self

    @property
    def kind(self) -> Kind:
        """dielectric, conductor or mirror; a mirror under films is a conductor, whose index they need."""
        if self.conductor == MIRROR and not self.films:
            return "mirror"
        return "dielectric" if self.k is None and self.conductor is None else "conductor"

    def flat(self) -> dict[str, Value]:
        """Every value under its own key, those of films included."""
        values = super().flat()
        for k, film in enumerate(self.films):
            for key, declared in parameters(Film).items():
                assert isinstance(declared, Scalar)
                values[film_key(k, key)] = declared.single(getattr(film, key))[0]
        return values

    @property
    def measured(self) -> MeasuredIndex | None:
        """The index of a metal that was measured; None of one in numbers, and of a dielectric."""
        eta, k = (self.flat().get(key) for key in ("eta", "k"))
        return MeasuredIndex(eta, k) if isinstance(eta, Measured) and isinstance(k, Measured) else None

    @property
    def lossless(self) -> bool:
        """Whether it absorbs no light: it is no metal, and no film on it absorbs."""
        is_metal = self.opaque and self.conductor != MIRROR
        return not is_metal and not any(film.absorbs for film in self.films)

    def written(self, key: str) -> Any:
        """The value of a parameter as written: for the indices, the name of a conductor, or those of a mirror."""
        value = getattr(self, key)
        if value is None and self.conductor == MIRROR:
            return PERFECT.get(key)
        return self.conductor if value is None else value


class Medium(LayerRecord):
    """A homogeneous medium, above an interface, a diffuse base or another medium."""

    record = MediumValues
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]] = {"medium": ()}
    surface = False
    title = "medium"
    fresh: ClassVar[Mapping[str, Any]] = {"sigma_a": (0.1, 0.2, 0.4)}

    depth: Annotated[
        Taken[ScalarLike, float | Texture], Scalar("thickness, in the unit of length of sigma", unit="length", low=0)
    ] = by_default(1.0)
    sigma_a: Annotated[Taken[ColourLike, ColourValue], Colour("absorption coefficient", unit="1/length", low=0)] = (
        by_default(0.0)
    )
    sigma_s: Annotated[Taken[ColourLike, ColourValue], Colour("scattering coefficient", unit="1/length", low=0)] = (
        by_default(0.0)
    )
    g: Annotated[
        Taken[ScalarLike, float | Texture],
        Scalar("mean cosine of the scattering angle (Henyey-Greenstein)", low=-1, high=1, strict=True),
    ] = by_default(0.0)
    phase: Annotated[
        Taken[str | PhaseRecord | Written | None, str | PhaseRecord | None], Phase("phase function, in place of g")
    ] = by_default(None)
    pigments: Annotated[
        Taken[Sequence[Pigment | Written], tuple[Pigment, ...]], Pigments("pigments, in place of sigma_a and sigma_s")
    ] = by_default(())

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> Medium:
        if self.phase is not None and self.g != 0:
            raise ValueError("g: not together with phase, which has an asymmetry of its own")
        if self.pigments:
            for key in COEFFICIENTS:
                if getattr(self, key) != 0:
                    raise ValueError(f"{key}: not together with pigments, which give it")
            if isinstance(self.g, Texture):
                raise ValueError("g: must be a number together with pigments, whose sigma_s follows from it")
            with within("pigments", ValueError):
                for key, value in zip(COEFFICIENTS, coefficients(self.pigments, self.written("g"))):
                    with within(key, ValueError):
                        parameters(Medium)[key].check(value)
        return self

    @property
    def lossless(self) -> bool:
        """Whether it absorbs no light."""
        return self.written("sigma_a") in (0.0, (0.0, 0.0, 0.0))

    def written(self, key: str) -> Any:
        """The value of a parameter as written; `g` is the asymmetry of any phase function, and what follows from
        pigments is worked out."""
        if key == "g" and self.phase is not None:
            return asymmetry(self.phase)
        if key in COEFFICIENTS and self.pigments:
            sigma_a, sigma_s = coefficients(self.pigments, self.written("g"))
            return sigma_a if key == "sigma_a" else sigma_s
        return getattr(self, key)


class Diffuse(LayerRecord):
    """An ideally diffuse base, opaque, below everything else."""

    record = DiffuseValues
    lacks: ClassVar[Mapping[Kind, tuple[str, ...]]] = {"diffuse": ()}
    opaque_kinds = frozenset({"diffuse"})
    surface = True
    title = "diffuse base"
    fresh: ClassVar[Mapping[str, Any]] = {"albedo": (0.5, 0.5, 0.5)}

    albedo: Annotated[Taken[ColourLike, ColourValue], Colour("fraction of light reflected", low=0, high=1)] = (
        by_default(0.5)
    )

    @property
    def lossless(self) -> bool:
        """Whether it absorbs no light: it is white."""
        return self.albedo in (1.0, (1.0, 1.0, 1.0))


Layer: TypeAlias = Interface | Medium | Diffuse

LAYERS: dict[str, type[Layer]] = {"interface": Interface, "medium": Medium, "diffuse": Diffuse}

#: The index above the first layer.
EXTERIOR = Scalar(
    "absolute index of refraction above", low=INDEX_LOW, high=INDEX_HIGH, texturable=False, differentiable=False
)

#: The layers by their possible kinds.
KINDS: dict[str, type[Layer]] = {kind: layer for layer in LAYERS.values() for kind in layer.lacks}


def transmits(kinds: Collection[Kind]) -> bool:
    """Whether light passes layers of such kinds: one is an interface, and none is opaque."""
    return "dielectric" in kinds and not any(kind in KINDS[kind].opaque_kinds for kind in kinds)


def has(kind: str) -> dict[str, Parameter]:
    """The declared parameters of a kind of layer."""
    layer = KINDS[kind]
    lacks = next(keys for name, keys in layer.lacks.items() if name == kind)
    return {key: declared for key, declared in parameters(layer).items() if key not in lacks}


def film_key(k: int, key: str) -> str:
    """The key of a value of the k-th film of an interface."""
    return f"film{k}_{key}"


def entry_name(layer: Layer) -> str:
    """Name of the layer in a file: interface, medium or diffuse."""
    return type(layer).__name__.lower()
