"""Random models: a named one, some of its switches changed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from velatura.model import MODELS, SWITCHES
from velatura.model.base import Model


def random_model(rng: np.random.Generator, changed: float = 0.25, keep: Sequence[str] = ()) -> Model:
    """A named model in either form, each of the other switches but those of `keep` changed with a probability."""
    model = MODELS[rng.integers(len(MODELS))]
    form = str(rng.choice(SWITCHES["form"]))
    switches = {key: str(rng.choice(model.allowed(key))) for key in SWITCHES if rng.random() < changed}
    return model.with_switches(**{key: value for key, value in {**switches, "form": form}.items() if key not in keep})


def described(model: Model) -> dict[str, str]:
    """The model in words: its name, and the switches that differ from what the name stands for."""
    (published,) = (known for known in MODELS if known.name == model.name)
    changed = {key: getattr(model, key) for key in SWITCHES if getattr(model, key) != getattr(published, key)}
    return {"model": model.name, **changed}
