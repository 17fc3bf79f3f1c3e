"""A dragged stack: towards other lobes, or to another member of the class of a lobe."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from velatura.inverse.coats import scattered
from velatura.inverse.drag.approach import Approach
from velatura.inverse.drag.coordinates import (
    REFLECTANCE_MAX,
    SLACK,
    Bound,
    InterfaceCoordinates,
    Point,
    Reader,
    Space,
    plain,
    retinted,
)
from velatura.inverse.drag.newton import Compromise, Problem, Solution
from velatura.inverse.interface import CONDUCTOR_MAX, ENERGY_MIN
from velatura.inverse.partial_stack import Above, Array, Layers, named_as
from velatura.inverse.reasons import UNMET
from velatura.inverse.target import Fixed, Target, TargetLobe, kind_of
from velatura.model import Model
from velatura.model.registry import stack_lobes
from velatura.model.roughness_maps import MAPS
from velatura.model.variance import Roughness
from velatura.optics import fresnel
from velatura.stack import Diffuse, Interface, Layer, Stack, Varying

ATTEMPTS = 4  # bounds that are tried on the way, and halves of a step through a class
ASIDE = (-0.02, 0.05, -0.1, 0.2)  # by which free choices change, one after the other, to lead past a jump
SAME = 1e-6  # energies and roughnesses that are as asked
CHANGED = 0.01  # share of an energy or a roughness that a wish changes it by
FAR = 0.1  # share of a wish that is a long way


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
        if not with_pins and any(pinned(lobe, n == 0) for n, lobe in enumerate(target.lobes)):
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
        """With an index that only rounding takes out of bounds."""
        within = np.clip(part.eta, 1.0, self.target.eta_max)
        near = part.kind == "dielectric" and np.abs(np.log(part.eta / within)).max() <= SLACK
        return dataclasses.replace(part, eta=within) if near else part

    def renamed(self, target: Target) -> DraggedStack:
        """With the parts of a target that it has, and no others."""
        return dataclasses.replace(self, target=target)

    def in_closed_form(self) -> DraggedStack:
        """The same stack and its lobes, read by the model with a closed form."""
        model = self.model.without_tir
        if model == self.model and not self.space.slow:
            return self
        point = Point(dataclasses.replace(self.space, model=model, quick=True), self.point.x)
        seen = dataclasses.replace(self, point=point)
        return seen.renamed(seen.now(self.target))

    @property
    def quickly(self) -> DraggedStack:
        """The same stack, as the nearest model reads it that adds up layers, films known roughly."""
        return dataclasses.replace(self, point=Point(self.space.quickly, self.point.x))

    @property
    def rough(self) -> bool:
        """Whether its lobes are approximate."""
        return self.space.factors is not None

    def known(self, lobes: Target) -> DraggedStack:
        """The same stack, its lobes known: what the model reads is scaled to be those."""
        read, wanted = self.point.reading.value, self._wanted(lobes)
        factors = wanted / np.where(np.abs(read) > ENERGY_MIN, read, np.inf)
        factors = np.where(factors > 0, factors, 1.0)
        return dataclasses.replace(self, point=Point(dataclasses.replace(self.space, factors=factors), self.point.x))

    def tinted(self) -> DraggedStack:
        """With the tints that its target asks for, where that fixes no index of the conductor."""
        interfaces = list(self.interfaces)
        for n, own in enumerate(interfaces):
            lobe = self.target.lobes[own.lobe]
            if own.kind == "conductor" and all(lobe.fixed.of(key, lobe.interfaces - 1) is None for key in ("eta", "k")):
                tint = retinted(own.tint, float(np.mean(own.tint)), lobe.tint)
                interfaces[n] = dataclasses.replace(own, tint=tint)
        space = dataclasses.replace(self.space, interfaces=tuple(interfaces))
        return dataclasses.replace(self, point=Point(space, self.point.x))

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
    def variances(self) -> Array:
        """The variances of the interfaces' lobes, (interfaces, entries), as the model reads them."""
        return self.point.reading.value[3 * self.space.lobes :].reshape(len(self.interfaces), -1)

    def now(self, wish: Target) -> Target:
        """The present lobes, in the form of a target."""
        return self._target_of(self.point.reading.value, wish)

    def of_stack(self, stack: Stack) -> Target:
        """The lobes of a stack of this form itself, also where bounds keep it from being a point."""
        found = stack_lobes(stack, 1.0, model=self.model)
        roughnesses = [Roughness(alpha[0], alpha[1], rotation) for alpha, rotation in zip(found.alpha, found.rotation)]
        reading = self.space.sorted(self.point.x[:, None], list(zip(found.energy, roughnesses)))[:, 0]
        return self._target_of(reading, self.target)

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

    def between(self, wish: Target, t: float) -> Target:
        """A target between the present lobes and the wished ones, in energies and variances."""
        now = self.point.reading.value
        return self._target_of(now + t * (self._wanted(wish) - now), wish)

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

    def _target_of(self, reading: Array, form: Target) -> Target:
        """The target of a form with lobes as they are read."""
        count, kind = self.space.lobes, self.space.kind
        variances = reading[3 * count :].reshape(len(self.interfaces), -1)
        for k in range(count):
            s = np.mean([variances[n] for n, own in enumerate(self.interfaces) if own.lobe == k], axis=0)
            roughness = named_as(kind(*s).roughness(MAPS[self.model.map]), form.lobes[k].axes.rotation)
            form = form.with_lobe(k, energy=tuple(reading[3 * k : 3 * k + 3].tolist()))
            form = form.with_roughness(k, roughness)
        return form

    def _wanted(self, wish: Target) -> Array:
        """The reading of the model with which a target is met."""
        f, kind = MAPS[self.model.map], self.space.kind
        s = [np.ravel(list(vars(wish.lobes[own.lobe].blur(f, kind)).values())) for own in self.interfaces]
        return np.concatenate([[max(e, ENERGY_MIN) for lobe in wish.lobes for e in lobe.colour], *s])

    # Towards other lobes ---------------------------------------------------------------------------------------------

    def towards(self, wish: Target) -> tuple[DraggedStack, Bound | None]:
        """The stack with the lobes of a target of the same form, or of one on the way, and the bound that it reaches.

        None for the bound where the target is met.
        """
        found = self.met(wish)
        if isinstance(found, DraggedStack):
            return found, None
        return self._part_of_the_way(wish, self._problem(self._wanted(wish)), found)

    def met(self, wish: Target, giving: bool = True, effort: int = 1) -> DraggedStack | Bound:
        """The stack with the lobes of a target of the same form, or the bound that is in the way.

        giving: whether kept coordinates may change at bounds. effort: as `Problem.solve`.
        """
        problem = self._problem(self._wanted(wish))
        found = self._met(problem) if giving else problem.solve(effort=effort)
        if isinstance(found, Bound):
            return found
        met = self._at(found).renamed(wish)
        for aside in () if not self.space.slow or not effort else ASIDE:
            beside = None if met._off(wish) < SAME else met._beside(aside)
            if beside is None:
                break
            other = beside._problem(problem.goal).solve()
            if isinstance(other, Solution):
                met = min(met, beside._at(other).renamed(wish), key=lambda stack: stack._off(wish))
        return met

    def _beside(self, aside: float) -> DraggedStack | None:
        """The stack with free choices off by a little, which leads past a jump of readings; None without any."""
        x = self.point.x.copy()
        for own in self.interfaces:
            if own.depth is not None:
                x[own.depth] += abs(aside)
            if own.log_index is not None and self.target.lobes[own.lobe].fixed.of("eta", 0) is None:
                x[own.log_index] += abs(aside) if x[own.log_index] < abs(aside) else aside
        x = self.space.clipped(x)
        return None if np.array_equal(x, self.point.x) else dataclasses.replace(self, point=Point(self.space, x))

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
        held, caps = self._constant(wish)
        point = Approach(self.point, self._wanted(wish), may, held, caps).solve(readings)
        return dataclasses.replace(self, point=point)

    def _constant(self, target: Target) -> tuple[list[int], list[tuple[int, int]]]:
        """Coordinates that stay since values of a target are fixed, and those that stay below others.

        Indices stay with those of all interfaces above, which they are relative to.
        """
        held, caps, x = list[int](), list[tuple[int, int]](), self.point.x
        settled = max((k for k, lobe in enumerate(target.lobes) if _fixes_last(lobe)), default=-1)
        for n, own in enumerate(self.interfaces):
            lobe, above = target.lobes[own.lobe], own.lobe <= settled
            place = n - min(m for m, other in enumerate(self.interfaces) if other.lobe == own.lobe)
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

    def missed(self, wish: Target) -> float:
        """The largest difference of its energies and variances from those of a target."""
        return float(np.max(np.abs(self.point.reading.value - self._wanted(wish))))

    def _off(self, wish: Target) -> float:
        """The same of those that coordinates are free for."""
        return float(np.max(np.abs(self.point.reading.value - self._wanted(wish))[self.space.counted]))

    def changes(self, wish: Target) -> list[tuple[int, str]]:
        """The "energy" or "blur" of which lobes a target asks to be others than the present ones."""
        found = []
        for k, (lobe, asked) in enumerate(zip(self.now(wish).lobes, wish.lobes)):
            for what, now, then in (("energy", lobe.colour, asked.colour), ("blur", lobe.axes, asked.axes)):
                if np.abs(np.subtract(now, then)).max() > CHANGED * np.abs(now).max():
                    found.append((k, what))
        return found

    def far(self, wish: Target) -> bool:
        """Whether the lobes of a target are far away."""
        return float(np.max(np.abs(self._problem(self._wanted(wish)).way))) > FAR

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

    def _problem(self, goal: Array) -> Problem:
        return Problem(self.point, goal)

    def _at(self, solution: Solution) -> DraggedStack:
        return dataclasses.replace(self, point=solution.point)

    def _met(self, problem: Problem, held: Sequence[int] = ()) -> Solution | Bound:
        """The stack that meets the goal; at a bound, kept coordinates change if they can."""
        found = problem.solve()
        if isinstance(found, Solution) or found.reason in UNMET:
            return found
        for coordinate in self._giving(found, held):
            other = problem.solve(Compromise(found, coordinate))
            if isinstance(other, Solution):
                return other
        return found

    def _part_of_the_way(self, wish: Target, problem: Problem, bound: Bound) -> tuple[DraggedStack, Bound]:
        """As far towards a wish as one bound after the other allows."""
        for _ in range(ATTEMPTS):
            found = problem.solve(Compromise(bound))
            if isinstance(found, Solution):
                return self._at(found).renamed(self.between(wish, found.part)), bound
            if found == bound:
                break
            bound = found
        return self.renamed(self.now(wish)), bound

    def _giving(self, bound: Bound, held: Sequence[int]) -> list[int]:
        """Kept coordinates that may change at a bound: those of the nearest lobe first."""
        found = []
        for own in reversed([own for own in self.interfaces if own.lobe <= bound.lobe]):
            if own.depth is not None and (self.point.x[own.depth] > 0 or own.films) and np.any(own.kept):
                found.append(own.depth)
            if own.log_index is not None and self.target.lobes[own.lobe].fixed.of("eta", 0) is None:
                found.append(own.log_index)
        return [coordinate for coordinate in found if coordinate not in held]

    # To other members of a class -------------------------------------------------------------------------------------

    def member(
        self, k: int, point: Sequence[float], depths: Mapping[int, Array] | None = None
    ) -> tuple[DraggedStack, Bound | None]:
        """The stack with another member of a lobe's class, or the nearest to it, and then the bound that it reaches.

        point: as `point_of` gives it: free indices of dielectrics from the top, then a conductor's tint.
        depths: optical depths (3,) that media above interfaces of the lobe are to have, by their number in it.
        """
        here, there = np.array(self.point_of(k)), np.array(point, float)
        now = {n: self.depths_of(k)[n] for n in depths or {}}
        found, met, why = self, 0.0, None
        for step in (1.0, *(0.5**n for n in range(1, ATTEMPTS))):
            share = met + step
            if share > 1:
                continue
            tau = {n: now[n] + share * (wanted - now[n]) for n, wanted in (depths or {}).items()}
            moved = found._moved(k, here + share * (there - here), tau)
            if isinstance(moved, Bound):
                why = why or moved
            else:
                found, met = moved, share
            if met == 1:
                return found, None
        return found, why

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

    def _moved(self, k: int, point: Array, depths: Mapping[int, Array]) -> DraggedStack | Bound:
        """With the member of a class at a point; the violated bound if there is none."""
        moved, held, level = self._deepened(k, depths)._placed(k, point)
        problem = moved._problem(self._wanted(self.target))
        if level is not None:
            # Hold the index of the last dielectric, while what absorbs above it gives way, or is clear
            found = problem.solve(level)
            if isinstance(found, Solution):
                return moved._at(found)
            if found.reason != "absorption":
                return found
            assert level.coordinate is not None
            x = moved.point.x.copy()
            x[level.coordinate] = 0.0
            moved = dataclasses.replace(moved, point=Point(moved.space, x))
            problem, held = moved._problem(problem.goal), [*held, level.coordinate]
        met = moved._met(problem, held)
        return moved._at(met) if isinstance(met, Solution) else met

    def _deepened(self, k: int, depths: Mapping[int, Array]) -> DraggedStack:
        """With other optical depths above some interfaces of a lobe, its lobes not yet met.

        What reflects below is as much brighter as the media are darker. The target keeps depths that it holds fixed.
        """
        x, interfaces, target = self.point.x.copy(), list(self.interfaces), self.target
        places = [n for n, own in enumerate(interfaces) if own.lobe == k]
        for n, depth in depths.items():
            own = interfaces[places[n]]
            darker = np.exp(2 * (depth - self.depths_of(k)[n]))
            interfaces[places[n]] = dataclasses.replace(own, kept=depth[:, None])
            if own.depth is not None:
                x[own.depth] = 1.0
            for below in interfaces[places[n] :]:
                if below.reflectances is not None:
                    u = x[below.reflectances]
                    most = {"conductor": CONDUCTOR_MAX, "mirror": 1.0}.get(below.kind, REFLECTANCE_MAX)
                    x[below.reflectances] = np.minimum(u * (darker if len(u) == 3 else np.mean(darker)), most)
            if n == 0 and (len(places) == 2 or k == 0):
                target = with_depth(target, k, depth)
        space = dataclasses.replace(self.space, interfaces=tuple(interfaces))
        return dataclasses.replace(self, point=Point(space, x), target=target)

    def _placed(self, k: int, point: Array) -> tuple[DraggedStack, list[int], Compromise | None]:
        """With the indices and the tint of a member, its lobes not yet met.

        Returns the coordinates that these hold, too, and how the index of a last dielectric is held where something
        absorbs above it.
        """
        x, interfaces, level = self.point.x.copy(), list(self.interfaces), None
        held: list[int] = []
        eta_1 = self.space.exterior
        for n, (own, part) in enumerate(zip(interfaces, self.point.layers)):
            if own.lobe == k and own.kind != "mirror":
                wanted = float(point[len(held)])
                if own.log_index is not None:
                    x[own.log_index] = np.log(wanted)
                    held.append(own.log_index)
                elif own.kind == "conductor":
                    interfaces[n] = dataclasses.replace(own, tint=retinted(own.tint, float(np.mean(own.tint)), wanted))
                else:
                    assert own.reflectances is not None
                    interfaces[n] = dataclasses.replace(own, side=-1 if wanted < eta_1 else 1)
                    x[own.reflectances] = _scaled_to(x[own.reflectances], fresnel.normal_incidence(wanted / eta_1))
                    if own.depth is not None:
                        bound = Bound(k, "absorption", 1, float(np.log(wanted)), interface=n)
                        level = Compromise(bound, own.depth)
            if own.kind == "dielectric":
                eta_1 = float(np.exp(x[own.log_index]) if own.log_index is not None else part.eta[0, 0])
        space = dataclasses.replace(self.space, interfaces=tuple(interfaces))
        return dataclasses.replace(self, point=Point(space, x)), held, level


def seen(stack: Stack, target: Target, model: Model, quick: bool = False) -> Target:
    """A target with the energies and blurs that a stack of its form has; `quick`: by the nearest model that adds up
    layers, films known roughly."""
    form = target
    for k in range(len(target.lobes)):
        form = form.with_lobe(k, fixed=Fixed())
    dragged = DraggedStack.of(stack, form, model)
    assert dragged is not None
    space = dragged.space.quickly if quick else dragged.space
    return dragged._target_of(space.read(dragged.point.x[:, None])[:, 0], target)


def with_depth(target: Target, k: int, depth: Array | None) -> Target:
    """A target with the optical depth (3,) of the medium above a lobe held fixed, not held where it is 0 or None."""
    lobe = target.lobes[k]
    tau: tuple[Any, ...] = ()
    if depth is not None and np.any(depth > 0):
        tau = (tuple(depth.tolist()), *[None] * (lobe.interfaces - 1))
    fixed = lobe.fixed.model_copy(update={"tau": tau})
    return target.with_lobe(k, fixed=fixed)


def _scaled_to(reflectances: Array, most: float) -> Array:
    """Reflectances with another largest one, no channel without any."""
    now = np.max(reflectances)
    return max(most, ENERGY_MIN) * (reflectances / now if now > 0 else np.ones_like(reflectances))


def _fixes_last(lobe: TargetLobe) -> bool:
    """Whether the last interface of a lobe, or the medium above it, keeps a value other than its roughness."""
    return any(lobe.fixed.of(key, lobe.interfaces - 1) is not None for key in ("eta", "k", "tau"))


def pinned(lobe: TargetLobe, first: bool) -> bool:
    """Whether more is fixed of a lobe than what is a constant here: media above the first and of pairs, their index."""
    last = lobe.interfaces - 1
    pins = [("eta", last), ("k", last), *(("alpha", n) for n in range(lobe.interfaces))]
    pins += [("tau", last)] if last or not first else []
    return any(lobe.fixed.of(key, n) is not None for key, n in pins)
