"""Cost of 1 to 10 interfaces: `eval_pdf`, `sample`, a render, and preparation, as ratios to `roughconductor`.

Coats of indices 1.3 to 1.7 over gold. Jobs are interleaved: each round times every one, and a ratio is of two times of
the same round. Rows are medians over rounds, with quartiles; times of preparation are seconds of the processor.

    python benchmarks/interfaces.py [--rounds 9] [--most 10] [--spp 64] [--size 512] [--count 1048576]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import render
from rows import parsed, row

import velatura as vt
from velatura import kernel
from velatura.checks.probe import Probe

YARDSTICK = "roughconductor"


def stack(interfaces: int, alpha: float = 0.2) -> vt.Stack:
    """Coats over gold."""
    coats = [vt.Interface(eta=(1.5, 1.7, 1.3)[k % 3], alpha=(0.05, 0.1)[k % 2]) for k in range(interfaces - 1)]
    return vt.Stack([*coats, vt.Interface(conductor="Au", alpha=alpha)])


def queries(mi: Any, bsdf: Any, count: int, sampled: bool) -> Callable[[int], None]:
    """A function that evaluates random directions once, or draws them."""
    import drjit as dr

    rng = mi.PCG32(count)

    def point() -> Any:
        return mi.Point2f(rng.next_float32(), rng.next_float32())

    def job(seed: int) -> None:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.warp.square_to_cosine_hemisphere(point())
        if sampled:
            found = bsdf.sample(mi.BSDFContext(), si, rng.next_float32(), point())
        else:
            found = bsdf.eval_pdf(mi.BSDFContext(), si, mi.warp.square_to_cosine_hemisphere(point()))
        dr.eval(found, rng)  # the latter, so that every round has the same kernel
        dr.sync_thread()

    return job


def preparation(interfaces: int, rounds: int) -> list[float]:
    """Seconds of the processor until a changed material has been evaluated once."""
    wi, wo = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])
    spent = []
    for number in range(rounds + 1):
        begin = time.process_time()
        Probe(vt.bsdf(stack(interfaces, 0.1 + 0.2 * number / rounds))).eval_pdf(wi, wo)
        spent.append(time.process_time() - begin)
    return spent[1:]  # the first one compiles


def main() -> None:
    options = parsed(__doc__, rounds=9, most=(10, "interfaces"), spp=64, size=512, count=(1 << 20, "directions"))
    mi = kernel.mitsuba("llvm_ad_rgb")
    vt.register()
    numbers = range(1, options.most + 1)
    materials = {YARDSTICK: mi.load_dict({"type": YARDSTICK, "material": "Au", "alpha": 0.2, "distribution": "ggx"})}
    materials |= {f"{n} interfaces": vt.bsdf(stack(n)) for n in numbers}
    jobs: dict[str, Callable[[Any], Any]] = {
        "eval_pdf": lambda bsdf: queries(mi, bsdf, options.count, sampled=False),
        "sample": lambda bsdf: queries(mi, bsdf, options.count, sampled=True),
        "render": lambda bsdf: render.picture(mi, bsdf, options.size, options.spp),
    }
    for title, make in jobs.items():
        times = render.timed({name: make(bsdf) for name, bsdf in materials.items()}, options.rounds)
        row(title, YARDSTICK, times[YARDSTICK])
        for name in list(materials)[1:]:
            row(title, name, [t / first for t, first in zip(times[name], times[YARDSTICK])], f"x {YARDSTICK}")
    for n in numbers:
        row("preparation", f"{n} interfaces", preparation(n, options.rounds))


if __name__ == "__main__":
    main()
