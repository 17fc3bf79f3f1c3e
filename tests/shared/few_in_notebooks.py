"""Fewer samples of pictures, walks that models are compared with, places at which fits start, and processes of sweeps
where this module has been imported: notebooks take long for them, and print nothing of them, or the same of less."""

from __future__ import annotations

import functools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from velatura import api, comparison, inverse, sweeps


def _with(function: Callable[..., Any], **fewer: Any) -> Callable[..., Any]:
    @functools.wraps(function)
    def called(*given: Any, **named: Any) -> Any:
        return function(*given, **{**named, **fewer})

    return called


api.render = _with(api.render, spp=4)
comparison.compare = _with(comparison.compare, paths=10_000)
inverse.fit_target = _with(inverse.fit_target, starts=1)
sweeps.sweep = _with(sweeps.sweep, executor=ThreadPoolExecutor(1))  # as bits, what processes give
