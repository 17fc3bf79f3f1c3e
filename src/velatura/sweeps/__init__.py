"""Sweeps: many materials from one description, on one machine or a cluster, into a Zarr store.

Needs the extra `sweep`.
"""

from velatura.sweeps.plan import Plan, load_plan
from velatura.sweeps.run import carry_out, sweep
from velatura.sweeps.space import Axis, Space

__all__ = ["Axis", "Plan", "Space", "carry_out", "load_plan", "sweep"]
