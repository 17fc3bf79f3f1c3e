"""Memory: the most that processes hold at once which load, prepare and render materials, and the bytes of tables.

Each number is the peak of the resident set of a process of its own, less that of one that has loaded Mitsuba alone.
`--materials N` measures instead what one process holds after each of N materials, all different, that go through
`vt.lobes`, `vt.bsdf` with `eval`, and exports: its growth per material, once the first third is over.

    python benchmarks/memory.py [--rounds 3] [--spp 64] [--size 512] [--materials N [--seed 0]]
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from rows import parsed, row

from velatura.tables import FILE

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

PRESETS = ("coated-gold", "frosted-glass", "crossed-brushing", "pearl-lacquer")
RENDER = "vt.render({name!r}, spp={spp}, size=({size}, {size}))"
STEPS = {  # what a process does after it has imported Velatura
    "import": "",
    "tables": "from velatura.tables import load; load()",
    **{f"lobes of {name}": f"vt.lobes({name!r}, [1.0, 0.5])" for name in PRESETS},
    **{f"render of {name}": RENDER.replace("{name!r}", repr(name)) for name in PRESETS},
    "render of bare-gold by the reference": RENDER.replace("{name!r}", "'bare-gold', model='reference'"),
}
MITSUBA = "import mitsuba; mitsuba.set_variant('llvm_ad_rgb')"
EXPORTS = ("json", "python", "mitsuba-xml", "glsl", "wgsl")
PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"


def peak(code: str) -> float:
    """MiB that a process holds at most."""
    run = subprocess.run([sys.executable, "-c", f"{code}\n{PEAK}"], check=True, capture_output=True, text=True)
    return int(run.stdout.split()[-1]) / 1024


def growth(count: int, seed: int) -> None:
    """Rows of what materials leave behind: resident memory, fitted by a line, and open descriptors."""
    import gc

    import numpy as np
    import psutil
    from fuzzing.stacks import random_stack

    import velatura as vt
    from velatura import kernel

    mi = kernel.mitsuba("llvm_ad_rgb")
    import drjit as dr

    rng, process, held = np.random.default_rng(seed), psutil.Process(), []
    for _ in range(count):
        stack = random_stack(rng, most=2)
        vt.lobes(stack, [1.0, 0.5])
        bsdf, si = vt.bsdf(stack), dr.zeros(mi.SurfaceInteraction3f, 64)
        si.wi = mi.Vector3f(0.6, 0, 0.8)
        dr.eval(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(-0.6, 0, 0.8)))
        del bsdf
        for name in EXPORTS:
            vt.export(stack, name)
        gc.collect()
        held.append((process.memory_info().rss / 2**20, process.num_fds()))
    memory, descriptors = np.array(held)[count // 3 :].T
    slope = np.polyfit(range(len(memory)), memory, 1)[0]
    row("memory", f"resident, after {count} materials", memory[-1], "MiB")
    row("memory", f"growth over the last {len(memory)}", 1024 * slope, "KiB a material")
    row("memory", "open descriptors, growth", float(descriptors[-1] - descriptors[0]), "")


def main() -> None:
    options = parsed(__doc__, rounds=3, spp=64, size=512, materials=int, seed=0, steps=(list(STEPS), "", list(STEPS)))
    if options.materials:
        growth(options.materials, options.seed)
        return
    alone = [peak(MITSUBA) for _ in range(options.rounds)]
    row("memory", "Mitsuba alone", alone, "MiB")
    for name in options.steps:
        code = STEPS[name].format(spp=options.spp, size=options.size)
        found = [peak(f"{MITSUBA}\nimport velatura as vt\n{code}") - min(alone) for _ in range(options.rounds)]
        row("memory", name, found, "MiB more")
    row("memory", "tables, as a file", FILE.stat().st_size / 2**20, "MiB")


if __name__ == "__main__":
    main()
