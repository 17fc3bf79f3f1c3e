"""Random inputs of every kind and what must hold of each: all of them in `benchmarks/fuzz.py`, slices in tests.

A trial is a function of a seed alone: it makes an input, tries it, and returns what was wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Trial = Callable[[np.random.Generator], "list[Failure]"]


@dataclass(frozen=True)
class Failure:
    """A failure on one input.

    Args:
        kind: in a word or two, the same for all that failed alike.
        detail: in one line.
        case: the input, in the types of YAML.
    """

    kind: str
    detail: str
    case: dict[str, Any] = field(default_factory=dict)
