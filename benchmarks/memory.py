"""Memory: the most that processes hold at once which load, prepare and render materials, and the bytes of tables.

Each number is the peak of the resident set of a process of its own, less that of one that has loaded Mitsuba alone.

    python benchmarks/memory.py [--rounds 3] [--spp 64] [--size 512]
"""

from __future__ import annotations

import argparse
import subprocess
import sys

from rows import row

from velatura.tables import FILE

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
PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"


def peak(code: str) -> float:
    """MiB that a process holds at most."""
    run = subprocess.run([sys.executable, "-c", f"{code}\n{PEAK}"], check=True, capture_output=True, text=True)
    return int(run.stdout.split()[-1]) / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--steps", nargs="+", choices=list(STEPS), default=list(STEPS), metavar="STEP")
    options = parser.parse_args()
    alone = [peak(MITSUBA) for _ in range(options.rounds)]
    row("memory", "Mitsuba alone", alone, "MiB")
    for name in options.steps:
        code = STEPS[name].format(spp=options.spp, size=options.size)
        found = [peak(f"{MITSUBA}\nimport velatura as vt\n{code}") - min(alone) for _ in range(options.rounds)]
        row("memory", name, found, "MiB more")
    row("memory", "tables, as a file", FILE.stat().st_size / 2**20, "MiB")


if __name__ == "__main__":
    main()
