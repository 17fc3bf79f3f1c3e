"""Reflectance and transmittance of an interface, with thin films or without."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from velatura import ops
from velatura.ops import Value
from velatura.optics import fresnel


class Films(ABC):
    """The thin films on an interface, by what these reflect and transmit."""

    known = False  # whether there is a table that may be looked at now

    @property
    @abstractmethod
    def absorbs(self) -> bool:
        """Whether less may pass than is not reflected."""

    @abstractmethod
    def reversed(self) -> Films:
        """The films seen from below."""

    @abstractmethod
    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Reflectance for cosines above and below, 0 where light cannot be; a colour of the kind of `like`."""

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Transmittance for the same arguments."""
        return 1 - self.between(cos_1, cos_2, like)

    def between_either(self, where: Value, other: Films, cos_1: Value, cos_2: Value, like: Value) -> Value:
        """Reflectance of these films where a condition holds, else of others."""
        return ops.select(where, self.between(cos_1, cos_2, like), other.between(cos_1, cos_2, like))

    @staticmethod
    def selected(condition: Value, yes: Films | None, no: Films | None) -> Either:
        """The films `yes` where a condition holds, else `no`, for `ops.select_record`."""
        return Either(condition, yes, no)


class InterfaceFilms(Films):
    """The films of one interface, as a renderer or NumPy has their values."""

    @abstractmethod
    def at(self, cosine: Value, like: Value) -> Value:
        """Reflectance for the cosine above of an opaque interface, or on the rarer side of one that absorbs nothing."""

    @abstractmethod
    def shares(self, above: Value, cosine: Value, cos_t: Value, like: Value) -> tuple[Value, Value]:
        """Reflectance and transmittance of light from above where the condition holds, else from below; for cosines on
        its own side and beyond."""


@dataclass(frozen=True)
class Either(Films):
    """The films `a` where a condition holds, else `b`; None without any."""

    where: Value
    a: Films | None
    b: Films | None

    @property
    def absorbs(self) -> bool:
        return True

    def reversed(self) -> Either:
        return Either(self.where, *(x and x.reversed() for x in (self.a, self.b)))

    def between(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        if self.a and self.b:
            return self.a.between_either(self.where, self.b, cos_1, cos_2, like)
        return ops.select(self.where, *(dielectric_between(x, cos_1, cos_2, like) for x in (self.a, self.b)))

    def passing(self, cos_1: Value, cos_2: Value, like: Value) -> Value:
        if any(absorbs(x) for x in (self.a, self.b)):
            return ops.select(self.where, *(dielectric_passing(x, cos_1, cos_2, like) for x in (self.a, self.b)))
        return super().passing(cos_1, cos_2, like)


def dielectric_between(films: Films | None, cos_1: Value, cos_2: Value, eta: Value) -> Value:
    """Reflectance of a dielectric with films, for cosines above and below: as `fresnel.dielectric_between`."""
    return films.between(cos_1, cos_2, eta) if films else fresnel.dielectric_between(cos_1, cos_2, eta)


def dielectric_passing(films: Films | None, cos_1: Value, cos_2: Value, eta: Value) -> Value:
    """Transmittance of a dielectric with films, for the same arguments."""
    return films.passing(cos_1, cos_2, eta) if films else 1 - fresnel.dielectric_between(cos_1, cos_2, eta)


def absorbs(films: Films | None) -> bool:
    """Whether films may absorb, as far as is known."""
    return films is not None and films.absorbs
