"""Random stacks held to the laws of `vt.check`: those that their model does not declare must not be broken."""

from __future__ import annotations

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.models import described, random_model
from fuzzing.stacks import random_stack
from velatura.model.base import Model


def trial(rng: np.random.Generator) -> list[Failure]:
    """One tame random stack; three in four models as they are named, in either form."""
    model = random_model(rng, changed=0.25 if rng.random() < 0.25 else 0.0, keep=["channels"])
    return tried(random_stack(rng), model)


def tried(stack: vt.Stack, model: Model) -> list[Failure]:
    """The laws that are broken."""
    case = {**described(model), "material": stack.to_dict()}
    try:
        report = vt.check(stack, model)
    except Exception as error:
        return [Failure(f"raised {type(error).__name__}", str(error).strip().splitlines()[-1], case)]
    found = [report[law] for law in report.broken]
    return [Failure(f"law broken: {x.law}", f"{x.value:.4g}, at most {x.bound:.4g}; {x.detail}", case) for x in found]
