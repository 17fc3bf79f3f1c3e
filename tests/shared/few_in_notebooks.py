"""Fewer samples of pictures, walks that models are compared with, places at which fits start, and processes of sweeps
where this module has been imported: notebooks take long for them, and print nothing of them, or the same of less."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from fewer import with_less

from velatura import api, comparison, inverse, sweeps

api.render = with_less(api.render, spp=4)
comparison.compare = with_less(comparison.compare, paths=10_000)
inverse.fit_target = with_less(inverse.fit_target, starts=1)
sweeps.sweep = with_less(sweeps.sweep, executor=ThreadPoolExecutor(1))  # as bits, what processes give
