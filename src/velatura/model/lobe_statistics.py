"""Statistics of lobes as records of NumPy arrays, and how the axes of a lobe are named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from velatura.model.variance import Roughness
from velatura.stack import Material

FAINTLY_BRUSHED = 0.01  # difference of two roughnesses, below which an interface hardly has axes


@dataclass(frozen=True)
class LobeStatistics:
    """One lobe, for N directions and C channels.

    energy (C, N); covariance (3, N): xx, xy, yy in the space of the model's roughness map, in the shading frame;
    alpha (2, N) along two axes, the first turned from the tangent by rotation (N,), radians anticlockwise; own_alpha
    (2, N) and own_rotation (N,) likewise, in the medium that the lobe is drawn in. With `channels=separate` all but the
    energy have a leading axis of channels.
    """

    energy: np.ndarray
    covariance: np.ndarray
    alpha: np.ndarray
    rotation: np.ndarray
    own_alpha: np.ndarray
    own_rotation: np.ndarray


@dataclass(frozen=True)
class StackLobes:
    """Reflected lobes as lists over interfaces from the top, and the transmitted lobe (None below an opaque base).

    For C channels and N directions, remainder (C, N) is what is reflected in no lobe, passed (C, N) all that leaves
    below, absorbed (C, N) the rest of the light.
    """

    energy: list[np.ndarray]
    covariance: list[np.ndarray]
    alpha: list[np.ndarray]
    rotation: list[np.ndarray]
    own_alpha: list[np.ndarray]
    own_rotation: list[np.ndarray]
    transmitted: LobeStatistics | None
    remainder: np.ndarray
    passed: np.ndarray
    absorbed: np.ndarray

    @classmethod
    def of(
        cls, reflected: Sequence[LobeStatistics], transmitted: LobeStatistics | None, remainder: np.ndarray
    ) -> StackLobes:
        """All light but what is reflected and transmitted is absorbed."""
        passed = transmitted.energy if transmitted else np.zeros_like(remainder)
        left = 1 - remainder - passed - sum(lobe.energy for lobe in reflected)
        lists = {field.name: [getattr(lobe, field.name) for lobe in reflected] for field in fields(LobeStatistics)}
        return cls(**lists, transmitted=transmitted, remainder=remainder, passed=passed, absorbed=np.maximum(left, 0))

    @property
    def parts(self) -> list[StackLobes]:
        """These lobes alone, as those of a mixture with one part."""
        return [self]

    def times(self, share: float) -> StackLobes:
        """The same lobes with a share of the light."""
        below = self.transmitted
        return replace(
            self,
            energy=[share * energy for energy in self.energy],
            transmitted=below and replace(below, energy=share * below.energy),
            remainder=share * self.remainder,
            passed=share * self.passed,
            absorbed=share * self.absorbed,
        )


@dataclass(frozen=True)
class MixtureLobes:
    """The lobes of all stacks of a mixture, in `parts`, with energies times the shares of these.

    Lists run over the reflected lobes of all parts, one after the other, and `transmitted` over parts that transmit;
    remainder, passed and absorbed (C, N) are sums.
    """

    parts: list[StackLobes]

    @property
    def energy(self) -> list[np.ndarray]:
        return self._each("energy")

    @property
    def covariance(self) -> list[np.ndarray]:
        return self._each("covariance")

    @property
    def alpha(self) -> list[np.ndarray]:
        return self._each("alpha")

    @property
    def rotation(self) -> list[np.ndarray]:
        return self._each("rotation")

    @property
    def own_alpha(self) -> list[np.ndarray]:
        return self._each("own_alpha")

    @property
    def own_rotation(self) -> list[np.ndarray]:
        return self._each("own_rotation")

    @property
    def transmitted(self) -> list[LobeStatistics]:
        return [part.transmitted for part in self.parts if part.transmitted]

    @property
    def remainder(self) -> np.ndarray:
        return np.sum([part.remainder for part in self.parts], axis=0)

    @property
    def passed(self) -> np.ndarray:
        return np.sum([part.passed for part in self.parts], axis=0)

    @property
    def absorbed(self) -> np.ndarray:
        return np.sum([part.absorbed for part in self.parts], axis=0)

    def _each(self, name: str) -> list[np.ndarray]:
        return [lobe for part in self.parts for lobe in getattr(part, name)]


def nearer_axis(material: Material, isotropic: np.ndarray) -> np.ndarray:
    """Azimuths (N,) to which the first axis of a lobe is the nearer one.

    They are the mean axis of the interfaces, by how anisotropic each is, so that axes keep their names where a value
    changes by little; `isotropic` where none is.
    """
    double = FAINTLY_BRUSHED * np.exp(2j * isotropic)
    for layer in material.interfaces:
        double = double + abs(layer.alpha_u - layer.alpha_v) * np.exp(2j * np.radians(layer.rotation))
    return 0.5 * np.angle(double)


def with_axes_named(roughness: Roughness, axis: ArrayLike) -> Roughness:
    """The same roughness with the axis first that is nearer to a given one."""
    u, v, rotation = roughness
    other = np.cos(2 * (rotation - axis)) < 0
    across = rotation - np.copysign(0.5 * np.pi, rotation)
    return Roughness(np.where(other, v, u), np.where(other, u, v), np.where(other, across, rotation))
