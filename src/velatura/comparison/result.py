"""The result of a comparison, and the distances between models and the reference that follow from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from velatura.model.guards import ALPHA_MIN
from velatura.reference import WalkedLobe
from velatura.results import Fields, Result, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.floating]

#: Lobes of less energy (mean of the colours) do not count in `Comparison.roughness_error`.
ENERGY_MIN = 1e-3

#: Name of the truth without polarisation, beside one with it.
UNPOLARISED = "unpolarised"

# A lobe's quantities, and whether their components (rgb, uv, ...) stand before the directions.
_FIELDS = {"energy": True, "alpha": True, "rotation": False, "mean": True, "covariance": True}


@dataclass(frozen=True, repr=False)
class Account(Fields):
    """The distribution of light for N directions of incidence, by a model or by the truth.

    reflected: lobes by the deepest interface from the top, a diffuse base last (NaN of a plugin, which has no lobes);
    transmitted: the light that leaves below, a lobe for each stack that transmits. Their mean and covariance are those
    of the outgoing directions on the projected disc, and a model's alpha is that along the axes of the true lobe,
    wherever its own `rotation` has turned them. evaluated (3, N): the integral of `eval`, which is the rendered albedo.
    distribution (3, N, bins, bins): energies of reflected light over x and y of the projected disc. remainder (3, N):
    the energy of reflected light in no lobe.
    """

    reflected: tuple[WalkedLobe, ...]
    transmitted: tuple[WalkedLobe, ...]
    evaluated: Array
    distribution: Array
    remainder: Array | float = 0.0

    @property
    def albedo(self) -> Array:
        """The energy of all reflected light, (3, N)."""
        return np.sum([lobe.energy for lobe in self.reflected], axis=0) + self.remainder

    @property
    def lobes(self) -> tuple[WalkedLobe, ...]:
        """All lobes, those transmitted last."""
        return self.reflected + self.transmitted

    @classmethod
    def mixed(cls, shares: Sequence[float], each: Sequence[Account]) -> Account:
        """The account of a mixture: the lobes of every stack, and sums of all light, by their shares."""

        def lobes(name: str) -> tuple[WalkedLobe, ...]:
            pairs = ((share, lobe) for share, account in zip(shares, each) for lobe in getattr(account, name))
            return tuple(replace(lobe, energy=share * lobe.energy) for share, lobe in pairs)

        def total(name: str) -> Any:
            return sum(share * getattr(account, name) for share, account in zip(shares, each))

        evaluated, distribution, remainder = map(total, ("evaluated", "distribution", "remainder"))
        return cls(lobes("reflected"), lobes("transmitted"), evaluated, distribution, remainder)


@dataclass(frozen=True, repr=False)
class Pictures(Fields):
    """Spheres in linear RGB (height, width, 3), by the truth and by model.

    noise: the part of a root mean square error that is the truth's own noise.
    """

    truth: Array
    noise: float
    models: Mapping[str, Array]

    def rmse(self, model: str) -> float:
        """Root mean square difference between a model's picture and the truth's, over pixels and colours."""
        return float(np.sqrt(np.mean((self.models[model] - self.truth) ** 2)))


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """A material by the truth and by each model.

    name: of the material; lobe_names: "R1", "R2", ... from the top, "D" for a diffuse base, "T" for what is
    transmitted, in a mixture after their part; cos_theta: the N cosines of incidence; paths: of the truth, for each;
    microsurface: whether light scatters many times between its facets; polarised: whether the truth's facets polarise
    it, with the truth that leaves this out among the models, as `UNPOLARISED`; standard_error: of the truth's lobes, in
    their order; noise (N,): the part of a total variation that is the truth's own noise.
    """

    name: str
    lobe_names: tuple[str, ...]
    cos_theta: tuple[float, ...]
    paths: int
    microsurface: bool
    polarised: bool
    truth: Account
    standard_error: tuple[WalkedLobe, ...]
    noise: Array
    models: Mapping[str, Account]
    pictures: Pictures | None = None

    @property
    def albedo_error(self) -> Array:
        """Standard error of the truth's albedo (3, N), an upper bound: a path adds to one lobe only."""
        errors = [error.energy for error, _ in zip(self.standard_error, self.truth.reflected)]
        return np.sqrt(np.sum(np.square(errors), axis=0))

    @cached_property
    def total_variation(self) -> Mapping[str, Array]:
        """Half the light that is in the wrong place, over all light that the truth reflects, (N,) by model.

        Places are the bins of the projected disc and energies are those of all colours together. 0 is perfect; a
        model that reflects nothing has 0.5, one with all light in wrong bins has 1.
        """
        p = self.truth.distribution.mean(axis=0)
        total = np.maximum(p.sum(axis=(1, 2)), 1e-12)
        apart = {name: np.abs(model.distribution.mean(axis=0) - p) for name, model in self.models.items()}
        return {name: 0.5 * difference.sum(axis=(1, 2)) / total for name, difference in apart.items()}

    @cached_property
    def roughness_error(self) -> Mapping[str, float]:
        """Mean `|log(alpha / true alpha)|` by model, over directions, axes, and lobes of an energy above `ENERGY_MIN`.

        Roughness is clamped to the least one that a model evaluates. NaN if there is no such lobe.
        """
        return {name: float(np.mean(self._log_ratios(model))) for name, model in self.models.items()}

    def as_tables(self) -> list[Table]:
        """The lobes by direction and model; all that is reflected; and a row per model."""
        return [self._lobe_table(), self._whole_table(), self._model_table()]

    def brief(self) -> list[Table]:
        """A row per model."""
        return [self._model_table(f"{self.name or 'material'}: models against the truth, {self.paths} paths")]

    def plot(self) -> list[Axes]:
        """A new figure of lobes, total variation, the plane of incidence, and spheres if there are any; its axes.

        Raises:
            MissingTool: the extra `plots` is not installed.
        """
        from velatura.comparison import figure

        return list(figure.shown(self).axes)

    def _lobe_table(self) -> Table:
        turned = any((lobe.rotation != 0).any() for lobe in self.truth.reflected)
        numbers = ("energy", "alpha", *(["rotation"] if turned else []))
        rows: list[Sequence[str] | None] = []
        for i, cosine in enumerate(self.cos_theta):
            for k, name in enumerate(self.lobe_names):
                true, error = self.truth.lobes[k], self.standard_error[k]
                energy = f"{_cell(true.energy, i)}{_plus_minus(error.energy, i)}"
                alpha = f"{_cell(true.alpha, i, 4)}{_plus_minus(error.alpha, i)}"
                rows.append((f"{cosine:g}", name, "truth", energy, alpha, *_rotation(true, i, turned)))
                for model, account in self.models.items():
                    lobe = account.lobes[k]
                    cells = _cell(lobe.energy, i), _cell(lobe.alpha, i, 4), *_rotation(lobe, i, turned)
                    rows.append(("", "", model, *cells))
            rows.append(None)
        return Table(self.name or "material", ("cos", "lobe", "", *numbers), rows, numbers)

    def _whole_table(self) -> Table:
        numbers = ("albedo", "as evaluated", "total variation")
        rows: list[Sequence[str] | None] = []
        for i, cosine in enumerate(self.cos_theta):
            albedo = f"{_cell(self.truth.albedo, i)}{_plus_minus(self.albedo_error, i)}"
            rows.append((f"{cosine:g}", "truth", albedo, "", f"noise {self.noise[i]:.4f}"))
            for model, account in self.models.items():
                variation = _number(self.total_variation[model][i])
                rows.append(("", model, _cell(account.albedo, i), _cell(account.evaluated, i), variation))
            rows.append(None)
        return Table("All that is reflected", ("cos", "", *numbers), rows, numbers)

    def _model_table(self, title: str = "") -> Table:
        shown = self.pictures
        numbers = ["mean |log(alpha/true)|", "mean total variation"]
        numbers += [f"picture RMSE (noise {shown.noise:.4f})"] if shown else []
        rows = []
        for model in self.models:
            values = [self.roughness_error[model], float(self.total_variation[model].mean())]
            values += [shown.rmse(model)] if shown else []
            rows.append((model, *map(_number, values)))
        return Table(title, ("model", *numbers), rows, numbers)

    def _log_ratios(self, model: Account) -> Array:
        ratios: list[float] = []
        for lobe, true in zip(model.lobes, self.truth.lobes):
            smoothest = [np.maximum(alpha, ALPHA_MIN) for alpha in (lobe.alpha, true.alpha)]
            error = np.abs(np.log(smoothest[0] / smoothest[1]))[:, true.energy.mean(axis=0) > ENERGY_MIN]
            ratios.extend(error[np.isfinite(error)])
        return np.array(ratios or [np.nan])

    def to_dict(self) -> dict[str, Any]:
        """All numbers but the distributions and pictures, for JSON; unknown values are None.

        Inner lists run over `cos`, as in the JSON of `velatura lobes`.
        """
        names = self.lobe_names
        errors = {name: _lobe_dict(error) for name, error in zip(names, self.standard_error)}
        truth = {
            **_account_dict(names, self.truth),
            "standard_error": {"lobes": errors, "albedo": _plain(self.albedo_error.T)},
            "noise": _plain(self.noise),
            "picture_noise": self.pictures and self.pictures.noise,
        }
        models = {
            name: {
                **_account_dict(names, model),
                "roughness_error": _plain(self.roughness_error[name]),
                "total_variation": _plain(self.total_variation[name]),
                "rmse": self.pictures and self.pictures.rmse(name),
            }
            for name, model in self.models.items()
        }
        about = {"material": self.name, "cos": list(self.cos_theta), "paths": self.paths}
        kind = {"microsurface": self.microsurface, "polarised": self.polarised}
        return {**about, **kind, "truth": truth, "models": models}


def _account_dict(names: tuple[str, ...], account: Account) -> dict[str, Any]:
    lobes = {name: _lobe_dict(lobe) for name, lobe in zip(names, account.lobes)}
    return {"lobes": lobes, "albedo": _plain(account.albedo.T), "evaluated": _plain(account.evaluated.T)}


def _lobe_dict(lobe: WalkedLobe) -> dict[str, Any]:
    return {
        field: _plain(getattr(lobe, field).T if turned else getattr(lobe, field)) for field, turned in _FIELDS.items()
    }


def _plain(values: Any) -> Any:
    """Nested lists of numbers, None for those that are not finite."""
    if np.ndim(values):
        return [_plain(value) for value in values]
    return float(values) if np.isfinite(values) else None


def _cell(values: Any, i: int, digits: int = 3) -> str:
    """The components of a quantity in direction i; one of them where they are all the same."""
    numbers = [_number(x, digits) for x in values[:, i]]
    return numbers[0] if len(set(numbers)) == 1 else " ".join(numbers)


def _plus_minus(errors: Any, i: int) -> str:
    """The largest standard error."""
    error = errors[:, i].max()
    return "" if np.isnan(error) else f" ± {error:.1g}"


def _rotation(lobe: WalkedLobe, i: int, shown: bool) -> list[str]:
    rotation = np.degrees(lobe.rotation[i])
    return [] if not shown else ["-"] if np.isnan(rotation) else [f"{rotation:.0f}°"]


def _number(x: float, digits: int = 4) -> str:
    return "-" if np.isnan(x) else f"{x:.{digits}f}"
