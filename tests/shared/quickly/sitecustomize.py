"""Run by any Python that has this folder on its path, before all else: the kernels of programs that tests start are
compiled as those of tests, into the folder that `DRJIT_CACHE_DIR` names, or at home."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

import quick_kernels

from velatura import kernel

quick_kernels.compile_quickly(kernel.kept_kernels())
