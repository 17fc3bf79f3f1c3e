"""Solutions that a page without Python interpolates about presets: how far their light is from that of the solver.

- one, two: random values on one axis of a preset's table, each in turn, and on two of them, near the preset's own: the
  light that is elsewhere than in the solved BSDF, as a part of all, over directions; and that of the closed form for
  the same materials. Those are left out that the page draws in closed form, since two values have moved far.
- size, time: of the table of a preset, as the folder holds it, and processor time to write it.

    python benchmarks/tabulated.py [--presets NAME ...] [--seed 0]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

from interpolating import Interpolated, flat, random_values
from rows import parsed, row

from velatura.editor.packing import packed
from velatura.model import DEFAULT, named
from velatura.stack import preset, presets


def main() -> None:
    options = parsed(__doc__, presets=list(presets(mixtures=False)), seed=0)
    rng = np.random.default_rng(options.seed)
    errors: dict[str, list[np.ndarray]] = {"one": [], "two": []}
    sizes, times, beyond = [], [], 0
    for name in options.presets:
        made = Interpolated(preset(name), named(DEFAULT))
        begin = time.process_time()
        axes = made.table["axes"]
        times.append(time.process_time() - begin)
        sizes.append(len(packed(made.table)) / 1e3)
        for count, kind in enumerate(errors, 1):
            stacks = []
            for k in range(len(axes) if count <= len(axes) else 0):
                others = rng.choice([j for j in range(len(axes)) if j != k], count - 1, replace=False)
                near = flat(made.stack) if count > 1 else None
                values = [random_values(axes[j], rng, near) for j in (k, *others)]
                stacks.append(made.stack.replace(**{key: x for each in values for key, x in each.items()}))
            found = made.at(stacks)
            beyond += sum(each is None for each in found)
            each = [made.distances(stack, each, rng) for stack, each in zip(stacks, found) if each]
            errors[kind] += each
            print(name, kind, *(f"{ours:.3f}/{closed:.3f}" for ours, closed in each), flush=True)
    row("tabulated", "size of a table", sizes, "kB", f"{sum(sizes) / 1e3:.2f} MB of {len(sizes)} presets")
    row("tabulated", "time of a table", times, "s", f"{sum(times):.0f} s in all")
    for kind, found in errors.items():
        values = np.array(found)
        if len(values):
            remark = f"mean {values[:, 0].mean():.3f}, 0.95 of them below {np.quantile(values[:, 0], 0.95):.3f}"
            nearer = f"farther than the closed form {int((values[:, 0] > values[:, 1]).sum())} of {len(values)}"
            row("tabulated", f"{kind} moved, light elsewhere", values[:, 0].tolist(), "", f"{remark}; {nearer}")
            row("tabulated", f"{kind} moved, closed form", values[:, 1].tolist(), "", f"mean {values[:, 1].mean():.3f}")
    print(f"drawn in closed form, since two have moved far: {beyond}")


if __name__ == "__main__":
    main()
