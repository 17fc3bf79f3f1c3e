"""Render time of models and forms against each other, as ratios of interleaved renders (`benchmarks/render.py`).

A coat over gold, the same stack brushed along one axis, and brushed with axes of their own. Of a uniform stack
the lobes are looked up for every model: with two interfaces all published models run the same kernel, and cost the
same. The savings of `realtime` show with more lobes to merge (`five`), and where lobes are worked out at every
point (`textured`). Medians over rounds of the ratio of two renders of the same round.

    python benchmarks/models.py [--rounds 9] [--spp 64] [--variant llvm_ad_rgb]
"""

from __future__ import annotations

from typing import Any

import render
from rows import parsed, row

import velatura as vt
from velatura import kernel
from velatura.model import MODELS


def stacks() -> dict[str, vt.Stack]:
    """The same stack isotropic, brushed along shared axes, and with each layer's own."""
    brushings = {"isotropic": ((0.1, 0.1), 0.0), "brushed": ((0.05, 0.2), 0.0), "turned": ((0.05, 0.2), 60.0)}
    return {
        name: vt.Stack(
            [
                vt.Interface(eta=1.5, alpha=alpha),
                vt.Medium(sigma_a=(0.1, 0.5, 2.0)),
                vt.Interface(conductor="Au", alpha=tuple(2 * a for a in alpha), rotation=turn),
            ]
        )
        for name, (alpha, turn) in brushings.items()
    }


def material(mi: Any, stack: str, model: str, form: str) -> Any:
    """The BSDF of a job."""
    if stack == "textured":
        return render.textured(mi, render.stacks()["two interfaces"], model)
    uniform = {**stacks(), "five": render.stacks()["five interfaces"]}
    return vt.bsdf(uniform[stack], model=model, form=form)


def ratios() -> list[tuple[tuple[str, str, str], tuple[str, str, str]]]:
    """Pairs of jobs (stack, model, form): what is timed, and over what."""
    names = [model.name for model in MODELS]
    found = [
        ((stack, name, "forward"), ("isotropic", name, "forward")) for name in names for stack in ("brushed", "turned")
    ]
    found += [
        ((stack, name, "symmetric"), (stack, name, "forward")) for name in names for stack in ("isotropic", "turned")
    ]
    base = "belcour2018"
    return found + [
        ((stack, name, "forward"), (stack, base, "forward"))
        for name, against in (("realtime", ("isotropic", "five", "textured")), ("velatura", (*stacks(), "textured")))
        for stack in against
    ]


def main() -> None:
    arguments = parsed(
        __doc__, rounds=9, spp=64, size=512, models=[model.name for model in MODELS], variant="llvm_ad_rgb"
    )
    mi = kernel.mitsuba(arguments.variant)
    vt.register()
    wanted = [pair for pair in ratios() if all(model in arguments.models for _, model, _ in pair)]

    keys = dict.fromkeys(key for pair in wanted for key in pair)
    jobs = {key: render.picture(mi, material(mi, *key), arguments.size, arguments.spp) for key in keys}
    times = render.timed(jobs, arguments.rounds)
    for over, under in wanted:
        label = " ".join(a if a == b else f"{a}/{b}" for a, b in zip(over, under))
        row("render", label, [a / b for a, b in zip(times[over], times[under])], "x")


if __name__ == "__main__":
    main()
