"""Random stacks of every shape through the plugin and the command line; `benchmarks/fuzz.py` tries many more."""

from __future__ import annotations

import numpy as np
import pytest
from fuzzing import plugin
from fuzzing.stacks import BASES, random_stack

from velatura import MODELS
from velatura.model.models import named


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("model", [model.name for model in MODELS])
def test_the_bsdf_of_any_stack(model: str, form: str) -> None:
    """Over half of the bases each, panes and metals and paint, one stack in three absurd.

    Answers are finite and not negative, on either side, down to the horizon; `sample`, `pdf`, `eval` and `eval_pdf`
    agree; directions are of length 1; the density integrates to 1 at most, by 6 standard errors of a quadrature.
    """
    for k, base in enumerate(BASES):
        if k % 2 == (form == "symmetric"):
            rng = np.random.default_rng((k, *model.encode()))
            stack = random_stack(rng, absurd=k < 2, most=2, base=base)
            assert not plugin.tried(stack, named(model, form=form), rng)
