"""The interface of every model of a stack: its lobes, its BSDF, and the choices that a user has."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from velatura.errors import InvalidInput
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.stack.schema import unknown

if TYPE_CHECKING:
    from velatura.model.context import Context
    from velatura.model.lobe_statistics import StackLobes
    from velatura.model.variance import Variance
    from velatura.stack import Material

T = TypeVar("T")
M = TypeVar("M", bound="Model")

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


@dataclass(frozen=True)
class Query:
    """A question to a BSDF: reflection, transmission or both; of radiance, which scales with the squared index, or not.

    `reflection` may also be given for every reflected lobe, and then for the diffuse base.
    """

    reflection: bool | Sequence[bool] = True
    transmission: bool = True
    radiance: bool = True

    def lobes(self, lobes: Sequence[T]) -> Sequence[T]:
        """The queried reflected lobes."""
        return [lobe for k, lobe in enumerate(lobes) if self.reflects(k)]

    def reflects(self, k: int) -> bool:
        """Whether the k-th reflected part is queried: a lobe, from the top, or after all lobes the base."""
        if isinstance(self.reflection, bool):
            return self.reflection
        return k < len(self.reflection) and self.reflection[k]


ALL = Query()


class Body(Protocol):
    """A material as light meets it, from either side.

    `diffuse` says whether a diffuse part comes after the lobes, among what is reflected; `balanced`, whether its
    symmetric form conserves energy.
    """

    @property
    def diffuse(self) -> bool: ...

    @property
    def balanced(self) -> bool: ...

    def at_direction(self, wi: Direction) -> Body:
        """The same for light from wi alone, which is looked up once."""

    def albedo(self, wi: Direction, asked: Query = ...) -> Value: ...

    def eval_pdf(self, wi: Direction, wo: Direction, asked: Query = ...) -> tuple[Value, Value]: ...

    def sample(self, wi: Direction, u: Value, u1: Value, u2: Value, asked: Query = ...) -> tuple[Direction, Value]: ...

    def component(self, wi: Direction, wo: Direction, u: Value, asked: Query = ...) -> Value: ...


class Model(ABC):
    """A model of how light goes through a stack. Implementations are frozen dataclasses with a `name`.

    A model has every switch of `SWITCHES`, and `allowed` values of it:

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

    Attributes:
        closed_form: an interface that has a given lobe follows in closed form (Bati et al. 2021).
    """

    closed_form: ClassVar[bool]
    name: str
    reflectance: str
    tir: str
    map: str
    scale: str
    channels: str
    medium: str
    form: str
    fetch: str
    lobes: str

    @property
    def microsurface(self) -> bool:
        """Whether light may bounce between the facets of an interface, as in the truth of that name."""
        return self.reflectance == "fgd-multi"

    @property
    @abstractmethod
    def surrogate(self) -> Model:
        """This model, or the nearest one in closed form."""

    @property
    @abstractmethod
    def without_tir(self) -> Model:
        """The nearest model in closed form that knows no total internal reflection."""

    @abstractmethod
    def allowed(self, key: str) -> tuple[str, ...]:
        """Allowed values of a switch."""

    @abstractmethod
    def body(self, material: Material, variance: type[Variance], context: Context) -> Body:
        """The BSDF of a material with constants of a renderer."""

    def lit(self, material: Material, wi: Direction) -> Callable[[Any], Body]:
        """Reflection of light from directions wi, (M,) each, by a material with values of NumPy: the body for those of
        given numbers, (N,)."""
        from velatura.model.context import Context
        from velatura.model.variance import variance_kind

        found = self.body(material, variance_kind(material), Context())
        return lambda which: found

    @abstractmethod
    def statistics(self, material: Material, wi: Direction) -> StackLobes:
        """The lobes of a material with values in NumPy, for directions wi, (N,) each."""

    def over_wavelengths(
        self,
        material: Material,
        spectral: Callable[[], Material],
        places: Any,
        variance: type[Variance],
        context: Context,
    ) -> Any:
        """A uniform material for the wavelengths of rays, by its values at `places` on the spectrum, which `spectral`
        gives; None, unless a model says otherwise, where it is prepared at every point."""
        return None

    def textured(
        self, material: Material, ranges: Any, symbolic: Any, variance: type[Variance], context: Context, known: Any
    ) -> Any:
        """A material with textures of values in `ranges`, and `symbolic` inputs for what is differentiated, tabulated
        over them; None, unless a model says otherwise, where it is prepared at every point. What `known` has in common
        is used again."""
        return None

    @property
    @abstractmethod
    def pointwise(self) -> Model:
        """The model by which uniform materials are prepared at every point, and those that spread no light."""

    def with_switches(self: M, /, **switches: str) -> M:
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
        own = {key: value for key, value in switches.items() if len(self.allowed(key)) > 1}
        return self.replaced(**own)

    def replaced(self: M, **values: str) -> M:
        """This model with other values of its fields."""
        return dataclasses.replace(self, **values)  # type: ignore[type-var]
