"""Functions of the cosine of one material, sampled once, so that all of them are one fetch."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from velatura import ops
from velatura.ops import Value
from velatura.tables import coordinates

NODES = 512


@dataclass(frozen=True, eq=False)
class Curves:
    """Values at the nodes, as a texture of Dr.Jit with a channel for each function."""

    held: Any
    shape: tuple[int, ...] = (NODES,)

    def texture(self, dialect: Any) -> Any:
        return self.held

    def __call__(self, cos_theta: Value) -> list[Value]:
        return ops.interpolate(self, coordinates.from_cosine(cos_theta))


def sample(functions: Callable[[Value], Sequence[Value]], number: type) -> Curves:
    """The functions at all nodes, in one kernel, for Dr.Jit numbers of that type; differentiable."""
    import drjit as dr

    dialect: Any = sys.modules[number.__module__]
    none: Any = dr.zeros(number, NODES)
    columns = [none + column for column in functions(coordinates.to_cosine(dr.linspace(number, 0, 1, NODES)))]
    dr.eval(columns)
    # Interleave
    flat: Any = dr.zeros(number, NODES * len(columns))
    row = dr.arange(dialect.UInt32, NODES) * len(columns)
    for k, column in enumerate(columns):
        dr.scatter(flat, column, row + k)
    dr.eval(flat)
    tensor = dialect.TensorXf(flat, (NODES, len(columns)))
    return Curves(dialect.Texture1f(tensor, use_accel=False, wrap_mode=dr.WrapMode.Clamp))
