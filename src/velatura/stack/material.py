"""The values of a material as typed records, in any dialect: floats, arrays, a renderer's numbers, recorded symbols.

Files, command lines, renderers and shaders address single values by flat names (`layer0_eta`); nothing else does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, TypeAlias

from velatura.stack.layers import Kind
from velatura.stack.stack import Stack

Value: TypeAlias = Any


@dataclass(frozen=True)
class InterfaceValues:
    """A dielectric, a conductor or a mirror: GGX roughness along two axes, turned by `rotation` (degrees), and absolute
    indices of what lies below; a mirror has none, and a dielectric no extinction `k`.
    """

    kind: Kind
    alpha_u: Value
    alpha_v: Value
    rotation: Value
    eta: Value = None
    k: Value = None


@dataclass(frozen=True)
class MediumValues:
    """A medium: thickness, coefficients per unit of length, and the mean cosine of the scattering angle."""

    kind: ClassVar[Kind] = "medium"
    depth: Value
    sigma_a: Value
    sigma_s: Value
    g: Value


@dataclass(frozen=True)
class DiffuseValues:
    """A diffuse base, by its albedo."""

    kind: ClassVar[Kind] = "diffuse"
    albedo: Value


LayerValues: TypeAlias = InterfaceValues | MediumValues | DiffuseValues

_SURFACE = ("alpha_u", "alpha_v", "rotation")
#: By kind: the record, and those of its fields that are values.
_RECORDS: dict[Kind, tuple[type[LayerValues], tuple[str, ...]]] = {
    "dielectric": (InterfaceValues, ("eta", *_SURFACE)),
    "conductor": (InterfaceValues, ("eta", "k", *_SURFACE)),
    "mirror": (InterfaceValues, _SURFACE),
    "medium": (MediumValues, tuple(field.name for field in fields(MediumValues))),
    "diffuse": (DiffuseValues, tuple(field.name for field in fields(DiffuseValues))),
}


@dataclass(frozen=True)
class Material:
    """Layers from the top, and the index of the medium above them; `thin` for a pane with that medium below it, too."""

    layers: tuple[LayerValues, ...]
    exterior: Value
    thin: bool = False

    @classmethod
    def of(cls, stack: Stack, value: Callable[[str, Any], Value] = lambda name, value: value) -> Material:
        """The values of a stack, each as `value(flat name, value)` converts it."""
        values = {name: value(name, described) for name, described in stack.flat().items()}
        return cls.from_flat(stack.kinds, values, stack.thin)

    @classmethod
    def from_flat(cls, kinds: Sequence[Kind], values: Mapping[str, Value], thin: bool = False) -> Material:
        """Values by flat name, as `Stack.flat` has them."""
        layers: list[LayerValues] = []
        for i, kind in enumerate(kinds):
            record, keys = _RECORDS[kind]
            own = {key: values[f"layer{i}_{key}"] for key in keys}
            layers.append(InterfaceValues(kind, **own) if record is InterfaceValues else record(**own))
        return cls(tuple(layers), values["exterior"], thin)

    def flat(self) -> dict[str, Value]:
        """All values by flat name."""
        values = {"exterior": self.exterior}
        for i, layer in enumerate(self.layers):
            values |= {f"layer{i}_{key}": getattr(layer, key) for key in _RECORDS[layer.kind][1]}
        return values

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The kinds of the layers from the top."""
        return tuple(layer.kind for layer in self.layers)

    @property
    def interfaces(self) -> tuple[InterfaceValues, ...]:
        """The interfaces from the top."""
        return tuple(layer for layer in self.layers if isinstance(layer, InterfaceValues))

    @property
    def transmits(self) -> bool:
        """Whether light passes: the last layer is a dielectric."""
        return bool(self.layers) and self.layers[-1].kind == "dielectric"

    @property
    def below(self) -> Value:
        """Index of the medium below a material that transmits."""
        last = self.layers[-1]
        assert isinstance(last, InterfaceValues)
        return self.exterior if self.thin else last.eta

    def with_layer(self, n: int, **values: Value) -> Material:
        """The material with values of its n-th layer changed."""
        layers = list(self.layers)
        layers[n] = replace(layers[n], **values)
        return replace(self, layers=tuple(layers))

    def solid(self) -> Material:
        """The same layers with the index below written into the last one, where the material is a thin pane."""
        return replace(self.with_layer(-1, eta=self.exterior), thin=False) if self.thin else self

    def reversed(self) -> Material:
        """Dielectrics and media as seen from below.

        Directions are mirrored with them, so that tangents and rotations stay as they are.
        """
        solid, layers = self.solid(), []
        above = solid.exterior
        for layer in solid.layers:
            if isinstance(layer, InterfaceValues):
                layer, above = replace(layer, eta=above), layer.eta
            layers.append(layer)
        return Material(tuple(reversed(layers)), above)
