"""How far values of slabs without a step of the index are from those of DISORT: what single scattering by itself gains.

    python benchmarks/slabs.py

Slabs of Rayleigh's phase function and of Henyey and Greenstein's, of three depths and albedos, lit at three cosines,
against PythonicDISORT with 64 streams (tests/shared/slab_radiances.npz: f at 8 Gaussian cosines and 6 azimuths,
reflected and passed). Printed: the cosine-weighted error over the light, its mean, and its worst, by phase function,
for both forms.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import slab_radiances as known
from rows import row


def main() -> None:
    for form in ("forward", "symmetric"):
        cases = known.cases()
        errors = np.array([known.errors(case, form) for case in cases])
        names = np.array([case.name for case in cases])
        for name in dict.fromkeys(names):
            for side, found in zip(("reflected", "passed"), errors[names == name].T):
                row(form, f"{name}, {side}", found.mean(), "", f"worst {found.max():.2g}")
        for side, found in zip(("reflected", "passed"), errors.T):
            row(form, f"all, {side}", found.mean(), "", f"worst {found.max():.2g}")


if __name__ == "__main__":
    main()
