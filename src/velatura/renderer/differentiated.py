"""A renderer's constants as numbers; those that are being differentiated, and steps over which to take differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.ops import Value
from velatura.renderer import finite_differences
from velatura.stack import Address, InterfaceValues, Material
from velatura.stack.chain import chain

# Steps over a value; those of films are small to phases
RELATIVES = {"alpha_u": 0.06, "alpha_v": 0.06, "rotation": 0.0, "film_thickness_nm": 0.0, "film_eta": 0.004}
RELATIVE = 0.02
STEPS = {
    "alpha_u": 0.004,
    "alpha_v": 0.004,
    "rotation": 1.0,
    "film_thickness_nm": 3.0,
}  # least; rotations are in degrees
STEP = 0.005
UPRIGHT = 0.01  # of the density of flat facets, which counts
ROUNDED = 1e-6  # share of an index that means of colours are off by


@dataclass(frozen=True)
class Variables:
    """Differentiated numbers of a material, each with the values, and their channel, that it stands for; the material
    in NumPy, `start`."""

    given: list[finite_differences.DifferentiatedNumber]
    addresses: list[Address]
    start: Material

    @classmethod
    def of(cls, material: Material) -> Variables:
        """The numbers that are differentiated among a renderer's values."""
        addresses, values = zip(*material.values())
        return cls(finite_differences.variables(values), list(addresses), plain(material))

    def around(self, k: int, x: float) -> tuple[float, float]:
        """Numbers a step below and above that of the k-th variable, x, within the range."""
        address = self.addresses[self.given[k].places[0][0]]
        low, high = address.declared.within
        step = max(RELATIVES.get(address.role, RELATIVE) * abs(x), STEPS.get(address.role, STEP))
        ends = max(x - step, low), min(x + step, high)
        if address.role != "eta":
            return ends
        # Light has a kink where a medium gets rarer than the outside, and shapes have the slope of its denser side
        denser = _denser(self.start)
        low, high = (x if np.any(denser & ~_denser(self._with(self.start, k, end))) else end for end in ends)
        return (low, high) if low < high else ends

    def by_whole(self) -> Iterator[tuple[int, float, tuple[float, float]]]:
        """Numbers whose slopes are differences of whole BSDFs: the number of the variable, its value, and the ends of
        the step. They are beside a kink. Of indices, steps end there, or over them another side of an interface gets
        the denser one, or light passes a medium rarer than the outside, or facets of which some stand upright: its
        edges, beyond which facets face away, move. Over those of a roughness, the axes of an interface among others
        become alike, or pass each other: it is brushed along another one, and lobes are parted anew.
        """
        edged = self.start.transmits and (_upright(self.start) or not _denser(self.start).all())
        for k, x in enumerate(self._numbers):
            role, ends = self.addresses[self.given[k].places[0][0]].role, self.around(k, x)
            if role == "eta":
                beside = edged or x in ends or len({_steps(self._with(self.start, k, each)) for each in ends}) > 1
            else:
                beside = role in ("alpha_u", "alpha_v") and len(self.start.interfaces) > 1 and self._passes(k, ends)
            if beside:
                yield k, x, ends

    def _passes(self, k: int, ends: tuple[float, float]) -> bool:
        """Whether an axis of an interface gets alike to the other one between the ends of a step of a variable."""
        low, high = ([*self._with(self.start, k, each).interfaces] for each in ends)
        return any(
            (a.alpha_u - a.alpha_v) * (b.alpha_u - b.alpha_v) <= 0 and a.alpha_u - a.alpha_v != b.alpha_u - b.alpha_v
            for a, b in zip(low, high)
        )

    def ends(self, material: Material) -> Iterator[Material]:
        """A material of NumPy's values with the numbers at both ends of the step of each variable."""
        for k, x in enumerate(self._numbers):
            yield from (self._with(material, k, end) for end in self.around(k, x))

    @property
    def _numbers(self) -> list[float]:
        values = [np.ravel(value) for _, value in self.start.values()]
        return [float(values[k][channel]) for k, channel in (variable.places[0] for variable in self.given)]

    def _with(self, material: Material, k: int, x: float) -> Material:
        """A material of NumPy's values with x for the k-th variable."""
        numbers = self._numbers
        return self.replaced(material, [*numbers[:k], x, *numbers[k + 1 :]])

    def without(self, material: Material, variables: Sequence[int]) -> Material:
        """A renderer's material without the gradients of some variables."""
        import drjit as dr

        chosen = self._places(variables)
        return _by_channel(material, lambda place, x: dr.detach(x) if place in chosen else x)

    def moved(self, material: Material, k: int, step: float) -> Material:
        """A renderer's material without gradients, the k-th variable a step further."""
        import drjit as dr

        chosen = self._places([k])
        return _by_channel(material, lambda place, x: dr.detach(x) + step if place in chosen else dr.detach(x))

    def _places(self, variables: Sequence[int]) -> set[tuple[str, int]]:
        """Names and channels of the values of variables."""
        return {(self.addresses[at].name, channel) for k in variables for at, channel in self.given[k].places}

    def replaced(self, material: Material, numbers: Sequence[float]) -> Material:
        """The material of NumPy's values, floats or colours (C, 1), with these numbers of the variables."""
        changed: dict[str, dict[int, float]] = {}
        for variable, x in zip(self.given, numbers):
            for k, channel in variable.places:
                changed.setdefault(self.addresses[k].name, {})[channel] = x

        def value(address: Address, old: Any) -> Any:
            new = changed.get(address.name)
            if new is None:
                return old
            if not address.colour:
                return new[0]
            colour = np.array(old, float)
            for channel, x in new.items():
                colour[channel] = x
            return colour

        return material.each(value)


def _by_channel(material: Material, change: Callable[[tuple[str, int], Any], Any]) -> Material:
    """A renderer's material with each channel changed, by its name and number."""
    import drjit as dr

    def value(address: Address, old: Any) -> Any:
        if not dr.is_array_v(old):
            return old
        if dr.depth_v(old) == 1:
            return change((address.name, 0), old)
        return type(old)([change((address.name, k), channel) for k, channel in enumerate(old)])

    return material.each(value)


def _denser(material: Material) -> NDArray[np.bool_]:
    """Whether each medium that light leaves by an interface is no rarer than the outside, seen from either side."""
    found = []
    for seen in [material, material.reversed()] if material.transmits else [material]:
        outside = (1 - ROUNDED) * np.mean(seen.exterior)
        found += [np.mean(each.above) >= outside for each in chain(seen) if isinstance(each.layer, InterfaceValues)]
    return np.array(found, bool)


def _upright(material: Material) -> bool:
    """Whether facets are so rough together that upright ones have a hundredth of the density of flat ones: GGX has
    alpha^4 of it there."""
    return sum(layer.alpha_u * layer.alpha_v for layer in material.interfaces) > UPRIGHT**0.5


def _steps(material: Material) -> tuple[bool, ...]:
    """Whether the medium below each interface of a dielectric is no rarer than that above it."""
    each = ((meeting.layer, meeting.above) for meeting in chain(material))
    return tuple(
        bool(np.mean(layer.eta) >= (1 - ROUNDED) * np.mean(above))
        for layer, above in each
        if isinstance(layer, InterfaceValues) and layer.kind == "dielectric"
    )


def plain(material: Material) -> Material:
    """A material of a renderer's constants with values of NumPy: floats, and colours (C, 1)."""

    def value(found: Value, colour: bool) -> Any:
        channels = np.ravel(found).tolist() if isinstance(found, float | np.ndarray) else kernel.numbers(found)
        return np.array(channels, float)[:, None] if colour else float(channels[0])

    numbers = material.each(lambda address, found: value(found, address.colour)).coated([None] * len(material.layers))
    return numbers if isinstance(material.light, str) else replace(numbers, light=np.ravel(np.array(material.light)))
