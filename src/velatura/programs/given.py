"""Parameters of a source as a file or a caller gives them: checked, completed, and asked for by their kind."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from velatura.errors import InvalidInput
from velatura.programs.imported import Notes, shown
from velatura.programs.parameters import Input
from velatura.programs.surface import INDICES
from velatura.programs.values import Array, Value, changed, colour, rounded, texels
from velatura.stack import RGB, Texture
from velatura.stack.schema import show, unknown

ROUNDING = 0.02  # of values at the ends of their ranges, as colours have it that were converted


class Given:
    """The values of all declared parameters.

    Args:
        values: by name: numbers, colours, images (`vt.Texture`, or a mapping as in a material file), true or false.
        ignored: names that may be given, with the reason why a stack does not carry them.

    Raises:
        InvalidInput: an unknown name, or a value of another kind; one line that names the parameter.
    """

    def __init__(
        self, values: Mapping[str, Any], declared: Sequence[Input], ignored: Mapping[str, str], notes: Notes
    ) -> None:
        self.notes = notes
        self._declared = {each.name: each for each in declared}
        self._values: dict[str, Value] = {each.name: each.default for each in declared}
        self._beyond: dict[str, object] = {}
        for name, value in values.items():
            if name in self._declared:
                self._values[name] = self._read(self._declared[name], value)
            elif name in ignored:
                notes.add(name, value, ignored[name])
            else:
                raise InvalidInput(unknown("parameter", name, [*self._declared, *ignored]))

    def __getitem__(self, name: str) -> Value:
        if name in self._beyond:
            declared = self._declared[name]
            limits = f"{declared.low:g} to {declared.high:g}"
            self.notes.add(name, self._beyond[name], f"outside {limits}: the end stands for it")
        return self._values[name]

    def number(self, name: str) -> float:
        """One number; the mean of an image."""
        return float(np.mean(self._plain(name)))

    def colour(self, name: str) -> RGB:
        """A colour; the mean of an image."""
        return colour(self._plain(name))

    def share(self, name: str) -> float | Texture:
        """A share of a surface: a number, or an image of them unless that is the same everywhere."""
        value = self[name]
        if not isinstance(value, Texture):
            if isinstance(value, tuple) and len(set(value)) > 1:
                self.notes.add(name, value, "one share for all colours, their mean")
            return float(np.mean(value))
        found = np.clip(texels(value, self._declared[name].is_colour), 0, 1)
        if np.ptp(found) == 0:
            return rounded(float(found.flat[0]))
        if np.ptp(found, axis=-1).max() > ROUNDING:
            self.notes.add(name, value, "one share for all colours, that of green")
        return value.model_copy(update={"channel": "g"}) if value.channel == "rgb" else value

    def replace(self, name: str, value: Value) -> None:
        """Put another value in place of one that was given."""
        self._values[name] = value

    def leave(self, name: str, why: str) -> None:
        """Note a parameter that is not carried, unless it has its default value."""
        if self._values[name] != self._declared[name].default:
            self.notes.add(name, self._values[name], why)

    def index(self, name: str) -> float:
        """An index, within what stacks take."""
        value = self.number(name)
        kept = float(np.clip(value, *INDICES))
        if kept != value:
            self.notes.add(name, value, f"outside {INDICES[0]:g} to {INDICES[1]:g}: the end stands for it")
        return kept

    def tinted(self, name: str, factor: float, tint: RGB) -> RGB:
        """Factors on the reflectance of a dielectric at the normal, by colours."""
        if max(tint) - min(tint) < ROUNDING:
            tint = (sum(tint) / 3,) * 3
        else:
            self.notes.add(name, self[name], "as an index by colour, with no tint towards the edge")
        red, green, blue = (factor * each for each in tint)
        return red, green, blue

    def blended(self, base: str, weight: float, below: str, share: float) -> Value:
        """The colour of a diffuse base: a weighed one, mixed with that of scattering below."""
        if share == 1:
            return self[below]
        if share == 0 or not isinstance(self[base], tuple):
            if share:
                self.notes.add(below, self[below], f"{base} stands for both, as it is an image")
            return changed(self[base], lambda c: weight * c)
        mixed = (1 - share) * weight * np.array(self.colour(base)) + share * np.array(self.colour(below))
        return tuple(mixed.tolist())

    def inside(self, name: str, sigma_a: Array, sigma_s: RGB = (0.0, 0.0, 0.0), g: float = 0.0) -> None:
        """Note a medium that fills a shape, which no stack holds."""
        if not (np.any(sigma_a) or np.any(sigma_s)):
            return
        values = f"sigma_a {shown(tuple(map(float, sigma_a)))}"
        values += f", sigma_s {shown(sigma_s)}, g {shown(g)}" if any(sigma_s) else ""
        why = f"fills the shape: in Mitsuba, an interior medium of {values} per unit of length of the scene"
        self.notes.add(name, self[name], why)

    def _plain(self, name: str) -> float | RGB:
        value = self[name]
        if not isinstance(value, Texture):
            return value
        self.notes.add(name, value, "the mean of the image stands for it")
        found = np.mean(texels(value, self._declared[name].is_colour), axis=(0, 1))
        return colour(found) if len(found) == 3 else float(found[0])

    def _read(self, declared: Input, value: Any) -> Value:
        if isinstance(value, Mapping):
            value = Texture.from_dict(value)
        if isinstance(value, Texture):
            return (
                value if value.channel else value.model_copy(update={"channel": "rgb" if declared.is_colour else "r"})
            )
        value = value.tolist() if hasattr(value, "tolist") else value
        if declared.is_flag and type(value) is bool:
            value = float(value)
        wanted = "a number or [r, g, b]" if declared.is_colour else "a number"
        entries = value if isinstance(value, list | tuple) else (value,)
        if len(entries) not in ((1, 3) if declared.is_colour else (1,)) or not all(map(is_number, entries)):
            raise InvalidInput(f"{declared.name}: must be {wanted}, got {show(value)}")
        kept = [min(max(float(entry), declared.low), declared.high) for entry in entries]
        if any(abs(float(entry) - end) > ROUNDING for entry, end in zip(entries, kept)):
            self._beyond[declared.name] = value
        return colour(kept if len(kept) == 3 else kept[0]) if declared.is_colour else kept[0]  # type: ignore[arg-type]


def is_number(value: object) -> bool:
    """Whether a value is a finite number, and not true or false."""
    try:
        return not isinstance(value, bool) and isinstance(value, numbers.Real) and math.isfinite(value)
    except OverflowError:  # an integer that no float holds
        return False
