"""Functions as tests of the manual call them: with fewer samples, steps and the like than its pages ask for."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any


def with_less(function: Callable[..., Any], **fewer: Any) -> Callable[..., Any]:
    """A function, called with other values of those parameters that it has; a function makes one of that given."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def called(*given: Any, **named: Any) -> Any:
        bound = signature.bind(*given, **named)
        for key in fewer.keys() & signature.parameters.keys():
            value = fewer[key]
            bound.arguments[key] = value(bound.arguments.get(key)) if callable(value) else value
        return function(*bound.args, **bound.kwargs)

    return called
