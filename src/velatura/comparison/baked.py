"""Bakes beside the named models: parameters of other programs, in their own formulas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from velatura import bakes, kernel
from velatura.bakes import Bake
from velatura.comparison.plugins import without_lobes
from velatura.comparison.result import Account
from velatura.errors import InvalidInput
from velatura.stack import Described

RENDERED = "mitsuba-principled"


def account(made: Bake, material: Described, cos_theta: Sequence[float]) -> Account:
    """The distribution of a bake's light; its lobes are unknown, and NaN."""
    return without_lobes(material, bakes.distribution(made, material, cos_theta))


def check_pictures(names: Sequence[str]) -> None:
    """Refuse bakes that no renderer here has.

    Raises:
        InvalidInput: one of them is among the names.
    """
    formulas = [name for name in names if name in bakes.TARGETS and name != RENDERED]
    if formulas:
        raise InvalidInput(f"pictures: not with {', '.join(formulas)}; of the bakes, only {RENDERED} is rendered here")


def bsdf(made: Bake) -> Any:
    """Mitsuba's plugin with the parameters of a bake."""
    values = {
        name: {"type": "rgb", "value": list(value)} if isinstance(value, tuple) else value
        for name, value in made.values.items()
    }
    return kernel.load_dict({"type": "principled", **values})
