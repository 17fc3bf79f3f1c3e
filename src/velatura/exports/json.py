"""The material and its model in JSON, with names and defaults worked out to numbers."""

from __future__ import annotations

import json
from pathlib import Path

from velatura.exports.request import Export, Request
from velatura.model import SWITCHES
from velatura.shader import constant
from velatura.stack import Varying, dumps


def write(request: Request) -> Export:
    """`material` as its file would have it, with paths relative to its folder or the current one, `model` with all
    switches, and `values` by flat name."""
    free = [(address, value) for address, value in request.material.values() if not isinstance(value, Varying)]
    numbers = {address.name: constant(address, value) for address, value in free}
    report = {
        "material": json.loads(dumps(request.material, "json", request.folder or Path())),
        "model": {"name": request.model.name, **{switch: getattr(request.model, switch) for switch in SWITCHES}},
        "values": {name: value if isinstance(value, float) else value.tolist() for name, value in numbers.items()},
    }
    return Export(json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
