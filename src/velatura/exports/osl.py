"""A material in Open Shading Language."""

from __future__ import annotations

from velatura.exports.request import Export, Request, headed, stated
from velatura.shader.printers.osl import osl


def write(request: Request) -> Export:
    """A shader with one output, a sum of closures; it holds all tables that it reads."""
    made = osl(request.material, request.model, request.constants)
    return Export(headed(made.text), facts={"entry_points": {made.name: {}}, "loss": stated(made.losses)})
