"""Descent: the values of a stack whose reflectance over angles comes closest to a table.

All that is free changes at once, by least squares with the model's own derivatives: differences, of all values in one
call of the model. Where a model has no closed form, the nearest one that has stands in for it, corrected at every end;
from the closest end the model itself descends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from velatura.errors import InvalidInput
from velatura.inverse.fitting import angles
from velatura.inverse.fitting.angles import ReflectanceTable, radiance
from velatura.inverse.fitting.free_values import Free, FreeValues, extinction, metals
from velatura.inverse.lobes.partial_stack import Array
from velatura.inverse.local.approach import Secants
from velatura.model import Model, named, variance_kind
from velatura.model.papers import bsdf
from velatura.ops import Value
from velatura.results import Result, Table
from velatura.stack import (
    Material,
    MaterialLike,
    Stack,
    as_described,
    single,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP, STRIDE = 1e-5, 1e-3  # of a value, to see how a model changes: in closed form, and solved anew for each value
MAPPED = 3  # readings by a model without a closed form, between descents of the one that stands in for it
# Readings of its own descent, from the closest end, and from a start that is close, for each value that changes
LAST, ALONE = 3, 5
MOST = 70  # of these readings
# Rounds of a descent in closed form, of one that stands in for another model, and for how many values these are
ROUNDS, STANDING, FEW_VALUES = 100, 25, 16
TOLERANCE = 1e-9  # relative change in a round where it ends
OUTSIDE = 1e3  # errors where there is no material
AS_WELL, EXACT = 1.05, 1e-6  # of the smallest error, and beside it: other stacks fit as well
LIKELY, DRAWN = 0.95, 4000  # the probability of an interval, and the points that it is taken from
SHARED = 1.25  # by which it is wider, for errors of the model that all angles share, as walked stacks ask for
FIRST, DARK = 10.0, 1e-3  # weight of energies beside all else, and energies that have no hue
LEAST = 1e-4  # error that a table is taken to have: no model is known better
FEW = 4  # angles of incidence; where there are fewer, directions have as many groups at each
TRADED = 0.9  # correlation of parameters that trade places


@dataclass(frozen=True)
class Estimate:
    """A parameter of a fitted stack, by flat name (and channel, r, g or b), and the interval that is likely to hold it.

    The interval is one of 95 %, from how the parameter changes where an angle of incidence is left out: so it holds the
    errors of the model as well as noise. A parameter that the table does not determine has its whole range.
    """

    name: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Other:
    """Another stack that approximates a table about as well, and its error."""

    stack: Stack
    error: float


@dataclass(frozen=True, repr=False)
class Fit(Result):
    """A stack that approximates a table, and its error.

    error: root mean square of the difference of log(1 + f cos theta_o); of a simplification together with ten times
    that of energies, as shares, which is what descends. by_angle: as `angles.report` has it. errors:
    the results of the descents from all starts, the best first. estimates: of the parameters that were free. trades:
    pairs of them with their correlation, where that is strong: one makes up for a change of the other. others: stacks
    outside these intervals, or of another form, that fit about as well. energies: of a simplification, for every angle
    of incidence all that is reflected, before and after.
    """

    stack: Stack
    model: Model
    error: float
    by_angle: list[dict[str, float]]
    errors: list[float]
    estimates: list[Estimate] = field(default_factory=list)
    trades: list[tuple[str, str, float]] = field(default_factory=list)
    others: list[Other] = field(default_factory=list)
    energies: list[dict[str, Any]] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """The report of a fit as JSON has it."""
        return {
            "stack": self.stack.to_dict(),
            "error": self.error,
            "by_angle": self.by_angle,
            "errors": self.errors,
            **({"energies": self.energies} if self.energies else {}),
            "parameters": [vars(estimate) for estimate in self.estimates],
            "trades": [{"between": list(pair), "correlation": r} for *pair, r in self.trades],
            "others": [{"stack": other.stack.to_dict(), "error": other.error} for other in self.others],
        }

    def as_tables(self) -> list[Table]:
        """Rows of angles of incidence with their errors, and of parameters with their intervals; of a simplification
        also of energies before and after."""
        columns = ("angle of incidence", "f cos, rms", "error, rms", "relative")
        rows = [
            (f"{row['theta_i']:g}°", f"{row['wanted']:.4g}", f"{row['error']:.2g}", f"{row['relative']:.2%}")
            for row in self.by_angle
        ]
        title = f"{self.stack.name or 'stack'} ({self.model.name}), error {self.error:.2g}"
        tables = [Table(title, columns, rows, columns)]
        if self.energies:
            energies = [
                (f"{row['theta_i']:g}°", *(" ".join(f"{x:.4f}" for x in row[key]) for key in ("before", "after")))
                for row in self.energies
            ]
            right = ("before", "after")
            tables.append(Table("Energy that is reflected", ("angle of incidence", *right), energies, right))
        if self.estimates:
            estimates = [(one.name, *(f"{x:.4g}" for x in (one.value, one.low, one.high))) for one in self.estimates]
            ends = ("value", "from", "to")
            tables.append(Table("What the table says of each (95 %)", ("parameter", *ends), estimates, ends))
        return tables

    def plot(self, table: ReflectanceTable, title: str = "", figure: Figure | None = None) -> Figure:
        """The stack beside the table that it approximates, at some angles of incidence; below the intervals of its
        parameters and their correlations, or the energies of a simplification.

        Args:
            figure: one of Matplotlib's to draw on, a new one by default.

        Raises:
            MissingTool: the extra `plots` is not installed.
        """
        from velatura.inverse import plots

        figure = figure or plots.new_figure(13, 9)
        plots.draw_fit(figure, table, self, title or self.stack.name or "fit")
        return figure


def fit(
    table: ReflectanceTable,
    starts: Sequence[MaterialLike],
    model: str | Model,
    eta_max: float = 4.0,
    simpler: Callable[[Stack], Sequence[Stack]] = lambda stack: (),
) -> Fit:
    """The closest of the stacks found by descents from all starts (stacks, files, or presets' names).

    Args:
        simpler: starts of other forms than that of the closest stack, which may fit as well.

    Raises:
        InvalidInput: not a valid material, an unknown model, or a texture in a start, which has no one value.
    """
    model = named(model)
    best, *rest = ends = descended(table, starts, model, eta_max)
    by_angle = angles.report(table, angles.table_of(best.stack, table.directions, model))
    estimates, trades = best.estimated()
    found = [best]
    for end in sorted([*rest, *descended(table, simpler(best.stack), model, eta_max)], key=lambda end: end.error):
        if end.error <= AS_WELL * best.error + EXACT and all(end.apart(other) for other in found):
            found.append(end)
    others = [Other(end.stack, end.error) for end in found[1:]]
    return Fit(best.stack, model, best.error, by_angle, [end.error for end in ends], estimates, trades, others)


def descended(
    table: ReflectanceTable,
    starts: Sequence[MaterialLike],
    model: Model,
    eta_max: float,
    darkest: float = 0.0,
    films: bool = True,
) -> list[End]:
    """The ends of descents from all starts, the closest first; `films`: whether these change.

    No model stands in for another one where there are films, whose averages take as long as the solution.
    """
    stacks = [single(start, "fit") for start in starts]
    coated = [start for start in stacks if any(start.films)]
    ends = [
        Descent(table=table, start=start, model=model, eta_max=eta_max, darkest=darkest, films=films).run(ALONE)
        for start in coated
    ]
    bare = [start for start in stacks if not any(start.films)]
    rounds = ROUNDS if model.closed_form else STANDING
    ends += [
        Descent(table=table, start=start, model=model.surrogate, eta_max=eta_max, darkest=darkest)
        .run(rounds=rounds)
        .of(model)
        for start in bare
    ]
    ends.sort(key=lambda end: end.cost)
    if ends and not model.closed_form and not any(ends[0].descent.start.films):
        ends[0] = ends[0].descent.run(LAST)
    return ends


@dataclass(frozen=True)
class End:
    """End of a descent: a point (free,), and its residuals."""

    descent: Descent
    x: Array
    residuals: Array

    @property
    def cost(self) -> float:
        """The sum of the squares of the residuals."""
        return float(np.sum(self.residuals**2))

    @cached_property
    def error(self) -> float:
        """The root mean square of errors of log(1 + f cos), together with FIRST times that of energies."""
        return float(np.sqrt(self.cost / self.descent.wanted.size))

    @cached_property
    def stack(self) -> Stack:
        """The material, without clear media."""
        stack, kept = self.descent.placed(self.x)
        return stack.with_layers(stack.layers[n] for n in kept)

    def of(self, model: Model) -> End:
        """The end for a model without a closed form, near that for the one which stands in for it.

        What the two differ by at one end is added to the residuals of the next descent: space mapping
        (Bandler et al. 1994), of residuals in place of parameters. Where slopes differ, it ends beside the minimum.
        """
        if model.closed_form:
            return self
        end = self
        for _ in range(MAPPED):
            near, own = end.afresh(end.descent.model), end.afresh(model)
            end = replace(near.descent, gap=own.residuals - near.residuals).run(rounds=STANDING)
        return end.afresh(model)

    def afresh(self, model: Model) -> End:
        """The beginning of a descent from here by a model itself."""
        return replace(self.descent, start=self.descent.placed(self.x)[0], model=model, gap=0.0).start_end

    def apart(self, other: End) -> bool:
        """Whether it has another form than another end, or a value outside the intervals of that one."""
        if [replace(free, low=0, high=0) for free in self.descent.free] != [
            replace(free, low=0, high=0) for free in other.descent.free
        ]:
            return True
        return bool(np.any(np.abs(self.x - other.x) > 2 * np.sqrt(np.diag(other.covariance)) + EXACT))

    def estimated(self) -> tuple[list[Estimate], list[tuple[str, str, float]]]:
        """The parameters of the stack with their intervals, and those that trade places."""
        free, (_, kept) = self.descent.free, self.descent.placed(self.x)
        names = {n: one.name(kept.index(one.layer)) for n, one in enumerate(free) if one.layer in kept}
        found, drawn = self.descent.values(self.x[None])[0], self.descent.values(self._drawn())
        within = np.quantile(drawn, [(1 - LIKELY) / 2, (1 + LIKELY) / 2], axis=0)
        estimates = [
            Estimate(name, *(one.rounded(x) for x in (found[n], min(low, found[n]), max(high, found[n]))))
            for n, (one, (low, high)) in enumerate(zip(free, within.T))
            if (name := names.get(n))
        ]
        of_noise = np.linalg.inv(self.information)
        sigma = np.sqrt(np.diag(of_noise))
        correlation = of_noise / np.outer(sigma, sigma)
        pairs = [(a, b) for a, b in combinations(names, 2) if abs(correlation[a, b]) > TRADED]
        pairs.sort(key=lambda pair: -abs(correlation[pair]))
        return estimates, [(names[a], names[b], float(correlation[a, b])) for a, b in pairs]

    def _drawn(self) -> Array:
        """Points (DRAWN, free) within the bounds, as likely as the covariance makes them."""
        rng, bounds = np.random.default_rng(0), [one.bounds for one in self.descent.free]
        return np.clip(rng.multivariate_normal(self.x, self.covariance, DRAWN), *np.transpose(bounds))

    @cached_property
    def slopes(self) -> Array:
        """Derivatives of the residuals, (3 N, free)."""
        return self.descent.jacobian(self.x)

    @property
    def variance(self) -> float:
        """Variance of the residuals."""
        count, free = self.slopes.shape
        return max(float(np.sum(self.residuals**2)) / max(count - free, 1), LEAST**2)

    @cached_property
    def information(self) -> Array:
        """Information about the coordinates, (free, free), as a multiple of the inverse variance of the residuals.

        By the table, and by the bounds: as much as an even distribution between them has.
        """
        known = np.diag([12 / np.ptp(one.bounds) ** 2 for one in self.descent.free])
        return np.asarray(self.slopes.T @ self.slopes + self.variance * known)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the coordinates, (free, free), by leaving out one group of directions after the other.

        So it holds the errors of the model, which are alike within a group, as well as noise: a jackknife, linearised
        (Bell & McCaffrey 2002), as wide as Student's distribution asks of so few, and wider by SHARED. A coordinate
        that the table does not determine is as uncertain as its bounds leave it.
        """
        from scipy.stats import norm, t

        slopes, residuals, information, groups = self.slopes, self.residuals, self.information, self.descent.groups
        moved = []
        for group in np.unique(groups):
            own = groups == group
            moved.append(np.linalg.solve(information - slopes[own].T @ slopes[own], slopes[own].T @ residuals[own]))
        few = len(moved) - 1
        noise = self.variance * np.linalg.inv(information)
        if not few:
            return np.asarray(noise)
        wider = (t.ppf((1 + LIKELY) / 2, few) / norm.ppf((1 + LIKELY) / 2)) ** 2
        alike = np.transpose(moved) @ np.array(moved) * few / (few + 1)
        return np.asarray(SHARED**2 * (wider * alike + noise))


@dataclass(frozen=True, kw_only=True)
class Descent(FreeValues):
    """A descent from one stack. gap: added to all residuals, (3 N,)."""

    table: ReflectanceTable
    model: Model
    gap: Array | float = 0.0

    @property
    def slow(self) -> bool:
        """Whether one point is read at a time."""
        return not self.model.closed_form or any(self.start.films)

    @cached_property
    def wanted(self) -> Array:
        return angles.compressed(self.table.value * self.table.directions.wo[2])

    @cached_property
    def groups(self) -> NDArray[np.intp]:
        """The group of each residual: its angle of incidence, and where there are few, how near it is to the mirror."""
        theta_i, tilt = angles.grouped(self.table.directions.theta_i), self.table.directions.tilt
        _, which = np.unique(theta_i, return_inverse=True)
        if which.max() + 1 < FEW:
            which = FEW * which.ravel() + np.searchsorted(np.quantile(tilt, np.arange(1, FEW) / FEW), tilt)
        return np.asarray(np.tile(which.ravel(), 3))

    @cached_property
    def start_end(self) -> End:
        """The start, as far as it lies within the bounds."""
        return End(self, self.first, self.residuals(self.first[None])[0])

    def run(self, readings: int = ALONE, rounds: int = ROUNDS) -> End:
        """The end of the descent, after a number of rounds at most, or, where one point is read at a time, of readings
        for each value, MOST at most."""
        best = self._by_secants(min(readings * len(self.free), MOST)) if self.slow else self._by_rounds(rounds)
        return replace(best, x=self._smaller_first(best.x))

    def _by_rounds(self, rounds: int) -> End:
        """The end that many points at once lead to: fewer rounds where there are many values."""
        from scipy.optimize import least_squares

        bounds = np.transpose([free.bounds for free in self.free])
        first = self.start_end
        inset = 1e-9 * (bounds[1] - bounds[0])
        with np.errstate(divide="ignore", invalid="ignore"):  # of SciPy's step where all coordinates lie on bounds
            found = least_squares(
                lambda x: self.residuals(x[None])[0],
                np.clip(first.x, bounds[0] + inset, bounds[1] - inset),
                jac=self.jacobian,
                bounds=bounds,
                x_scale=self.scale,
                xtol=TOLERANCE,
                ftol=TOLERANCE,
                gtol=None,
                max_nfev=max(rounds * FEW_VALUES // max(len(self.free), FEW_VALUES), 2),
            )
        # Keep the start where the descent has gained nothing
        return first if first.cost <= found.cost else End(self, found.x, found.fun)

    def _by_secants(self, readings: int) -> End:
        first, (low, high) = self.start_end, np.transpose([free.bounds for free in self.free])
        secants = Secants(
            lambda x: self.residuals(x[None])[0],
            lambda x, residuals: self._differences(End(self, x, residuals)),
            self.scale,
            low,
            high,
        )
        return End(self, *secants.nearest(first.x, first.residuals, readings))

    def residuals(self, x: Array) -> Array:
        """Residuals at P points x (P, free), (P, 3 N): `missed`, and the gap."""
        if self.slow:
            return np.array([self._read(one) for one in x])
        material = self.material
        for n, free in enumerate(self.free):
            layer, shown = material.layers[free.layer], free.shown(x[:, n, None])
            changed = {key: _changed(getattr(layer, key), free, shown) for key in free.keys}
            material = material.with_layer(free.layer, **changed)
        variance = variance_kind(Material.of(self.start, as_described))
        seen = bsdf.body(metals(material, lambda layer: extinction(layer.eta, layer.k)), self.model, variance)
        return self.missed(len(x), *radiance(seen, self.table.directions)) + self.gap

    def _read(self, x: Array) -> Array:
        """Errors of the material at one point (free,), in the form of `missed`."""
        try:
            if not np.isfinite(x).all():  # SciPy's step where all coordinates lie on bounds
                raise InvalidInput("no material")
            found = angles.table_of(self.placed(x)[0], self.table.directions, self.model, with_energy=True)
        except InvalidInput:  # also a rough interface with films between equal indices
            lit = 0 if self.table.energy is None else 3 * self.table.directions.incidence[0].size
            return np.full(self.wanted.size + lit, OUTSIDE)
        assert found.energy is not None
        return self.missed(1, (found.value * self.table.directions.wo[2])[:, None], found.energy[:, None])[0]

    def missed(self, count: int, value: Value, energy: Value) -> Array:
        """Errors of log(1 + f cos), (P, 3 N), of a number P of points (Low et al. 2012).

        Where energies count, their errors follow, (P, 3 A): those of every angle of incidence, of the mean azimuth, as
        shares of the energy there, so that the hue counts in dark channels too, and weighted so that they come first.
        """

        def apart(value: Value, wanted: Array) -> Array:
            found = np.broadcast_to(value, (3, count, wanted.shape[-1])) - wanted[:, None]
            return np.moveaxis(found, 0, 1).reshape(count, -1)

        found = apart(np.log1p(value), self.wanted)
        if self.table.energy is None:
            return found
        _, mean = self.table.directions.incidence
        wanted = self.table.energy @ mean
        energy = np.broadcast_to(energy, (3, count, len(mean))) @ mean
        scale = np.mean(wanted, axis=0) + DARK
        weight = FIRST * np.sqrt(self.wanted.size / wanted.size)
        return np.concatenate([found, weight * apart(energy / scale, wanted / scale)], axis=1)

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals, (3 N, free)."""
        if self.slow:
            return self._differences(End(self, x, self.residuals(x[None])[0]))
        steps = STEP * np.eye(len(x))
        ahead, behind = np.split(self.residuals(np.concatenate([x + steps, x - steps])), 2)
        return ((ahead - behind) / (2 * STEP)).T

    def _differences(self, end: End) -> Array:
        """The same at a point that is read, to one side, within the bounds."""
        high = np.array([free.bounds[1] for free in self.free])
        stride = np.where(end.x + STRIDE > high, -STRIDE, STRIDE)
        return ((self.residuals(end.x + np.diag(stride)) - end.residuals) / stride[:, None]).T

    def _smaller_first(self, x: Array) -> Array:
        """The same point, turned interfaces with the smaller roughness along their first axis, turned by 0 to 180."""
        x, of = x.copy(), {(free.layer, free.keys): n for n, free in enumerate(self.free)}
        for (layer, keys), n in of.items():
            if keys == ("rotation",):
                u, v = (of[layer, (key,)] for key in ("alpha_u", "alpha_v"))
                if x[u] > x[v]:
                    x[u], x[v], x[n] = x[v], x[u], x[n] + 90
                x[n] %= 180
        return x


def _changed(value: Value, free: Free, x: Array) -> Value:
    """A value at several points, (P, 1) of a number, in all or one of the channels of a colour."""
    if np.ndim(value) == 0:
        return x
    if free.channel is None:
        return x[None]
    own = np.broadcast_to(value, (3, *x.shape)).copy()
    own[free.channel] = x
    return own
