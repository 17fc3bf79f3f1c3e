"""Slices of `benchmarks/fuzz.py`: random stacks of every shape in NumPy, through the plugin, and held to the laws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fuzzing import checking, gradients, lobes, pictures, plugin, scalar
from fuzzing.models import random_model
from fuzzing.stacks import BASES, random_stack, textured

from velatura import MODELS
from velatura.model.registry import named
from velatura.stack import Interface, Stack

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.mark.parametrize("form", ["forward", "symmetric"])
@pytest.mark.parametrize("model", [model.name for model in MODELS])
def test_the_bsdf_of_any_stack(model: str, form: str) -> None:
    """Half of the bases in either form, panes and metals and paint, one stack in three absurd.

    Answers are finite and not negative, on either side, down to the horizon; `sample`, `pdf`, `eval` and `eval_pdf`
    agree; directions are of length 1; the density integrates to 1 at most, by 6 standard errors of a quadrature.
    """
    for k, base in enumerate(BASES):
        if k % 2 == (form == "symmetric"):
            rng = np.random.default_rng((k, *model.encode()))
            stack = random_stack(rng, absurd=k < 2, most=2, base=base)
            assert not plugin.tried(stack, named(model, form=form), rng)


@pytest.mark.parametrize("k", range(len(MODELS)))
def test_the_bsdf_of_any_stack_in_scalar_rgb(k: int) -> None:
    """No division by zero raises, at the exact normal and in the mirror direction too; samples are what is asked."""
    rng = np.random.default_rng((2, k))
    stack = random_stack(rng, absurd=k % 2 == 1, most=1, base=BASES[k % len(BASES)])
    assert not scalar.tried(stack, MODELS[k], rng)


def test_the_lobes_of_any_stack() -> None:
    """All models and switches, eight cosines down to 1e-6: finite, no energy gained, none that jumps."""
    rng = np.random.default_rng(0)
    assert not [failure for _ in range(100) for failure in lobes.trial(rng)]


@pytest.mark.usefixtures("few_samples")
@pytest.mark.parametrize("base", BASES)
def test_the_laws_of_any_stack(base: str) -> None:
    """No law is broken that is not declared; `vt.check` gives a false alarm in one of 1000 reports."""
    rng = np.random.default_rng((1, *base.encode()))
    assert not checking.tried(random_stack(rng, base=base), random_model(rng, changed=0, keep=["channels"]))


def test_the_gradients_of_any_stack() -> None:
    """Up to four values each: gradients are finite, and the differences of the light that leaves."""
    assert not gradients.trial(np.random.default_rng((0, *b"gradients", 8)))


@pytest.mark.parametrize(("form", "base"), [("forward", "thin"), ("symmetric", "metal")])
def test_the_bsdf_of_a_textured_stack(tmp_path: Path, form: str, base: str) -> None:
    """As for any stack, with values from an image in colour."""
    image = tmp_path / "texture.png"
    image.write_bytes(pictures.png())
    rng = np.random.default_rng(3)
    stack = textured(random_stack(rng, most=1, base=base), rng, str(image))
    assert not plugin.tried(stack, named("bati2021", form=form), rng)


@pytest.mark.parametrize(
    ("light", "gradient", "kind"),
    [
        (lambda x: 1 + 0.5 * x, 0.5, ""),
        (lambda x: 1 + 0.5 * x, 2.0, "gradient of alpha_u is no difference"),
        (lambda x: 1 + 0.5 * x, np.nan, "gradient is not finite"),
        (lambda x: 1 + 5 * (x - 1) ** 2 + 0.5 * x, 0.9, ""),  # curved, on one side of the difference
        (lambda x: 1 + 9 * max(x - 1, 0), 0.2, ""),
        (lambda x: 1 + 9 * max(x - 1, 0), -3.0, "gradient of alpha_u is no difference"),
        (lambda x: 9 * max(x - 1, 0) ** 0.5, 50.0, ""),  # as reflected light of an interface without a step
        (lambda x: 1 + 0.5 * x + 0.02 * (x == 1), 2.0, "light jumps at a value of alpha_u"),
    ],
    ids=["linear", "wrong", "not finite", "curved", "kink", "beside a kink", "root", "jump"],
)
def test_gradients_are_judged_beside_curvature_kinks_and_jumps(
    light: Callable[[float], float], gradient: float, kind: str
) -> None:
    """By light of a known slope."""
    at = next(at for at, _ in Stack([Interface(conductor="mirror", alpha=0.2)]).values() if at.role == "alpha_u")
    found = [name for name, _ in gradients.judged(at, gradient, light, (0.94, 1.06), light(1.0))]
    assert found == [kind] * bool(kind)
