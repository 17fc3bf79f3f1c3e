"""A stack that is dragged towards other lobes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from velatura.inverse.coats import scattered
from velatura.inverse.lobes.interface import ENERGY_MIN
from velatura.inverse.lobes.partial_stack import Above, Array, Layers
from velatura.inverse.lobes.target import Target, kind_of
from velatura.inverse.local.approach import Approach
from velatura.inverse.local.coordinates import (
    SLACK,
    SMOOTH,
    Bound,
    InterfaceCoordinates,
    Point,
    Reader,
    Space,
    plain,
    retinted,
    rounded,
)
from velatura.inverse.local.newton import Compromise, Problem
from velatura.inverse.reasons import UNMET
from velatura.model import Model
from velatura.model.registry import stack_lobes
from velatura.model.variance import Roughness
from velatura.stack import Diffuse, Interface, Layer, Stack, Varying

ASIDE = (-0.02, 0.05, -0.1, 0.2)  # by which free choices change, one after the other, to lead past a jump
SAME = 1e-6  # energies and roughnesses that are as asked


@dataclass(frozen=True)
class DraggedStack:
    """A stack as a point in the space of its coordinates, and the target whose lobes it has.

    tail: layers below the last interface, which are kept. diffuse: energy of a diffuse base among them, None where
    there is none, or it has a texture.
    """

    point: Point
    target: Target
    tail: tuple[Layer, ...] = ()
    name: str = ""
    diffuse: tuple[float, ...] | None = None

    # From and to materials -------------------------------------------------------------------------------------------

    @classmethod
    def of(cls, stack: Stack, target: Target, model: Model, with_pins: bool = False) -> DraggedStack | None:
        """The stack with its interfaces assigned to the lobes of a target; None if these do not match.

        with_pins: also where more is fixed than a drag can keep, as `nearest` does.

        Raises:
            InvalidInput: a layer that no target can have.
        """
        layers = plain(stack)
        if len(layers) != sum(lobe.interfaces for lobe in target.lobes):
            return None
        if not with_pins and target.pinned:
            return None
        reader = Reader(
            target, model, kind_of([*(lobe.axes for lobe in target.lobes), *(part.roughness for part in layers)])
        )
        for k, lobe in enumerate(target.lobes):
            own, layers = layers[: lobe.interfaces], layers[lobe.interfaces :]
            if [part.kind for part in own] != ["dielectric"] * (lobe.interfaces - 1) + [lobe.base]:
                return None
            if any(asked is not None and asked != part.films for asked, part in zip(lobe.fixed.films, own)):
                return None
            for n, part in enumerate(own):
                reader.add(k, n, part)
        last = max(n for n, layer in enumerate(stack.layers) if isinstance(layer, Interface))
        tail = stack.layers[last + 1 :]
        diffuse = None
        if tail and isinstance(tail[-1], Diffuse) and not isinstance(tail[-1].albedo, Varying):
            diffuse = tuple(scattered(stack, model).tolist())
        return cls(Point(reader.space, np.array(reader.x)), target, tail, stack.name, diffuse)

    @cached_property
    def stack(self) -> Stack:
        """The material."""
        parts = zip(map(self._rounded, self.point.layers), self.interfaces)
        layers = [layer for part, own in parts for layer in part.written(0, own.axis)]
        return Stack([*layers, *self.tail], name=self.name, exterior=self.space.exterior)

    def _rounded(self, part: Layers) -> Layers:
        """The interface, its index within bounds where only rounding takes it out of these."""
        within = np.clip(part.eta, 1.0, self.target.eta_max)
        near = part.kind == "dielectric" and np.abs(np.log(part.eta / within)).max() <= SLACK
        return dataclasses.replace(part, eta=within) if near else part

    def at(self, x: Array | None = None, space: Space | None = None) -> DraggedStack:
        """The stack at another point, or in another space."""
        return dataclasses.replace(self, point=Point(space or self.space, self.point.x if x is None else x))

    def rounded(self, digits: int) -> DraggedStack:
        """The stack by numbers of so many digits."""
        interfaces = tuple(each.rounded(digits) for each in self.space.interfaces)
        return self.at(rounded(self.point.x, digits), dataclasses.replace(self.space, interfaces=interfaces))

    def renamed(self, target: Target) -> DraggedStack:
        """The stack, as what has the lobes of another target of this form."""
        return dataclasses.replace(self, target=target)

    def in_closed_form(self) -> DraggedStack:
        """The same stack and its lobes, read by the model with a closed form."""
        model = self.model.without_tir
        if model == self.model and not self.space.slow:
            return self
        seen = self.at(space=dataclasses.replace(self.space, model=model, quick=True))
        return seen.renamed(seen.now(self.target))

    @property
    def quickly(self) -> DraggedStack:
        """The same stack, as the nearest model reads it that adds up layers, films known roughly."""
        return self.at(space=self.space.quickly)

    @property
    def rough(self) -> bool:
        """Whether its lobes are approximate."""
        return self.space.factors is not None

    def known(self, lobes: Target) -> DraggedStack:
        """The same stack, its lobes known: what the model reads is scaled to be those."""
        read, wanted = self.point.reading.value, self.space.goal(lobes)
        factors = wanted / np.where(np.abs(read) > ENERGY_MIN, read, np.inf)
        factors = np.where(factors > 0, factors, 1.0)
        return self.at(space=dataclasses.replace(self.space, factors=factors))

    def tinted(self) -> DraggedStack:
        """The stack with the tints that its target asks for, where that fixes no index of the conductor."""
        interfaces = list(self.interfaces)
        for n, own in enumerate(interfaces):
            lobe = self.target.lobes[own.lobe]
            if own.kind == "conductor" and all(lobe.fixed.of(key, lobe.interfaces - 1) is None for key in ("eta", "k")):
                tint = retinted(own.tint, float(np.mean(own.tint)), lobe.tint)
                interfaces[n] = dataclasses.replace(own, tint=tint)
        return self.at(space=dataclasses.replace(self.space, interfaces=tuple(interfaces)))

    # What it is, and what the model reads ----------------------------------------------------------------------------

    @property
    def space(self) -> Space:
        """The space of its coordinates."""
        return self.point.space

    @property
    def model(self) -> Model:
        """The model that reads it."""
        return self.space.model

    @property
    def interfaces(self) -> tuple[InterfaceCoordinates, ...]:
        """The interfaces from the top."""
        return self.space.interfaces

    @property
    def scatters(self) -> bool:
        """Whether a medium scatters, which stays where it is."""
        return any(own.scatters is not None for own in self.interfaces)

    @property
    def smooth(self) -> bool:
        """Whether all interfaces are smooth, where no reading shows how blurs would follow."""
        return all(np.abs(self.point.x[own.variance]).max() < SMOOTH for own in self.interfaces)

    @property
    def variances(self) -> Array:
        """The variances of the interfaces' lobes, (interfaces, entries), as the model reads them."""
        return self.point.reading.value[3 * self.space.lobes :].reshape(len(self.interfaces), -1)

    def now(self, wish: Target) -> Target:
        """The present lobes, in the form of a target."""
        return self.space.target_of(self.point.reading.value, wish)

    def of_stack(self, stack: Stack) -> Target:
        """The lobes of a stack of this form itself, also where bounds keep it from being a point."""
        found = stack_lobes(stack, 1.0, model=self.model)
        roughnesses = [Roughness(alpha[0], alpha[1], rotation) for alpha, rotation in zip(found.alpha, found.rotation)]
        reading = self.space.sorted(self.point.x[:, None], list(zip(found.energy, roughnesses)))[:, 0]
        return self.space.target_of(reading, self.target)

    def snapped(self, wish: Target) -> Target:
        """The present lobes, in the form of a target; its own where they differ by rounding."""
        now = self.now(wish)
        for k, (lobe, asked) in enumerate(zip(now.lobes, wish.lobes)):
            if np.abs(np.subtract(lobe.colour, asked.colour)).max() < SAME:
                now = now.with_lobe(k, energy=asked.energy)
            elif np.ptp(lobe.colour) < SAME:
                now = now.with_lobe(k, energy=float(np.mean(lobe.colour)))
            if np.abs(np.subtract(lobe.axes, asked.axes)).max() < SAME:
                now = now.with_lobe(k, alpha=asked.alpha, variance=asked.variance, rotation=asked.rotation)
        return now

    def indices(self, n: int) -> tuple[Array, Array | None]:
        """Absolute eta and k of the n-th interface, (3, 1) or (1, 1)."""
        part = self.point.layers[n]
        return part.eta, part.kappa

    def index_above(self, n: int) -> float:
        """Index of the medium above the n-th interface."""
        return float(self.indices(n - 1)[0][0, 0]) if n else self.space.exterior

    def above(self, n: int) -> Above:
        """The layers above the n-th interface, and what scatters there."""
        above = Above.nothing(self.model, self.space.exterior, self.space.kind)
        for part in self.point.layers[:n]:
            above, _ = above.below(part)
        return above.scattered(self.point.layers[n])

    def point_of(self, k: int) -> list[float]:
        """The point of the member in the class of a lobe."""
        point = []
        for own, part in zip(self.interfaces, self.point.layers):
            if own.lobe == k and own.kind != "mirror":
                point.append(float(part.eta[0, 0]) if own.kind == "dielectric" else float(np.mean(own.tint)))
        return point

    def depths_of(self, k: int) -> list[Array]:
        """Optical depths (3,) of the media above the interfaces of a lobe."""
        layers = [part for own, part in zip(self.interfaces, self.point.layers) if own.lobe == k]
        return [np.broadcast_to(part.tau, (3, 1))[:, 0] for part in layers]

    def tint_by(self, n: int, channel: int, tint: float) -> float:
        """The mean tint of the n-th interface when one channel has this one."""
        own = self.interfaces[n].tint
        return float(np.mean(retinted(own, float(own[channel, 0]), tint)))

    # Towards other lobes ---------------------------------------------------------------------------------------------

    def met(self, wish: Target, giving: bool = True, effort: int = 1) -> DraggedStack | Bound:
        """The stack with the lobes of a target of the same form, or the bound that is in the way.

        giving: whether kept coordinates may change at bounds. effort: as `Problem.solve`.
        """
        problem = Problem(self.point, self.space.goal(wish))
        found = self.solved(problem) if giving else problem.solve(effort=effort)
        if isinstance(found, Bound):
            return found
        met = dataclasses.replace(self, point=found, target=wish)
        counted = self.space.counted
        for aside in () if not self.space.slow or not effort else ASIDE:
            beside = None if met.missed(wish, counted) < SAME else met._beside(aside)
            if beside is None:
                break
            other = Problem(beside.point, problem.goal).solve()
            if isinstance(other, Point):
                tried = dataclasses.replace(beside, point=other, target=wish)
                met = min(met, tried, key=lambda stack: stack.missed(wish, counted))
        return met

    def _beside(self, aside: float) -> DraggedStack | None:
        """The stack with free choices off by a little, which leads past a jump of readings; None without any."""
        x = self.point.x.copy()
        for n, own in enumerate(self.interfaces):
            if own.depth is not None:
                x[own.depth] += abs(aside)
            if own.log_index is not None and self._is_free(n):
                x[own.log_index] += abs(aside) if x[own.log_index] < abs(aside) else aside
        x = self.space.clipped(x)
        return None if np.array_equal(x, self.point.x) else self.at(x)

    def nearest(self, wish: Target, loose: Sequence[tuple[int, str]], readings: int) -> DraggedStack:
        """The stack whose lobes come nearest to a target of the same form, and that keeps what is fixed there.

        loose: the "energy" or "blur" of which lobes may change; others stay, as far as they can.
        readings: the most that it takes.
        """
        may = np.zeros(len(self.point.reading.value), bool)
        for k, what in loose:
            if what == "energy":
                may[3 * k : 3 * k + 3] = True
        spans = may[3 * self.space.lobes :].reshape(len(self.interfaces), -1)
        for span, own in zip(spans, self.interfaces):
            span[:] = (own.lobe, "blur") in loose
        held, caps = self.constant(wish)
        point = Approach(self.point, self.space.goal(wish), may, held, caps).solve(readings)
        return dataclasses.replace(self, point=point)

    def constant(self, target: Target) -> tuple[list[int], list[tuple[int, int]]]:
        """Coordinates that stay since values of a target are fixed, and those that stay below others.

        Indices stay with those of all interfaces above, which they are relative to.
        """
        held, caps, x = list[int](), list[tuple[int, int]](), self.point.x
        settled = max((k for k, lobe in enumerate(target.lobes) if lobe.fixes_last), default=-1)
        for n, own in enumerate(self.interfaces):
            lobe, above = target.lobes[own.lobe], own.lobe <= settled
            place = self._place(n)
            if lobe.fixed.of("alpha", place) is not None:
                held += range(own.variance.start, own.variance.stop)
            if own.log_index is not None and (above or lobe.fixed.of("eta", place) is not None):
                held.append(own.log_index)
            depth = lobe.fixed.of("tau", place) is not None
            if own.depth is not None and depth:
                held.append(own.depth)
            if own.reflectances is not None and above:
                span = list(range(own.reflectances.start, own.reflectances.stop))
                most = span[own.reference] if own.films else max(span, key=lambda c: x[c])
                if own.kind == "dielectric" and not depth:
                    caps += [(c, most) for c in span if c != most]
                    span = [most]
                held += span
        return held, caps

    def _place(self, n: int) -> int:
        """The place of the n-th interface in its lobe."""
        return n - min(m for m, other in enumerate(self.interfaces) if other.lobe == self.interfaces[n].lobe)

    def _is_free(self, n: int) -> bool:
        """Whether the index of the n-th interface is not fixed."""
        return self.target.lobes[self.interfaces[n].lobe].fixed.of("eta", self._place(n)) is None

    def missed(self, wish: Target, which: Array | slice = slice(None)) -> float:
        """The largest difference of its energies and variances, or `which` of them, from those of a target."""
        return float(np.max(np.abs(self.point.reading.value - self.space.goal(wish))[which]))

    @property
    def coloured(self) -> bool:
        """Whether films alone colour the first lobe, so that its energy in one channel gives those in the others."""
        first = self.interfaces[0]
        return bool(first.films) and first.kind == "dielectric" and first.log_index is None

    def achromatic(self, wish: Target) -> Target:
        """A wish, its first lobe without what needs absorption where nothing may absorb: colours, a mirror's energy."""
        first = self.interfaces[0]
        if first.absorbs or first.log_index is not None or first.kind == "conductor" or first.films:
            return wish
        now, own = self.point.reading.value[:3], np.array(wish.lobes[0].colour)
        if first.kind == "mirror":
            return wish if np.max(np.abs(now - own)) < SLACK else wish.with_lobe(0, energy=tuple(now.tolist()))
        passes = now if np.min(now) > ENERGY_MIN else np.exp(-2 * np.broadcast_to(first.kept, (3, 1))[:, 0])
        possible = passes * np.mean(own / passes)
        return wish if np.max(np.abs(possible - own)) < SLACK else wish.with_lobe(0, energy=tuple(possible.tolist()))

    def solved(self, problem: Problem, held: Sequence[int] = ()) -> Point | Bound:
        """The stack that meets the goal; at a bound, kept coordinates change if they can."""
        found = problem.solve()
        if isinstance(found, Point) or found.reason in UNMET:
            return found
        for coordinate in self._giving(found, held):
            other = problem.solve(Compromise(found, coordinate))
            if isinstance(other, Point):
                return other
        return found

    def _giving(self, bound: Bound, held: Sequence[int]) -> list[int]:
        """Kept coordinates that may change at a bound: those of the nearest lobe first."""
        found = []
        for n, own in reversed([each for each in enumerate(self.interfaces) if each[1].lobe <= bound.lobe]):
            if own.depth is not None and (self.point.x[own.depth] > 0 or own.films) and np.any(own.kept):
                found.append(own.depth)
            if own.log_index is not None and self._is_free(n):
                found.append(own.log_index)
        return [coordinate for coordinate in found if coordinate not in held]


def seen(stack: Stack, target: Target, model: Model, quick: bool = False) -> Target:
    """A target with the energies and blurs that a stack of its form has; `quick`: by the nearest model that adds up
    layers, films known roughly."""
    dragged = DraggedStack.of(stack, target.freed(), model)
    assert dragged is not None
    space = dragged.space.quickly if quick else dragged.space
    return dragged.space.target_of(space.read(dragged.point.x[:, None])[:, 0], target)


def with_depth(target: Target, k: int, depth: Array | None) -> Target:
    """A target with the optical depth (3,) of the medium above a lobe held fixed, not held where it is 0 or None."""
    lobe = target.lobes[k]
    tau: tuple[Any, ...] = ()
    if depth is not None and np.any(depth > 0):
        tau = (tuple(depth.tolist()), *[None] * (lobe.interfaces - 1))
    fixed = lobe.fixed.model_copy(update={"tau": tau})
    return target.with_lobe(k, fixed=fixed)
