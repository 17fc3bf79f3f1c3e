"""How far energies of media are from those of outside solvers, in shares of the incident light.

    python benchmarks/transfer.py

The tables, with their sources, are tests/shared/radiative_transfer.json: van de Hulst, Giovanelli and DISORT (slabs);
adding-doubling of slabs with steps of the index and plates of glass (plates) and walks of such; DISORT with 64 streams,
of one to three media over diffuse bases, and of such of other phase functions (phases, and mie, which needs the extra
`mie`); Rayleigh's by Sweigart (rayleigh); and semi-infinite isotropic media by Chandrasekhar's H function, here of
depths 100, 10^4 and 10^6. Printed: the mean error, the largest one, and how many numbers there are.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import radiative_transfer as known
from rows import row

TABLES = ("slabs", "plates", "walks", "disort_64", "phases", "mie", "rayleigh", "semi_infinite")


def main() -> None:
    for table in TABLES:
        errors = np.abs(np.concatenate([each.errors() for each in known.rows(table)]))
        row(table, "mean error", errors.mean(), "", f"worst {errors.max():.2g}, {errors.size} numbers")


if __name__ == "__main__":
    main()
