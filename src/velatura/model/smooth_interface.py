"""Fresnel's laws at an interface, which all engines share."""

from __future__ import annotations

from dataclasses import dataclass, field

from velatura import ops
from velatura.films.of_material import films_of
from velatura.films.reflectance import Films, InterfaceFilms
from velatura.ops import Value
from velatura.optics import fresnel
from velatura.stack import InterfaceValues, Material
from velatura.stack.chain import Meeting, chain


@dataclass(frozen=True)
class SmoothInterface(ops.NamedFields):
    """An interface between media of indices eta_1 above and eta_2 below (colours; kappa None for a dielectric).

    `eta` = eta_2/eta_1 and `kappa` = k_2/eta_1 are None for a mirror, which reflects all light. `n12` is that of means
    over the channels: one refracted direction for all colours.
    """

    eta: Value | None
    kappa: Value | None
    n12: Value
    films: Films | None = field(default=None, kw_only=True)

    @classmethod
    def of(cls, meeting: Meeting) -> SmoothInterface:
        """The interface of a layer, but for its roughness."""
        layer, above = meeting.layer, meeting.above
        assert isinstance(layer, InterfaceValues)
        eta = layer.eta / above if layer.kind != "mirror" else None
        kappa = layer.k / above if layer.kind == "conductor" else None
        n12 = ops.mean(layer.eta) / ops.mean(above) if layer.kind == "dielectric" else 1.0
        return SmoothInterface(eta, kappa, n12, films=meeting.films)

    @property
    def opaque(self) -> bool:
        return self.eta is None or self.kappa is not None

    def reflect(self, cos_theta: Value) -> Value:
        """Fresnel reflectance of its facets."""
        if self.eta is None:
            return 1.0
        if self.films:
            if self.opaque and isinstance(self.films, InterfaceFilms):
                return self.films.at(cos_theta, self.eta)
            return self.films.between(cos_theta, fresnel.cos_transmitted(cos_theta, self.n12), self.eta)
        if self.kappa is None:
            return fresnel.dielectric(cos_theta, self.eta)
        return fresnel.conductor(cos_theta, self.eta, self.kappa)

    def reflect_together(self, cos2: Value) -> Value:
        """Like `reflect`, by the square of the cosine, with the one refracted direction: all colours are totally
        reflected from the same angle on."""
        if self.eta is None or self.kappa is not None or self.films:
            return self.reflect(ops.sqrt(cos2))
        return fresnel.dielectric_together(cos2, self.n12, self.eta)

    def pass_together(self, cos2: Value) -> Value:
        """Transmittance of the facets of a dielectric, likewise."""
        if self.films:
            cos_theta = ops.sqrt(cos2)
            return self.films.passing(cos_theta, fresnel.cos_transmitted(cos_theta, self.n12), self.eta)
        return 1 - self.reflect_together(cos2)

    def absorb(self, cos_theta: Value) -> Value:
        """Absorption by films on the facets of a dielectric."""
        return 1 - self.reflect(cos_theta) - self.pass_together(cos_theta * cos_theta)

    def reflect_back(self, cos_theta: Value, cos_t: Value) -> Value:
        """Fresnel reflectance of the facets of a dielectric with films from below, for cosines on both sides."""
        assert self.films
        return self.films.reversed().between(cos_t, cos_theta, self.eta)


def smooth_interfaces(material: Material) -> list[SmoothInterface]:
    """The interfaces of a material from the top."""
    each = chain(material, films_of(material))
    return [SmoothInterface.of(meeting) for meeting in each if isinstance(meeting.layer, InterfaceValues)]
