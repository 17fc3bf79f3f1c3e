"""Statistics of lobes as records of NumPy arrays, and how the axes of a lobe are named."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura.errors import InvalidInput, needs
from velatura.model.variance import Roughness
from velatura.optics.ggx import Direction
from velatura.results import Result, Table, numbers
from velatura.stack import Material

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset

Array: TypeAlias = NDArray[np.float64]

FAINTLY_BRUSHED = 0.01  # difference of two roughnesses, below which an interface hardly has axes
LEAST = 0.00005  # energy that a table does not round to 0

# A lobe's quantities, and what their components are, which stand before the directions; empty of single numbers.
FIELDS = {
    "energy": "channel",
    "alpha": "axis",
    "rotation": "",
    "covariance": "entry",
    "own_alpha": "axis",
    "own_rotation": "",
}
OTHER_LIGHT = ("remainder", "passed", "absorbed")


@dataclass(frozen=True)
class LobeStatistics:
    """One lobe, for N directions and C channels.

    energy (C, N); covariance (3, N): xx, xy, yy in the space of the model's roughness map, in the shading frame;
    alpha (2, N) along two axes, the first turned from the tangent by rotation (N,), radians anticlockwise; own_alpha
    (2, N) and own_rotation (N,) likewise, in the medium that the lobe is drawn in. With `channels=separate` all but the
    energy have a leading axis of channels.
    """

    energy: Array
    covariance: Array
    alpha: Array
    rotation: Array
    own_alpha: Array
    own_rotation: Array


class Lobes(Result):
    """Lobes for N directions of incidence and C channels, which show themselves as a table.

    Attributes:
        incident: (3, N), unit vectors.
        remainder, passed, absorbed: (C, N), reflected in no lobe, all that leaves below, the rest of the light.
    """

    incident: Array
    remainder: Array

    @property
    @abstractmethod
    def named(self) -> dict[str, LobeStatistics]:
        """The lobes: "R1", "R2", ... from the top, "T" of what leaves below, in a mixture after their part."""

    @property
    def cos_theta(self) -> Array:
        """Cosines of incidence (N,)."""
        return self.incident[2]

    @property
    def phi(self) -> Array:
        """Azimuths of incidence (N,), radians from the tangent; 0 along the normal."""
        return np.arctan2(self.incident[1], self.incident[0])

    @property
    def other_light(self) -> dict[str, Array]:
        """Light in no lobe, by name, (C, N) each; what passes is in one where something leaves below."""
        below = any(name.endswith("T") for name in self.named)
        return {name: getattr(self, name) for name in OTHER_LIGHT if not (below and name == "passed")}

    def as_tables(self, title: str = "Lobes") -> list[Table]:
        """A row per direction and lobe, then all other light by name."""
        rows: list[tuple[str, ...] | None] = []
        for i, cosine in enumerate(self.cos_theta):
            for name, lobe in self.named.items():
                energy, alpha, rotation = (x[..., i] for x in (lobe.energy, lobe.alpha, np.degrees(lobe.rotation)))
                degrees = f"{numbers(rotation, '.1f')}°"
                rows.append((f"{cosine:g}", name, numbers(energy), numbers(alpha), degrees))
            for name, energy in self.other_light.items():
                if energy[..., i].max() >= LEAST:
                    rows.append((f"{cosine:g}", name, numbers(energy[..., i])))
            rows.append(None)
        right = ("energy", "alpha", "rotation")
        return [Table(title, ("cos", "lobe", *right), rows, right)]

    def to_dict(self) -> dict[str, Any]:
        """All numbers as nested lists, directions outside the components of each: (..., 2, N) becomes (..., N, 2)."""

        def plain(lobe: LobeStatistics) -> dict[str, Any]:
            values = {name: getattr(lobe, name) for name in FIELDS}
            return {name: (x.swapaxes(-1, -2) if FIELDS[name] else x).tolist() for name, x in values.items()}

        reflected = [plain(lobe) for name, lobe in self.named.items() if not name.endswith("T")]
        below = [plain(lobe) for name, lobe in self.named.items() if name.endswith("T")]
        return {
            "cos": self.cos_theta.tolist(),
            "reflected": reflected,
            "transmitted": self._below(below),
            **{name: getattr(self, name).T.tolist() for name in OTHER_LIGHT},
        }

    @staticmethod
    @abstractmethod
    def _below(found: list[Any]) -> Any:
        """The lobes that leave below, as `transmitted` holds them."""

    def to_xarray(self) -> Dataset:
        """All numbers with names: dimensions `lobe`, `channel`, `direction`, `axis` and `entry` (xx, xy, yy).

        Raises:
            MissingTool: the extra `sweep` is not installed.
        """
        with needs("sweep"):
            import xarray

        data: dict[str, Any] = {}
        for name, component in FIELDS.items():
            values = np.array([getattr(lobe, name) for lobe in self.named.values()])
            own = [component] if component else []
            separate = ["channel"] * (values.ndim - len(own) - 2)  # one roughness for each, `channels=separate`
            data[name] = ["lobe", *separate, *own, "direction"], values
        data |= {name: (("channel", "direction"), getattr(self, name)) for name in OTHER_LIGHT}
        channels = ["r", "g", "b"] if len(self.remainder) == 3 else range(len(self.remainder))
        coordinates = {
            "lobe": list(self.named),
            "channel": list(channels),
            "axis": ["u", "v"],
            "entry": ["xx", "xy", "yy"],
            "cos_theta": ("direction", self.cos_theta),
            "phi": ("direction", self.phi),
        }
        return xarray.Dataset(data, coordinates)

    def to_dataframe(self) -> DataFrame:
        """A row per direction and lobe: energies by channel, roughness along two axes, and its rotation.

        Raises:
            InvalidInput: a roughness for each channel (`channels=separate`), which `to_xarray` holds.
            MissingTool: the extra `sweep` is not installed.
        """
        with needs("sweep"):
            import pandas

        rows = []
        for name, lobe in self.named.items():
            if lobe.alpha.ndim > 2:
                raise InvalidInput("to_dataframe: not of lobes with a roughness for each channel; write to_xarray()")
            for i, cosine in enumerate(self.cos_theta):
                energies = {f"energy_{channel}": x[i] for channel, x in zip("rgb", lobe.energy)}
                (u, v), rotation = lobe.alpha[:, i], lobe.rotation[i]
                at = {"cos_theta": cosine, "phi": self.phi[i], "lobe": name}
                rows.append({**at, **energies, "alpha_u": u, "alpha_v": v, "rotation": rotation})
        return pandas.DataFrame(rows)

    def plot(self, axes: Sequence[Axes] | None = None) -> Sequence[Axes]:
        """Energy (mean of the colours) and roughness of all lobes over the angle of incidence.

        Args:
            axes: two of Matplotlib's to draw on, side by side in a new figure by default.

        Raises:
            MissingTool: the extra `plots` is not installed.
        """
        with needs("plots"):
            from matplotlib import pyplot
        drawn = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")[1] if axes is None else axes
        degrees = np.degrees(np.arccos(np.minimum(self.cos_theta, 1.0)))
        order = np.argsort(degrees)
        for n, (name, lobe) in enumerate(self.named.items()):
            drawn[0].plot(
                degrees[order], lobe.energy.mean(axis=0)[order], "o-", color=f"C{n}", markersize=3, label=name
            )
            for alpha, style in zip(np.moveaxis(lobe.alpha, -2, 0), ("o-", "o--")):
                mean = alpha.reshape(-1, alpha.shape[-1]).mean(axis=0)
                drawn[1].plot(degrees[order], mean[order], style, color=f"C{n}", markersize=3)
        for (name, energy), style in zip(self.other_light.items(), (":", "--", "-.")):
            if energy.max() >= LEAST:
                drawn[0].plot(degrees[order], energy.mean(axis=0)[order], style, color="0.4", label=name)
        drawn[0].set(title="energy", xlabel="angle of incidence (°)", ylabel="share of the light", ylim=(0, None))
        drawn[1].set(title="GGX alpha (2nd axis dashed)", xlabel="angle of incidence (°)", ylim=(0, None))
        drawn[0].legend(fontsize="small")
        return drawn


@dataclass(frozen=True, repr=False)
class StackLobes(Lobes):
    """Reflected lobes as lists over interfaces from the top, and the transmitted lobe (None below an opaque base).

    For C channels and N directions, remainder (C, N) is what is reflected in no lobe, passed (C, N) all that leaves
    below, absorbed (C, N) the rest of the light; incident (3, N) the directions of incidence.
    """

    energy: list[Array]
    covariance: list[Array]
    alpha: list[Array]
    rotation: list[Array]
    own_alpha: list[Array]
    own_rotation: list[Array]
    transmitted: LobeStatistics | None
    remainder: Array
    passed: Array
    absorbed: Array
    incident: Array

    @classmethod
    def of(
        cls,
        incident: Direction,
        reflected: Sequence[LobeStatistics],
        transmitted: LobeStatistics | None,
        remainder: Array,
    ) -> StackLobes:
        """All light but what is reflected and transmitted is absorbed."""
        passed = transmitted.energy if transmitted else np.zeros_like(remainder)
        left = 1 - remainder - passed - sum(lobe.energy for lobe in reflected)
        lists: dict[str, Any] = {
            field.name: [getattr(lobe, field.name) for lobe in reflected] for field in fields(LobeStatistics)
        }
        return cls(
            **lists,
            transmitted=transmitted,
            remainder=remainder,
            passed=passed,
            absorbed=np.maximum(left, 0),
            incident=np.array(incident),
        )

    @property
    def parts(self) -> list[StackLobes]:
        """These lobes alone, as those of a mixture with one part."""
        return [self]

    @property
    def named(self) -> dict[str, LobeStatistics]:
        each = zip(*(getattr(self, field.name) for field in fields(LobeStatistics)))
        found = {f"R{k}": LobeStatistics(*values) for k, values in enumerate(each, 1)}
        return found | ({"T": self.transmitted} if self.transmitted else {})

    @staticmethod
    def _below(found: list[Any]) -> Any:
        return next(iter(found), None)

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


@dataclass(frozen=True, repr=False)
class MixtureLobes(Lobes):
    """The lobes of all stacks of a mixture, in `parts`, with energies times the shares of these.

    Lists run over the reflected lobes of all parts, one after the other, and `transmitted` over parts that transmit;
    remainder, passed and absorbed (C, N) are sums. `names` are those of the parts: "part0", "part1 part0", ...
    """

    parts: list[StackLobes]
    names: list[str]

    @property
    def named(self) -> dict[str, LobeStatistics]:
        each = zip(self.names, self.parts)
        return {f"{part} {name}": lobe for part, lobes in each for name, lobe in lobes.named.items()}

    @staticmethod
    def _below(found: list[Any]) -> Any:
        return found

    @property
    def incident(self) -> Array:  # type: ignore[override]
        return self.parts[0].incident

    @property
    def energy(self) -> list[Array]:
        return self._each("energy")

    @property
    def covariance(self) -> list[Array]:
        return self._each("covariance")

    @property
    def alpha(self) -> list[Array]:
        return self._each("alpha")

    @property
    def rotation(self) -> list[Array]:
        return self._each("rotation")

    @property
    def own_alpha(self) -> list[Array]:
        return self._each("own_alpha")

    @property
    def own_rotation(self) -> list[Array]:
        return self._each("own_rotation")

    @property
    def transmitted(self) -> list[LobeStatistics]:
        return [part.transmitted for part in self.parts if part.transmitted]

    @property
    def remainder(self) -> Array:  # type: ignore[override]
        return np.sum([part.remainder for part in self.parts], axis=0)

    @property
    def passed(self) -> Array:
        return np.sum([part.passed for part in self.parts], axis=0)

    @property
    def absorbed(self) -> Array:
        return np.sum([part.absorbed for part in self.parts], axis=0)

    def _each(self, name: str) -> list[Array]:
        return [lobe for part in self.parts for lobe in getattr(part, name)]


def nearer_axis(material: Material, isotropic: Array) -> Array:
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
